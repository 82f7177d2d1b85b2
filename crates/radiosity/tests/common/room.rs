//! A furnished room made of boxes: tables, chairs with legs, shelves of books, lamps under the ceiling.

use glam::DVec3;
use radiosity::{Material, PointLight, PointLightKind, Scene};

/// How much is in a room.
pub struct Furnishing {
    /// Tables, each with four chairs.
    pub tables: usize,
    /// Lamps.
    pub lamps: usize,
    /// Books on shelves, each a box of twelve triangles; one object for each shelf.
    pub books: usize,
}

struct Kit {
    scene: Scene,
}

fn faces(low: DVec3, high: DVec3) -> Vec<[DVec3; 3]> {
    let corner = |i: usize| {
        DVec3::new(
            if i & 1 == 0 { low.x } else { high.x },
            if i & 2 == 0 { low.y } else { high.y },
            if i & 4 == 0 { low.z } else { high.z },
        )
    };
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
        .into_iter()
        .flat_map(|[a, b, c, d]| [[corner(a), corner(b), corner(c)], [corner(a), corner(c), corner(d)]])
        .collect()
}

impl Kit {
    fn material(&mut self, name: &str, [r, g, b]: [f32; 3], emissive: [f32; 3]) -> usize {
        self.scene.materials.push(Material {
            name: name.to_owned(),
            base_color: [r, g, b, 1.0],
            emissive,
            ..Material::default()
        });
        self.scene.materials.len() - 1
    }

    fn boxes(&mut self, name: &str, material: usize, boxes: &[[DVec3; 2]]) -> usize {
        let triangles: Vec<_> = boxes.iter().flat_map(|[low, high]| faces(*low, *high)).collect();
        self.scene.add_triangles(name, material, &triangles)
    }
}

/// The room, +Y up, the names of its objects telling what they are.
pub fn room(furnishing: &Furnishing) -> Scene {
    let mut kit = Kit { scene: Scene { name: "room".to_owned(), ..Scene::default() } };
    let white = kit.material("white", [0.8, 0.78, 0.75], [0.0; 3]);
    let wood = kit.material("wood", [0.45, 0.3, 0.2], [0.0; 3]);
    let red = kit.material("red", [0.6, 0.15, 0.1], [0.0; 3]);
    let blue = kit.material("blue", [0.15, 0.2, 0.5], [0.0; 3]);
    let lit = kit.material("lamp", [0.7; 3], [6000.0, 5500.0, 4800.0]);
    let v = DVec3::new;
    let (x, y, z) = (8.0, 3.0, 6.0);
    let shell = [
        ("floor", wood, [v(0., 0., 0.), v(0., 0., z), v(x, 0., z), v(x, 0., 0.)]),
        ("ceiling", white, [v(0., y, 0.), v(x, y, 0.), v(x, y, z), v(0., y, z)]),
        ("wall north", white, [v(0., 0., 0.), v(x, 0., 0.), v(x, y, 0.), v(0., y, 0.)]),
        ("wall south", white, [v(x, 0., z), v(0., 0., z), v(0., y, z), v(x, y, z)]),
        ("wall west", red, [v(0., 0., z), v(0., 0., 0.), v(0., y, 0.), v(0., y, z)]),
        ("wall east", blue, [v(x, 0., 0.), v(x, 0., z), v(x, y, z), v(x, y, 0.)]),
    ];
    for (name, material, corners) in shell {
        kit.scene.add_quad(name, material, corners);
    }
    let columns = (furnishing.lamps as f64).sqrt().ceil().max(1.0) as usize;
    for lamp in 0..furnishing.lamps {
        let rows = furnishing.lamps.div_ceil(columns);
        let (i, j) = (lamp % columns, lamp / columns);
        let at = v(x * (i as f64 + 0.5) / columns as f64, 2.8, z * (j as f64 + 0.5) / rows as f64);
        let corners = [v(-0.3, 0., -0.15), v(0.3, 0., -0.15), v(0.3, 0., 0.15), v(-0.3, 0., 0.15)].map(|p| at + p);
        kit.scene.add_quad(&format!("lamp {lamp}"), lit, corners);
    }
    for table in 0..furnishing.tables {
        let at = v(1.6 + 2.4 * (table % 3) as f64, 0.0, 1.6 + 2.8 * (table / 3) as f64);
        let leg =
            |dx: f64, dz: f64, height: f64| [at + v(dx - 0.03, 0.001, dz - 0.03), at + v(dx + 0.03, height, dz + 0.03)];
        let top = [at + v(-0.7, 0.7, -0.4), at + v(0.7, 0.74, 0.4)];
        let legs = [leg(-0.6, -0.3, 0.7), leg(0.6, -0.3, 0.7), leg(-0.6, 0.3, 0.7), leg(0.6, 0.3, 0.7)];
        kit.boxes(&format!("table {table}"), wood, &[&[top][..], &legs].concat());
        for chair in 0..4 {
            let (dx, dz) = ([-0.4, 0.4][chair % 2], [-0.75, 0.75][chair / 2]);
            let seat = [at + v(dx - 0.2, 0.43, dz - 0.2), at + v(dx + 0.2, 0.47, dz + 0.2)];
            let side = 0.18 * dz.signum();
            let back = [at + v(dx - 0.2, 0.47, dz + side - 0.02), at + v(dx + 0.2, 0.9, dz + side + 0.02)];
            let legs =
                [[-0.17, -0.17], [0.17, -0.17], [-0.17, 0.17], [0.17, 0.17]].map(|[a, b]| leg(dx + a, dz + b, 0.43));
            kit.boxes(&format!("chair {table}.{chair}"), [red, blue][chair % 2], &[&[seat, back][..], &legs].concat());
        }
    }
    for shelf in 0..furnishing.books.div_ceil(200) {
        let count = (furnishing.books - 200 * shelf).min(200);
        let boxes: Vec<[DVec3; 2]> = (0..count)
            .map(|book| {
                let (row, column) = (book / 40, book % 40);
                let low = v(0.2 + 0.18 * column as f64, 0.2 + 0.3 * row as f64, 0.02 + 0.25 * shelf as f64);
                [low, low + v(0.12, 0.2 + 0.01 * (book % 5) as f64, 0.15)]
            })
            .collect();
        kit.boxes(&format!("shelf {shelf}"), [wood, red, blue][shelf % 3], &boxes);
    }
    kit.scene.lights.push(PointLight {
        name: "spot".to_owned(),
        kind: PointLightKind::Spot { inner: 0.3, outer: 0.7 },
        position: v(4.0, 2.5, 5.5),
        direction: v(0.0, -0.6, -0.8),
        intensity: [400.0; 3],
        range: None,
    });
    kit.scene
}
