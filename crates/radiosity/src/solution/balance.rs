//! Where the light goes: what comes in, what is absorbed and what leaves, and by how much they miss each other.

use super::Solution;
use crate::Error;
use radiosity_scene::Bands;
use serde::Serialize;

/// Where the light goes, in lumens (or watts) per band.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Balance {
    /// Emitted by surfaces.
    pub emitted: Bands,
    /// Received from lights without area.
    pub from_point_lights: Bands,
    /// Received from the sky.
    pub from_sky: Bands,
    /// Absorbed by surfaces.
    pub absorbed: Bands,
    /// Escaped from the scene.
    pub escaped: Bands,
    /// Absorbed by the black backs of one-sided surfaces.
    pub lost_on_backs: Bands,
    /// (in − out)/in, before any repair.
    pub defect: [f64; 3],
}

impl Solution<'_> {
    /// Where the light goes, from the rows as they are.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn balance(&self) -> Result<Balance, Error> {
        let n = self.elements.len();
        let (first_sky, nothing) = (n as u32, (self.values.len() - 1) as u32);
        let radiosity = self.radiosity();
        let mut sums = [[0f64; 3]; 6];
        // A surface gives and takes as far as it is there.
        let (scene, mesh) = (self.tracer.scene, self.tracer.mesh);
        let there = |(e, area): (usize, f64)| area * f64::from(self.elements.opacity(scene, mesh, e as u32));
        let weight: Vec<f64> = self.exposed_area().into_iter().enumerate().map(there).collect();
        for (i, w) in weight.iter().enumerate() {
            for (light, e) in self.luminaires.lights.iter().zip(self.columns.seen_by_light(i)) {
                if matches!(light, radiosity_transport::Light::Point(_)) {
                    (0..3).for_each(|band| sums[1][band] += w * f64::from(e[band]));
                }
            }
        }
        let shares: Vec<[f64; 2]> = self.table.map_rows(|row| {
            let (mut sky, mut back, mut m) = (0u32, 0u32, 0.0);
            for id in row.ids() {
                m += 1.0;
                back += u32::from(id == nothing);
                sky += u32::from(id >= first_sky && id != nothing);
            }
            [f64::from(sky) / m, f64::from(back) / m]
        })?;
        let from_sky = self.daylight();
        for i in 0..n {
            for band in 0..3 {
                let (rho, e) = (f64::from(self.reflectance[i][band]), f64::from(self.irradiance[i][band]));
                let b = f64::from(radiosity[i][band]);
                sums[0][band] += weight[i] * f64::from(self.exitance[i][band]);
                sums[2][band] += weight[i] * f64::from(from_sky[i][band]);
                sums[3][band] += weight[i] * (1.0 - rho) * e;
                if let Some((other, tau)) = self.sheets.passed(i) {
                    // Not absorbed on the other side: it leaves this one.
                    sums[3][band] -= weight[i] * f64::from(tau[band]) * f64::from(self.irradiance[other][band]);
                }
                sums[4][band] += weight[i] * b * shares[i][0];
                sums[5][band] += weight[i] * b * shares[i][1];
            }
        }
        let defect = std::array::from_fn(|band| {
            let input = sums[0][band] + sums[1][band] + sums[2][band];
            let output = sums[3][band] + sums[4][band] + sums[5][band];
            if input > 0.0 { (input - output) / input } else { 0.0 }
        });
        let [emitted, from_point_lights, from_sky, absorbed, escaped, lost_on_backs] =
            sums.map(|s| s.map(|x| x as f32));
        Ok(Balance { emitted, from_point_lights, from_sky, absorbed, escaped, lost_on_backs, defect })
    }
}
