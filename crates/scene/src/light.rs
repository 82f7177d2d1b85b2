//! Light sources without area (KHR_lights_punctual): point, spot, directional.

use crate::Bands;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// The kinds of lights without area.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum PointLightKind {
    /// Shines equally in all directions; intensity in candela.
    Point,
    /// Shines in a cone about its direction; intensity in candela, smooth between the two half angles (radians).
    Spot {
        /// Half angle inside which the intensity is full.
        inner: f64,
        /// Half angle outside which there is no light.
        outer: f64,
    },
    /// Parallel light from infinitely far; intensity in lux on a surface that faces it.
    Directional,
}

/// A light source without area.
#[derive(Clone, Debug, PartialEq)]
pub struct PointLight {
    /// Name given by the author; may be empty.
    pub name: String,
    /// Kind.
    pub kind: PointLightKind,
    /// Position in the world, metres (unused by directional lights).
    pub position: DVec3,
    /// Unit direction in which the light shines (unused by point lights).
    pub direction: DVec3,
    /// Candela per band (point, spot) or lux per band (directional).
    pub intensity: Bands,
    /// Distance in metres beyond which the light has ended, where the author asked for one.
    pub range: Option<f64>,
}

impl PointLight {
    /// Unit direction towards the light, distance to it (infinite for directional lights) and the irradiance that a
    /// surface facing the light receives at `point` when nothing is in between: lux per band.
    pub fn arrival(&self, point: DVec3) -> (DVec3, f64, Bands) {
        if self.kind == PointLightKind::Directional {
            return (-self.direction, f64::INFINITY, self.intensity);
        }
        let to_light = self.position - point;
        let distance = to_light.length();
        if distance == 0.0 {
            return (DVec3::Z, 0.0, [0.0; 3]);
        }
        let towards = to_light / distance;
        let mut strength = 1.0 / (distance * distance);
        // The range window and the spot's falloff are those of the KHR_lights_punctual specification.
        if let Some(range) = self.range {
            strength *= (1.0 - (distance / range).powi(4)).clamp(0.0, 1.0);
        }
        if let PointLightKind::Spot { inner, outer } = self.kind {
            let scale = 1.0 / (inner.cos() - outer.cos()).max(0.001);
            let offset = -outer.cos() * scale;
            let falloff = (-towards.dot(self.direction) * scale + offset).clamp(0.0, 1.0);
            strength *= falloff * falloff;
        }
        (towards, distance, self.intensity.map(|i| (f64::from(i) * strength) as f32))
    }
}
