//! The systems that the tests solve.

use crate::*;

/// A system B = E + R F B of one band.
pub struct System {
    pub transport: DenseTransport,
    pub response: DiffuseResponse,
    pub e: Vec<f64>,
}

impl System {
    pub fn new(area: Vec<f64>, rows: Vec<f64>, reflectance: Vec<f64>, e: Vec<f64>) -> System {
        let response = DiffuseResponse { reflectance, bands: 1, reciprocal_area: Some(area.clone()) };
        System { transport: DenseTransport::new(area, rows).unwrap(), response, e }
    }

    /// Solves from zero.
    pub fn solve(&self, solver: Solver, params: &Params) -> Result<(Vec<f64>, Info), SolveError> {
        let mut b = vec![0.0; self.e.len()];
        let info = solve(solver, &self.transport, &self.response, &self.e, &mut b, params, |_, _| Go::On)?;
        Ok((b, info))
    }

    /// By elimination, written out anew. No pivots are looked for: in no row of 1 − R F is the diagonal less than all the rest.
    pub fn exact(&self) -> Vec<f64> {
        let n = self.e.len();
        let mut rows: Vec<Vec<f64>> = (0..n)
            .map(|i| {
                let mut row = vec![0.0; n + 1];
                self.transport.row(i, |j, factor| row[j] -= self.response.reflectance[i] * factor);
                row[i] += 1.0;
                row[n] = self.e[i];
                row
            })
            .collect();
        for k in 0..n {
            let (above, below) = rows.split_at_mut(k + 1);
            let pivot = &above[k];
            for row in below {
                let times = row[k] / pivot[k];
                row[k..].iter_mut().zip(&pivot[k..]).for_each(|(own, pivot)| *own -= times * pivot);
            }
        }
        let mut b = vec![0.0; n];
        for i in (0..n).rev() {
            let known: f64 = (i + 1..n).map(|j| rows[i][j] * b[j]).sum();
            b[i] = (rows[i][n] - known) / rows[i][i];
        }
        b
    }

    /// ‖E + R F B − B‖/‖E‖ weighted by area, written out anew.
    pub fn residual(&self, b: &[f64]) -> f64 {
        let mut h = vec![0.0; b.len()];
        self.transport.apply(b, &mut h, 1).unwrap();
        let area = &self.transport.space().area;
        let (mut own, mut all) = (0.0, 0.0);
        for i in 0..b.len() {
            let r = self.e[i] + self.response.reflectance[i] * h[i] - b[i];
            own += area[i] * r * r;
            all += area[i] * self.e[i] * self.e[i];
        }
        (own / all).sqrt()
    }

    /// Relative error in the area-weighted norm.
    pub fn error(&self, b: &[f64], exact: &[f64]) -> f64 {
        let area = &self.transport.space().area;
        let norm = |x: &dyn Fn(usize) -> f64| (0..b.len()).map(|i| area[i] * x(i).powi(2)).sum::<f64>().sqrt();
        norm(&|i| b[i] - exact[i]) / norm(&|i| exact[i])
    }
}

/// The unit cube with one constant patch per face (catalogue 20): opposite 0.1998248957, adjacent 0.2000437761. Face
/// 0 emits.
pub fn cube(rho: f64) -> System {
    let opposite = 0.199_824_895_7;
    let adjacent = (1.0 - opposite) / 4.0;
    let mut rows = vec![adjacent; 36];
    for i in 0..6 {
        rows[6 * i + i] = 0.0;
        rows[6 * i + (i ^ 1)] = opposite;
    }
    System::new(vec![1.0; 6], rows, vec![rho; 6], vec![1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
}

/// The textbook's 2x + y = 8, x + 2y = 10 as x = 4 − y/2, y = 5 − x/2: reflectances of one half and factors of minus
/// one.
pub fn textbook() -> System {
    System::new(vec![1.0; 2], vec![0.0, -1.0, -1.0, 0.0], vec![0.5; 2], vec![4.0, 5.0])
}

/// Faces of a box in the order z−, z+, x−, x+, y−, y+: origin, two edges, inward normal, of the unit cube.
const FACES: [[[f64; 3]; 4]; 6] = [
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]],
    [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]],
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]],
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]],
    [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]],
];

/// The inside of a box, n × n equal patches a face, F_ij Lambert's polygon factor from the centre of i.
pub struct Box6 {
    pub area: Vec<f64>,
    pub centre: Vec<[f64; 3]>,
    pub face: Vec<usize>,
    pub rows: Vec<f64>,
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] - b[k])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Lambert 1760: F = |Σ Γ_k · n|/2π over the edges of a polygon that lies above the horizon of `n` at `from`.
fn lambert(from: [f64; 3], normal: [f64; 3], corners: &[[f64; 3]; 4]) -> f64 {
    let unit = corners.map(|c| {
        let d = sub(c, from);
        let length = dot(d, d).sqrt();
        d.map(|x| x / length)
    });
    let mut sum = 0.0;
    for k in 0..4 {
        let (a, b) = (unit[k], unit[(k + 1) % 4]);
        let across = cross(a, b);
        let sine = dot(across, across).sqrt();
        sum += sine.atan2(dot(a, b)) * dot(across, normal) / sine.max(f64::MIN_POSITIVE);
    }
    sum.abs() / std::f64::consts::TAU
}

/// A box of the given size.
pub fn box_of(size: [f64; 3], n: usize) -> Box6 {
    let (mut area, mut centre, mut face, mut corners) = (vec![], vec![], vec![], vec![]);
    let step = 1.0 / n as f64;
    for (f, [origin, u, v, _]) in FACES.iter().enumerate() {
        for i in 0..n {
            for j in 0..n {
                let at = |a: f64, b: f64| -> [f64; 3] {
                    std::array::from_fn(|k| {
                        size[k] * (origin[k] + u[k] * (i as f64 + a) * step + v[k] * (j as f64 + b) * step)
                    })
                };
                corners.push([at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)]);
                centre.push(at(0.5, 0.5));
                face.push(f);
                let edge = |w: &[f64; 3]| (0..3).map(|k| w[k] * size[k]).sum::<f64>() * step;
                area.push(edge(u) * edge(v));
            }
        }
    }
    let count = area.len();
    let mut rows = vec![0.0; count * count];
    for i in 0..count {
        for j in 0..count {
            if face[i] != face[j] {
                rows[i * count + j] = lambert(centre[i], FACES[face[i]][3], &corners[j]);
            }
        }
    }
    Box6 { area, centre, face, rows }
}

impl Box6 {
    /// Rows made reciprocal: A_i F_ij and A_j F_ji replaced by their mean.
    pub fn symmetrised(mut self) -> Box6 {
        let n = self.area.len();
        for i in 0..n {
            for j in 0..i {
                let mean = 0.5 * (self.area[i] * self.rows[i * n + j] + self.area[j] * self.rows[j * n + i]);
                self.rows[i * n + j] = mean / self.area[i];
                self.rows[j * n + i] = mean / self.area[j];
            }
        }
        self
    }

    /// Rows scaled until they sum to one and stay reciprocal (symmetric Sinkhorn scaling).
    pub fn closed(self) -> Box6 {
        let mut made = self.symmetrised();
        let n = made.area.len();
        for _ in 0..60 {
            let scale: Vec<f64> = made.rows.chunks_exact(n).map(|row| row.iter().sum::<f64>().sqrt()).collect();
            for i in 0..n {
                for j in 0..n {
                    made.rows[i * n + j] /= scale[i] * scale[j];
                }
            }
        }
        made
    }

    pub fn system(self, reflectance: impl Fn(usize) -> f64, e: impl Fn(usize, [f64; 3]) -> f64) -> System {
        let reflectance = self.face.iter().map(|f| reflectance(*f)).collect();
        let e = self.face.iter().zip(&self.centre).map(|(f, c)| e(*f, *c)).collect();
        System::new(self.area, self.rows, reflectance, e)
    }
}

/// Reference run R1 of the catalogue: the unit cube, 12 × 12 patches a face, floor 0.3, ceiling 0.8, walls 0.5, the
/// four patches in the middle of the ceiling emit.
pub fn r1() -> System {
    let middle = |x: f64| (x - 0.5).abs() < 1.01 / 12.0;
    box_of([1.0; 3], 12).symmetrised().system(
        |face| [0.3, 0.8, 0.5, 0.5, 0.5, 0.5][face],
        |face, c| if face == 1 && middle(c[0]) && middle(c[1]) { 1.0 } else { 0.0 },
    )
}

/// A closed oblong room with unequal areas, all reflectances different, two black faces, light from two faces.
pub fn room(n: usize) -> System {
    box_of([4.0, 3.0, 2.5], n)
        .closed()
        .system(|face| [0.2, 0.7, 0.0, 0.5, 0.9, 0.0][face], |face, c| [0.0, 1.0, 0.3 * c[1], 0.0, 0.0, 0.0][face])
}
