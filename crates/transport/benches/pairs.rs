//! What the form factor of one pair costs, in double precision on one core.

use criterion::{Criterion, criterion_group, criterion_main};
use glam::{DQuat, DVec3};
use radiosity_scene::Facet;
use radiosity_transport::pair::blockers::Blockers;
use radiosity_transport::pair::exact::exact;
use radiosity_transport::{PairMethod, Unoccluded};
use std::hint::black_box;

fn square(turn: DQuat, shift: DVec3) -> Facet {
    let corners = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
    Facet::new(corners.iter().map(|c| turn * *c + shift).collect()).unwrap()
}

fn benches(c: &mut Criterion) {
    let floor = square(DQuat::IDENTITY, DVec3::ZERO);
    let over = |turn: DQuat, height: f64| square(turn, DVec3::new(0.0, 0.0, height)).flipped();
    let tilted = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.4);
    for (name, other) in [
        ("opposite", over(DQuat::IDENTITY, 1.0)),
        (
            "adjacent",
            square(
                DQuat::from_rotation_z(-std::f64::consts::FRAC_PI_2)
                    * DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2),
                DVec3::Y,
            )
            .flipped(),
        ),
        ("hinged", square(DQuat::from_rotation_x(1.0), DVec3::ZERO).flipped()),
        ("corner", over(tilted, 0.0)),
        ("tilted", over(tilted, 1.0)),
        ("apart", over(tilted, 4.0)),
        ("far", over(tilted, 100.0)),
    ] {
        assert!(exact(&floor, &other) > 0.0, "{name}");
        c.bench_function(&format!("exact {name}"), |b| b.iter(|| exact(black_box(&floor), black_box(&other))));
    }

    let ceiling = over(DQuat::IDENTITY, 1.0);
    let half = DVec3::new(0.2, 0.3, 0.5);
    let corners = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
    let blocker = Facet::new(corners.iter().map(|c| half + 0.5 * (tilted * *c)).collect()).unwrap();
    let blockers = Blockers::new([&blocker]);
    for name in ["lambert", "nusselt", "contour", "cubature"] {
        let method = name.parse::<PairMethod>().unwrap().build();
        c.bench_function(&format!("{name} opposite"), |b| {
            b.iter(|| method.factor(black_box(&floor), black_box(&ceiling), &Unoccluded))
        });
        c.bench_function(&format!("{name} obstructed"), |b| {
            b.iter(|| method.factor(black_box(&floor), black_box(&ceiling), &blockers))
        });
    }
}

criterion_group!(pairs, benches);
criterion_main!(pairs);
