//! The hemicube whose item buffer graphics hardware draws.

use super::GpuError;
use super::device::Device;
use crate::row::face::Face;
use crate::row::look::Look;
use crate::row::surface::{Fill, Projection};
use crate::row::{Hemicube, Row, RowMatrix};
use crate::{FactorError, Progress};
use radiosity_scene::Enclosure;

/// A [`Hemicube`] on graphics hardware.
#[derive(Debug)]
pub struct HemicubeGpu {
    look: Look,
    device: Device,
}

impl HemicubeGpu {
    /// Takes the fastest adapter that there is.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`] and [`GpuError::Refused`].
    pub fn open(look: Look) -> Result<HemicubeGpu, GpuError> {
        Ok(HemicubeGpu { look, device: Device::open()? })
    }

    /// What draws, as its driver calls it.
    pub fn adapter(&self) -> &str {
        self.device.name()
    }

    /// All rows.
    ///
    /// # Errors
    /// [`FactorError::Stopped`] if `progress` says so; [`FactorError::Gpu`] if the device fails.
    pub fn matrix(&self, enclosure: &Enclosure, progress: &dyn Progress) -> Result<RowMatrix, FactorError> {
        let matrix = self.rows(enclosure, progress)?;
        self.device.failure().map_or(Ok(matrix), |failure| Err(FactorError::Gpu(failure)))
    }
}

impl Projection for HemicubeGpu {
    fn look(&self) -> Look {
        self.look
    }

    fn faces(&self, n: usize) -> Vec<Face> {
        Projection::faces(&Hemicube::default(), n)
    }

    fn fill(&self) -> Fill<'_> {
        Fill::By(&self.device)
    }
}
