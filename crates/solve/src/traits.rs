//! What solvers ask of the world: a space, a transport, a response; and the plainest space and response.

/// A vector space with its own inner product.
pub trait Space {
    /// Number of unknowns per band.
    fn dim(&self) -> usize;
    /// Inner product of two fields, band by band.
    fn inner(&self, x: &[f64], y: &[f64], bands: usize) -> Vec<f64>;
    /// Hands out each number of a field times its weight in the inner product.
    fn accumulate(&self, x: &[f64], bands: usize, add: impl FnMut(usize, f64));
}

/// h = F b for all bands at once.
pub trait Transport: Sync {
    /// The space of its fields.
    type Space: Space;
    /// The space of its fields.
    fn space(&self) -> &Self::Space;
    /// Writes F b into `h`; both have `dim × bands` numbers.
    fn apply(&self, b: &[f64], h: &mut [f64], bands: usize);
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
    /// The reflectances by entry, if an unknown reflects into itself alone and bands do not mix. Solvers that take
    /// single rows need it.
    fn diagonal(&self) -> Option<&[f64]> {
        None
    }
    /// The weight (A/ρ by entry) in whose inner product I − R F is symmetric, if F is reciprocal and R diagonal; CG is
    /// offered only then.
    fn self_adjoint_weight(&self) -> Option<Vec<f64>>;
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

    fn accumulate(&self, x: &[f64], bands: usize, mut add: impl FnMut(usize, f64)) {
        for (i, x) in x.iter().enumerate() {
            add(i, self.area[i / bands] * x);
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
