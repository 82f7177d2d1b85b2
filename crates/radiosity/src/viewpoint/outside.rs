//! The best view from outside: half from the side and above, as near as the frame allows, where most fronts are seen.

use super::{ASPECTS, Site};
use glam::DVec3;
use radiosity_scene::Camera;
use radiosity_trace::Found;
use std::f64::consts::TAU;

/// Vertical angle of view, radians: the lens that things are photographed with, 60 mm on 35 mm film.
const ANGLE: f64 = 0.6;

/// Azimuths from the front, degrees, and how gladly people look from there.
const AZIMUTHS: [(f64, f64); 10] = [
    (35.0, 1.0),
    (-35.0, 0.98),
    (15.0, 0.8),
    (-15.0, 0.79),
    (60.0, 0.8),
    (-60.0, 0.79),
    (0.0, 0.7),
    (145.0, 0.6),
    (-145.0, 0.59),
    (180.0, 0.5),
];

/// Elevations, the same.
const ELEVATIONS: [(f64, f64); 5] = [(0.0, 0.6), (12.0, 0.85), (24.0, 1.0), (36.0, 0.85), (50.0, 0.6)];

/// A scene whose width or depth is less than this part of its size is a panel, which is looked at straight.
const FLAT: f64 = 0.02;

/// Part of the picture that is left free on each side.
const MARGIN: f64 = 0.06;

/// How much of its picture shows fronts, from 0 to 1, and how far behind the nearest point of the scene that is.
struct Shown {
    share: f64,
    depth: f64,
}

impl Site<'_> {
    /// The best view of all from outside.
    pub(super) fn outside(&self) -> Camera {
        let size = self.bounds[1] - self.bounds[0];
        let [wide, _, deep] = self.axes.map(|axis| size.dot(axis).abs());
        let side = if wide < deep { 90.0 } else { 0.0 };
        let straight = [(side, 1.0), (side + 180.0, 0.9)];
        let (azimuths, elevations) = match wide.min(deep) < FLAT * size.max_element() {
            true => (&straight[..], &ELEVATIONS[..1]),
            false => (&AZIMUTHS[..], &ELEVATIONS[..]),
        };
        let (mut best, mut camera) = (0.0, None);
        for (azimuth, liked) in azimuths {
            for (elevation, also) in elevations {
                let candidate = self.framed(self.direction(azimuth.to_radians(), elevation.to_radians()));
                let score = liked * also * self.shown(&candidate).share;
                if score > best {
                    (best, camera) = (score, Some(candidate));
                }
            }
        }
        camera.unwrap_or_else(|| self.framed(self.axes[2]))
    }

    /// A look straight into a room that lacks a wall, as stages and doll's houses do.
    pub(super) fn through_open_side(&self) -> Option<Camera> {
        (0..4).find_map(|quarter| {
            let back = self.direction(0.25 * TAU * f64::from(quarter), 0.0);
            let camera = self.framed(back);
            let shown = self.shown(&camera);
            let depth = (self.bounds[1] - self.bounds[0]).dot(back).abs();
            (shown.share > 0.8 && shown.depth > 0.5 * depth).then_some(camera)
        })
    }

    /// The nearest camera that looks against `back` and has the whole subject in its frame, with a margin.
    fn framed(&self, back: DVec3) -> Camera {
        let mut camera = Camera::look_at("outside", back, DVec3::ZERO, self.axes[1], ANGLE);
        let frame = camera.world_from_camera;
        let [x, y, z] = [frame.x_axis, frame.y_axis, frame.z_axis].map(|axis| axis.truncate());
        let tangent = (0.5 * ANGLE).tan() * (1.0 - 2.0 * MARGIN);
        // In the frame is a point p with ±(p − eye)·axis ≤ slope (eye − p)·z. The outermost on either side say how far
        // back the eye must be, and where between them.
        let fit = |axis: DVec3, slope: f64| {
            let mut most = [f64::NEG_INFINITY; 2];
            for p in &self.subject {
                most[0] = most[0].max(slope * p.dot(z) + p.dot(axis));
                most[1] = most[1].max(slope * p.dot(z) - p.dot(axis));
            }
            [0.5 * (most[0] + most[1]) / slope, 0.5 * (most[0] - most[1])]
        };
        let [far_above, above] = fit(y, tangent);
        let aspect = self.aspect.unwrap_or_else(|| {
            // The narrowest frame that the height fills; halving twelve times finds it to a thousandth.
            let [mut wide, mut narrow] = ASPECTS;
            for _ in 0..12 {
                let middle = 0.5 * (wide + narrow);
                *if fit(x, tangent * middle)[0] > far_above { &mut narrow } else { &mut wide } = middle;
            }
            wide
        });
        let [far_across, across] = fit(x, tangent * aspect);
        // What is met first keeps some distance, however narrow it is.
        let size = (self.bounds[1] - self.bounds[0]).length();
        let nearest = self.subject.iter().map(|p| p.dot(z)).fold(f64::NEG_INFINITY, f64::max);
        let depth = far_across.max(far_above).max(nearest + 0.05 * size);
        camera.world_from_camera.w_axis = (across * x + above * y + depth * z).extend(1.0);
        camera.aspect = Some(aspect);
        camera
    }

    fn shown(&self, camera: &Camera) -> Shown {
        /// Rays along each side of a picture.
        const SIDE: u32 = 48;
        let [back, eye] = [camera.world_from_camera.z_axis, camera.world_from_camera.w_axis].map(|v| v.truncate());
        let nearest = self.subject.iter().map(|p| (eye - *p).dot(back)).fold(f64::INFINITY, f64::min);
        let (mut seen, mut through, mut depth) = (0.0, 0.0, 0.0);
        for i in 0..SIDE * SIDE {
            let [x, y] = [i % SIDE, i / SIDE].map(|k| (2.0 * f64::from(k) + 1.0) / f64::from(SIDE) - 1.0);
            let (eye, direction) = camera.ray(x, y, camera.aspect.unwrap_or(ASPECTS[0]));
            match self.first(eye, direction, i) {
                Found::Surface { distance, .. } => {
                    seen += 1.0;
                    depth += -direction.dot(back) * f64::from(distance) - nearest;
                }
                Found::Back => through += 1.0,
                Found::Escaped => {}
            }
        }
        // A wide thing is not twice as good as one that fills half the frame; one that shows its inside is bad.
        let (some, met) = (f64::max(seen, 1.0), f64::max(seen + through, 1.0));
        Shown { share: (seen / f64::from(SIDE * SIDE)).sqrt() * (seen / met).powi(2), depth: depth / some }
    }
}
