//! The hemicube on graphics hardware (catalogue 92): cells are filled by the rasteriser that the method was once made for
//! (Cohen and Greenberg 1985; Baum, Rushmeier and Winget 1989), by way of wgpu.
//!
//! Polygons are projected in double precision and go out in single; a fragment's depth is m·p/d, as in the item buffer, and
//! what comes back is a polygon's number for each cell. Hardware puts corners on a lattice of 1/256 of a cell and depths are
//! off by some 1e-7 of the largest, so cells whose centre lies that near an edge, or shows two surfaces that near to each
//! other, may show the other one: a delta form factor each. Edges that polygons share may part there, too: a closed room
//! loses a few cells, some 1e-4 of a row with 128. Weights, sums and predicted errors are those of [`Hemicube`].
//! Each face is one round trip to the device, which pays with many cells for each polygon.
//!
//! It is there in builds with the feature `gpu`, and asked for by name; nothing needs it, and nothing else takes its place.

#[cfg(feature = "gpu")]
mod device;
#[cfg(feature = "gpu")]
mod hemicube;
#[cfg(feature = "gpu")]
pub use hemicube::HemicubeGpu;

#[cfg(doc)]
use super::Hemicube;

/// Why graphics hardware draws nothing.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GpuError {
    /// The program cannot use any.
    #[error(
        "hemicube-gpu: this program was built without graphics hardware (build it with `--features gpu`, or use the method \
         hemicube, which finds the same factors without)"
    )]
    NotBuilt,
    /// There is none, or no driver for it.
    #[error(
        "hemicube-gpu: no graphics adapter was found: {0} (install a driver of Vulkan or Metal, as Mesa's \
         mesa-vulkan-drivers, which has one in software too, or use the method hemicube, which finds the same factors without)"
    )]
    NoAdapter(String),
    /// There is one that does not do what is needed.
    #[error("hemicube-gpu: the graphics adapter {adapter} cannot be used: {why} (update its driver, or use hemicube)")]
    Refused {
        /// Its name.
        adapter: String,
        /// As the driver says.
        why: String,
    },
    /// It failed on the way: factors are not to be used.
    #[error("hemicube-gpu: the graphics adapter {adapter} failed: {why} (ask for fewer cells, or use hemicube)")]
    Failed {
        /// Its name.
        adapter: String,
        /// As the driver says.
        why: String,
    },
}

#[cfg(all(test, feature = "gpu"))]
mod tests;

#[cfg(test)]
mod without {
    use super::*;

    /// A build without hardware, and hardware that is not there: both say so and what else there is, and nothing else is used.
    #[test]
    fn catalogue_92_without_hardware_it_says_so() {
        #[cfg(feature = "gpu")]
        let error = device::Device::of(wgpu::Backends::empty()).unwrap_err();
        #[cfg(not(feature = "gpu"))]
        let error = {
            use crate::{FactorError, FormFactorMethod, FormFactors};
            let method: FormFactorMethod = "hemicube-gpu".parse().unwrap();
            assert!(FormFactorMethod::all().all(|known| known != method));
            let refused = FormFactors::new(method, &Default::default(), &Default::default(), &());
            let Err(FactorError::Gpu(error)) = refused else { panic!("{refused:?}") };
            error
        };
        let is_told = matches!(error, GpuError::NoAdapter(_)) == cfg!(feature = "gpu");
        assert!(is_told && error.to_string().contains("use the method hemicube,"), "{error}");
    }
}
