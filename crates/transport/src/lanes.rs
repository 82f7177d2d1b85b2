//! Lanes: the same arithmetic on four numbers at once, which compilers turn into the widest registers that a function is
//! compiled for. All is inlined and without closures, so that a function with a `target_feature` has it to its end; lane by
//! lane and in the same order the results are those of plain numbers, bit for bit.

use glam::DVec3;
use std::ops::{Add, Div, Mul, Sub};

/// Four numbers.
#[derive(Clone, Copy, Debug)]
pub struct Lanes(pub [f64; 4]);

macro_rules! lanewise {
    ($($operation:ident $name:ident $sign:tt),*) => {$(
        impl $operation for Lanes {
            type Output = Lanes;
            #[inline(always)]
            fn $name(self, Lanes([e, f, g, h]): Lanes) -> Lanes {
                let Lanes([a, b, c, d]) = self;
                Lanes([a $sign e, b $sign f, c $sign g, d $sign h])
            }
        }
    )*};
}
lanewise!(Add add +, Sub sub -, Mul mul *, Div div /);

impl Lanes {
    /// One number in every lane.
    #[inline(always)]
    pub fn of(x: f64) -> Lanes {
        Lanes([x; 4])
    }

    /// Square roots.
    #[inline(always)]
    pub fn sqrt(self) -> Lanes {
        let Lanes([a, b, c, d]) = self;
        Lanes([a.sqrt(), b.sqrt(), c.sqrt(), d.sqrt()])
    }

    /// Absolute values.
    #[inline(always)]
    pub fn abs(self) -> Lanes {
        let Lanes([a, b, c, d]) = self;
        Lanes([a.abs(), b.abs(), c.abs(), d.abs()])
    }

    /// The larger of each.
    #[inline(always)]
    pub fn max(self, other: Lanes) -> Lanes {
        let (Lanes([a, b, c, d]), Lanes([e, f, g, h])) = (self, other);
        Lanes([larger(a, e), larger(b, f), larger(c, g), larger(d, h)])
    }

    /// The smaller of each.
    #[inline(always)]
    pub fn min(self, other: Lanes) -> Lanes {
        let (Lanes([a, b, c, d]), Lanes([e, f, g, h])) = (self, other);
        Lanes([smaller(a, e), smaller(b, f), smaller(c, g), smaller(d, h)])
    }

    /// Own lanes where `condition` is above zero, others' elsewhere.
    #[inline(always)]
    pub fn above_zero(Lanes([p, q, r, s]): Lanes, Lanes([a, b, c, d]): Lanes, Lanes([e, f, g, h]): Lanes) -> Lanes {
        let pick = |condition: f64, own: f64, other: f64| if condition > 0.0 { own } else { other };
        Lanes([pick(p, a, e), pick(q, b, f), pick(r, c, g), pick(s, d, h)])
    }
}

#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[inline(always)]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// Four vectors, by coordinate.
pub type Vectors = [Lanes; 3];

/// a − b.
#[inline(always)]
pub fn minus(a: Vectors, b: Vectors) -> Vectors {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// a · b.
#[inline(always)]
pub fn dot(a: Vectors, b: Vectors) -> Lanes {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a × b.
#[inline(always)]
pub fn cross(a: Vectors, b: Vectors) -> Vectors {
    [a[1] * b[2] - b[1] * a[2], a[2] * b[0] - b[2] * a[0], a[0] * b[1] - b[0] * a[1]]
}

/// One vector in every lane.
#[inline(always)]
pub fn everywhere(v: DVec3) -> Vectors {
    [Lanes::of(v.x), Lanes::of(v.y), Lanes::of(v.z)]
}
