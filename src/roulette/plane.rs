//! Lower bounds of a lobe's distance function over eight boxes at a time, in f32, from supporting planes
//! (docs/theory.md section 4).

use super::lobe::Lobe;
use fearless_simd::{Simd, f32x8, prelude::*};

/// A lobe as the box test sees it: f32, and scaled so that `h(x) <= 1 / sqrt(xi)` is the roulette's condition.
#[derive(Debug, Clone, Copy)]
pub(super) struct FlatLobe {
    /// World to lobe space: the frame's rows over (alpha_x, alpha_y, 1) sqrt(C c).
    rows: [[f32; 3]; 3],
    /// Lobe axis in world space; unit, shortened as the lobe becomes a sphere and the axis loses its meaning.
    axis: [f32; 3],
    /// The thin axis of a lobe that is much flatter one way than the other.
    thin: Option<[f32; 3]>,
    a2: f32,
    inv_a2: f32,
}

/// Roundings as a fraction of a box's reach (L1 norms of centre and half extents): of the offset, the rows, the plane.
const PAD: f32 = 6e-7;

/// Ratio of the two roughnesses from which a plane across the thin axis pays.
const THIN: f64 = 3.0;

impl FlatLobe {
    /// What stands in for no lobe.
    pub const NONE: Self = Self { rows: [[0.0; 3]; 3], axis: [0.0; 3], thin: None, a2: 1.0, inv_a2: 1.0 };

    /// `None` for a lobe that accepts nothing.
    pub fn new(lobe: &Lobe, constant: f64) -> Option<Self> {
        let power = constant * lobe.weight();
        if !(power > 0.0) {
            return None;
        }
        let scale = 1.0 / power.sqrt();
        let (f, (ax, ay)) = (lobe.frame(), lobe.alpha());
        let a2 = ax.max(ay) * ax.max(ay);
        let thin = match () {
            _ if ay > THIN * ax => Some(f.x.as_vec3().to_array()),
            _ if ax > THIN * ay => Some(f.y.as_vec3().to_array()),
            _ => None,
        };
        Some(Self {
            rows: [f.x * (scale / ax), f.y * (scale / ay), f.z * scale].map(|r| r.as_vec3().to_array()),
            axis: (f.z * (1.0 - a2)).as_vec3().to_array(),
            thin,
            a2: a2 as f32,
            inv_a2: (1.0 / a2) as f32,
        })
    }
}

/// Eight vectors.
///
/// No closures in what follows: one that is not inlined loses the instruction set that the walk was compiled for.
#[derive(Clone, Copy)]
pub(super) struct Vec8<S: Simd> {
    x: f32x8<S>,
    y: f32x8<S>,
    z: f32x8<S>,
}

impl<S: Simd> Vec8<S> {
    #[inline(always)]
    fn load(simd: S, v: &[[f32; 8]; 3]) -> Self {
        let [x, y, z] = v;
        Self {
            x: f32x8::load_array_ref(simd, x),
            y: f32x8::load_array_ref(simd, y),
            z: f32x8::load_array_ref(simd, z),
        }
    }

    /// Eight points relative to a point given in two f32 parts, so that nothing is lost far from the origin.
    #[inline(always)]
    pub fn relative(simd: S, points: &[[f32; 8]; 3], high: [f32; 3], low: [f32; 3]) -> Self {
        let p = Self::load(simd, points);
        Self { x: (p.x - high[0]) - low[0], y: (p.y - high[1]) - low[1], z: (p.z - high[2]) - low[2] }
    }

    #[inline(always)]
    fn dot(self, other: Self) -> f32x8<S> {
        self.z.mul_add(other.z, self.y.mul_add(other.y, self.x * other.x))
    }

    #[inline(always)]
    fn dot_row(self, row: [f32; 3]) -> f32x8<S> {
        self.z.mul_add(row[2], self.y.mul_add(row[1], self.x * row[0]))
    }

    #[inline(always)]
    fn times(self, other: Self) -> Self {
        Self { x: self.x * other.x, y: self.y * other.y, z: self.z * other.z }
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self { x: self.x.abs(), y: self.y.abs(), z: self.z.abs() }
    }

    #[inline(always)]
    fn sum(self) -> f32x8<S> {
        self.x + self.y + self.z
    }

    #[inline(always)]
    fn add_to_each(self, v: f32x8<S>) -> Self {
        Self { x: self.x + v, y: self.y + v, z: self.z + v }
    }

    /// The point of the boxes nearest to a point, by components.
    #[inline(always)]
    fn clamp(self, lo: Self, hi: Self) -> Self {
        Self { x: self.x.max(lo.x).min(hi.x), y: self.y.max(lo.y).min(hi.y), z: self.z.max(lo.z).min(hi.z) }
    }
}

/// Eight boxes relative to the eye vertex, grown by what roundings may move.
#[derive(Clone, Copy)]
pub(super) struct Box8<S: Simd> {
    center: Vec8<S>,
    half: Vec8<S>,
}

impl<S: Simd> Box8<S> {
    #[inline(always)]
    pub fn new(simd: S, center: Vec8<S>, half: &[[f32; 8]; 3]) -> Self {
        let half = Vec8::load(simd, half);
        let pad = (center.abs().sum() + half.sum()) * PAD;
        Self { center, half: half.add_to_each(pad) }
    }

    /// Boxes around points: nothing but the pad.
    #[inline(always)]
    pub fn around_points(points: Vec8<S>) -> Self {
        let pad = points.abs().sum() * PAD;
        Self { center: points, half: Vec8 { x: pad, y: pad, z: pad } }
    }

    /// Lower bounds of the scaled `h` over the boxes, 0 where none is found; `POINTS` says that they are all but
    /// points, for which one plane is enough.
    #[inline(always)]
    pub fn bound<const POINTS: bool>(self, lobe: &FlatLobe) -> f32x8<S> {
        let (c, e) = (self.center, self.half);
        if POINTS {
            return positive(self.plane(lobe, c));
        }
        let lo = Vec8 { x: c.x - e.x, y: c.y - e.y, z: c.z - e.z };
        let hi = Vec8 { x: c.x + e.x, y: c.y + e.y, z: c.z + e.z };
        let along = c.dot_row(lobe.axis).max(0.0);
        let [ax, ay, az] = lobe.axis;
        let on_axis = Vec8 { x: along * ax, y: along * ay, z: along * az };
        let mut bound = positive(self.plane(lobe, c)).max(positive(self.plane(lobe, on_axis.clamp(lo, hi))));
        if let Some(thin) = lobe.thin {
            // The point nearest to the plane across the thin axis, in the box's own metric.
            let slope = e.times(e);
            let slope = Vec8 { x: slope.x * thin[0], y: slope.y * thin[1], z: slope.z * thin[2] };
            let step = c.dot_row(thin) / slope.dot_row(thin);
            let near = Vec8 { x: c.x - slope.x * step, y: c.y - slope.y * step, z: c.z - slope.z * step };
            bound = bound.max(positive(self.plane(lobe, near.clamp(lo, hi))));
        }
        bound
    }

    /// The least value that the plane supporting `h` at `p` takes over the box.
    ///
    /// With W = U + |z| the gradient in lobe space is ((1+a^2)/2 x/U, (1+a^2)/2 y/U, g), where
    /// g = (W - t^2/W) / 2U for z > 0 and (a^2 t^2/W - W/a^2) / 2U otherwise.
    #[inline(always)]
    fn plane(self, lobe: &FlatLobe, p: Vec8<S>) -> f32x8<S> {
        let [rx, ry, rz] = lobe.rows;
        let (x, y, z) = (p.dot_row(rx), p.dot_row(ry), p.dot_row(rz));
        let t2 = x.mul_add(x, y * y);
        let u = t2.mul_add(lobe.a2, z * z).sqrt();
        let w = u + z.abs();
        let inv_uw = 1.0 / (u * w);
        let (half_inv_u, t2_w) = (w * inv_uw * 0.5, t2 * u * inv_uw);
        let side = half_inv_u * (1.0 + lobe.a2);
        let front = z.simd_gt(0.0).select(w - t2_w, t2_w * lobe.a2 - w * lobe.inv_a2);
        let (gx, gy, gz) = (x * side, y * side, front * half_inv_u);
        let normal = Vec8 {
            x: gz.mul_add(rz[0], gy.mul_add(ry[0], gx * rx[0])),
            y: gz.mul_add(rz[1], gy.mul_add(ry[1], gx * rx[1])),
            z: gz.mul_add(rz[2], gy.mul_add(ry[2], gx * rx[2])),
        };
        normal.dot(self.center) - normal.abs().dot(self.half)
    }
}

/// A bound below zero, or NaN from the plane at the eye vertex itself, is no bound.
#[inline(always)]
fn positive<S: Simd>(bound: f32x8<S>) -> f32x8<S> {
    bound.simd_gt(0.0).select(bound, f32x8::splat(bound.simd, 0.0))
}
