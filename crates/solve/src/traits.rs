//! What solvers ask of the world: a space, a transport, a response; and the plainest space and response.

use crate::SolveError;

/// A vector space with its own inner product.
pub trait Space {
    /// Number of unknowns per band.
    fn dim(&self) -> usize;
    /// Inner product of two fields, band by band.
    fn inner(&self, x: &[f64], y: &[f64], bands: usize) -> Vec<f64>;
    /// Hands out each number of a field, by unknown and band, times its weight in the inner product.
    fn accumulate(&self, x: &[f64], bands: usize, add: impl FnMut(usize, usize, f64));
}

/// h = F b for all bands at once.
pub trait Transport: Sync {
    /// The space of its fields.
    type Space: Space;
    /// The space of its fields.
    fn space(&self) -> &Self::Space;
    /// Writes F b into `h`; both have `dim × bands` numbers.
    ///
    /// # Errors
    /// [`SolveError::Transport`] where F is not at hand, as when it is read from a file. What is in `h` then is of no use.
    fn apply(&self, b: &[f64], h: &mut [f64], bands: usize) -> Result<(), SolveError>;
    /// Labels 0.. of the unknowns such that no row of F reaches from one label to another: rooms that do not see each
    /// other. `None` where that is not known.
    fn parts(&self) -> Option<&[u32]> {
        None
    }
    /// ‖F‖∞, the largest sum of a row's absolute values: one in a closed scene, less in an open one. What sampling or
    /// averaging left above one must be told here, for the guaranteed bound rests on it.
    fn row_sum(&self) -> f64 {
        1.0
    }
}

/// A transport whose rows can be read: what sweeps, factorisations and random walks ask for.
pub trait Rows: Transport {
    /// Hands out the entries (j, F_ij) of row i in rising order of j; those left out are zero.
    fn row(&self, i: usize, entry: impl FnMut(usize, f64));
}

/// A transport that can send the light of one unknown to all others: what Southwell and progressive refinement ask for.
pub trait Shoot: Transport {
    /// Writes into `h` what `unshot`, a radiosity by band of unknown `source` alone, brings to all: h_j = F_j,source
    /// unshot.
    fn shoot(&self, source: usize, unshot: &[f64], h: &mut [f64]);
}

/// R: what surfaces make of the light that they receive.
pub trait Response: Sync {
    /// Number of bands.
    fn bands(&self) -> usize;
    /// Writes R h into `b`.
    fn respond(&self, h: &[f64], b: &mut [f64]);
    /// Largest reflectance of each band: ‖R‖∞.
    fn largest(&self) -> Vec<f64>;
    /// The reflectances by entry, if an unknown reflects into itself alone and bands do not mix.
    fn diagonal(&self) -> Option<&[f64]> {
        None
    }
    /// Reflectances and transmittances by entry, if an unknown reflects into itself, passes light to no more than one
    /// other, and bands do not mix. Solvers that take single rows need it.
    fn sheets(&self) -> Option<Sheets<'_>> {
        self.diagonal().map(|reflectance| Sheets { reflectance, opposite: &[], transmittance: &[] })
    }
    /// Whether the transport that this goes with is reciprocal (A_i F_ij = A_j F_ji).
    fn is_reciprocal(&self) -> bool {
        self.self_adjoint_weight().is_some()
    }
    /// The weight (A/ρ by entry) in whose inner product I − R F is symmetric, if F is reciprocal and R diagonal; CG is
    /// offered only then.
    fn self_adjoint_weight(&self) -> Option<Vec<f64>>;
}

/// R of thin sheets (catalogue 12): b_i = ρ_i h_i + τ_i h_o, with o the unknown on the other side of i.
#[derive(Clone, Copy, Debug)]
pub struct Sheets<'a> {
    /// ρ, bands interleaved.
    pub reflectance: &'a [f64],
    /// The other side of each unknown, itself where there is none; empty if none has one.
    pub opposite: &'a [u32],
    /// τ, bands interleaved: of what arrives on the other side, the share that leaves an unknown. Empty as above.
    pub transmittance: &'a [f64],
}

impl<'a> Sheets<'a> {
    /// The other side of an unknown and τ by band of what comes from there, if there is one.
    #[inline]
    pub fn passed(&self, unknown: usize, bands: usize) -> Option<(usize, &'a [f64])> {
        let other = *self.opposite.get(unknown)? as usize;
        (other != unknown).then(|| (other, &self.transmittance[unknown * bands..(unknown + 1) * bands]))
    }

    /// Number of unknowns that have another side.
    pub fn sides(&self) -> usize {
        self.opposite.iter().enumerate().filter(|(i, other)| *i != **other as usize).count()
    }
}

/// Fields over elements, weighted by area.
#[derive(Clone, Debug, Default)]
pub struct AreaSpace {
    /// Area of each element, m².
    pub area: Vec<f64>,
}

impl Space for AreaSpace {
    fn dim(&self) -> usize {
        self.area.len()
    }

    fn inner(&self, x: &[f64], y: &[f64], bands: usize) -> Vec<f64> {
        let mut sum = vec![0.0; bands];
        for ((x, y), area) in x.chunks_exact(bands).zip(y.chunks_exact(bands)).zip(&self.area) {
            for band in 0..bands {
                sum[band] += area * x[band] * y[band];
            }
        }
        sum
    }

    fn accumulate(&self, x: &[f64], bands: usize, mut add: impl FnMut(usize, usize, f64)) {
        for (i, (x, area)) in x.chunks_exact(bands).zip(&self.area).enumerate() {
            for (band, x) in x.iter().enumerate() {
                add(i, band, area * x);
            }
        }
    }
}

/// Ideal diffuse reflection: a reflectance for each element and band.
#[derive(Clone, Debug)]
pub struct DiffuseResponse {
    /// Reflectances, bands interleaved.
    pub reflectance: Vec<f64>,
    /// Number of bands.
    pub bands: usize,
    /// Areas, if the transport that this goes with is reciprocal (A_i F_ij = A_j F_ji).
    pub reciprocal_area: Option<Vec<f64>>,
}

impl Response for DiffuseResponse {
    fn bands(&self) -> usize {
        self.bands
    }

    fn respond(&self, h: &[f64], b: &mut [f64]) {
        for ((b, h), rho) in b.iter_mut().zip(h).zip(&self.reflectance) {
            *b = rho * h;
        }
    }

    fn largest(&self) -> Vec<f64> {
        (0..self.bands)
            .map(|band| self.reflectance.iter().skip(band).step_by(self.bands).fold(0f64, |m, &r| m.max(r)))
            .collect()
    }

    fn diagonal(&self) -> Option<&[f64]> {
        Some(&self.reflectance)
    }

    fn self_adjoint_weight(&self) -> Option<Vec<f64>> {
        let area = self.reciprocal_area.as_ref()?;
        // Where nothing is reflected the unknown is known (B = E) and takes no part in the inner product.
        let weight = |(i, &rho): (usize, &f64)| if rho > 0.0 { area[i / self.bands] / rho } else { 0.0 };
        Some(self.reflectance.iter().enumerate().map(weight).collect())
    }
}

/// Diffuse reflection, and diffuse transmission from one side of a sheet to the other.
///
/// ```
/// use radiosity_solve::{DenseTransport, DiffuseResponse, Go, Params, SheetResponse, Solver, solve};
///
/// // A lamp that shines on one side of a pane, whose other side shines on a wall: half of the light passes.
/// let factors = vec![0., 1., 0., 0.,  1., 0., 0., 0.,  0., 0., 0., 1.,  0., 0., 1., 0.];
/// let transport = DenseTransport::new(vec![1.0; 4], factors)?;
/// let diffuse = DiffuseResponse { reflectance: vec![0.0; 4], bands: 1, reciprocal_area: None };
/// let pane = SheetResponse { diffuse, opposite: vec![0, 2, 1, 3], transmittance: vec![0.0, 0.5, 0.5, 0.0] };
/// let mut b = [0.0; 4];
/// solve(Solver::GaussSeidel, &transport, &pane, &[1.0, 0.0, 0.0, 0.0], &mut b, &Params::default(), |_, _| Go::On)?;
/// assert_eq!(b, [1.0, 0.0, 0.5, 0.0]);
/// # Ok::<(), radiosity_solve::SolveError>(())
/// ```
#[derive(Clone, Debug)]
pub struct SheetResponse {
    /// What the unknowns reflect.
    pub diffuse: DiffuseResponse,
    /// The other side of each unknown, itself where there is none; empty if nothing is transmitted.
    pub opposite: Vec<u32>,
    /// τ, bands interleaved: of what arrives on the other side, the share that leaves an unknown. Empty as above.
    pub transmittance: Vec<f64>,
}

impl SheetResponse {
    fn as_sheets(&self) -> Sheets<'_> {
        Sheets { reflectance: &self.diffuse.reflectance, opposite: &self.opposite, transmittance: &self.transmittance }
    }
}

impl Response for SheetResponse {
    fn bands(&self) -> usize {
        self.diffuse.bands
    }

    fn respond(&self, h: &[f64], b: &mut [f64]) {
        self.diffuse.respond(h, b);
        let (sheets, bands) = (self.as_sheets(), self.diffuse.bands);
        for i in 0..self.opposite.len() {
            if let Some((other, tau)) = sheets.passed(i, bands) {
                for band in 0..bands {
                    b[i * bands + band] += tau[band] * h[other * bands + band];
                }
            }
        }
    }

    fn largest(&self) -> Vec<f64> {
        let mut largest = self.diffuse.largest();
        let bands = self.diffuse.bands;
        for (k, (rho, tau)) in self.diffuse.reflectance.iter().zip(&self.transmittance).enumerate() {
            largest[k % bands] = largest[k % bands].max(rho + tau);
        }
        largest
    }

    fn diagonal(&self) -> Option<&[f64]> {
        if self.opposite.is_empty() { self.diffuse.diagonal() } else { None }
    }

    fn sheets(&self) -> Option<Sheets<'_>> {
        Some(self.as_sheets())
    }

    fn is_reciprocal(&self) -> bool {
        self.diffuse.reciprocal_area.is_some()
    }

    /// With sheets there is none: A/ρ becomes A R⁻¹, which is not positive where τ² is above the product of the two ρ.
    fn self_adjoint_weight(&self) -> Option<Vec<f64>> {
        if self.opposite.is_empty() { self.diffuse.self_adjoint_weight() } else { None }
    }
}
