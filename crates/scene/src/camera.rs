//! Where a picture is taken from.

use glam::{DMat4, DVec3};

/// How a camera projects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Pinhole with a vertical field of view in radians.
    Perspective {
        /// Full vertical angle of view, radians.
        vertical_fov: f64,
    },
    /// Parallel projection.
    Orthographic {
        /// Half the height of the picture, metres.
        half_height: f64,
    },
}

/// A camera, looking along −Z of its own frame with +Y up (the glTF convention).
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Name given by the author; may be empty.
    pub name: String,
    /// World from camera; rigid (scale removed).
    pub world_from_camera: DMat4,
    /// Kind and angle of projection.
    pub projection: Projection,
    /// Width over height, where the author gave one.
    pub aspect: Option<f64>,
}

impl Camera {
    /// A perspective camera at `eye` that looks at `target`; `up` only needs to be roughly up.
    pub fn look_at(name: &str, eye: DVec3, target: DVec3, up: DVec3, vertical_fov: f64) -> Camera {
        let back = (eye - target).normalize();
        let right = up.cross(back).try_normalize().unwrap_or_else(|| back.any_orthonormal_vector());
        let up = back.cross(right);
        let frame = DMat4::from_cols(right.extend(0.0), up.extend(0.0), back.extend(0.0), eye.extend(1.0));
        Camera {
            name: name.to_owned(),
            world_from_camera: frame,
            projection: Projection::Perspective { vertical_fov },
            aspect: None,
        }
    }

    /// Where the eye is; of a parallel projection the middle of the picture.
    pub fn position(&self) -> DVec3 {
        self.world_from_camera.w_axis.truncate()
    }

    /// Origin and unit direction of the ray through picture coordinates `x`, `y` in −1..1 (x right, y up) at the
    /// given aspect (width over height).
    pub fn ray(&self, x: f64, y: f64, aspect: f64) -> (DVec3, DVec3) {
        let eye = self.position();
        match self.projection {
            Projection::Perspective { vertical_fov } => {
                let tangent = (0.5 * vertical_fov).tan();
                let direction = DVec3::new(x * tangent * aspect, y * tangent, -1.0);
                (eye, self.world_from_camera.transform_vector3(direction).normalize())
            }
            Projection::Orthographic { half_height } => {
                let offset = DVec3::new(x * half_height * aspect, y * half_height, 0.0);
                let forward = -self.world_from_camera.z_axis.truncate();
                (self.world_from_camera.transform_point3(offset), forward.normalize())
            }
        }
    }
}
