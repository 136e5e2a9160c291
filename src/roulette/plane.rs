//! Lower bounds of a lobe's distance function over eight boxes at a time, in f32, from supporting planes
//! (docs/theory.md section 4).

use super::lobe::Lobe;
use fearless_simd::{Simd, f32x8, prelude::*};
use glam::Vec3;

/// A lobe as the box test sees it: f32, and scaled so that `h(x) <= 1 / sqrt(xi)` is the roulette's condition.
#[derive(Debug, Clone, Copy)]
pub struct FlatLobe {
    /// World to lobe space: the frame's rows over (alpha_x, alpha_y, 1) sqrt(C c).
    rows: [[f32; 3]; 3],
    /// How far along world axis i a displacement along j must be made good to stay as near to the lobe's axis as
    /// can be: the first two rows' Gram matrix, each line over its diagonal.
    follow: [[f32; 3]; 3],
    /// 1 / support function of the ellipsoid h = 1 along x, y, z and -x, -y, -z.
    inv_support: [[f32; 3]; 2],
    /// The thin axis of a lobe that is much flatter one way than the other.
    thin: Option<[f32; 3]>,
    a2: f32,
    inv_a2: f32,
}

/// Roundings as a fraction of a box's reach (L1 norms of centre and half extents): of the offset, the rows, the plane.
pub const PAD: f32 = 6e-7;

/// The same as a length: what is lost where f32 ends, with denormals flushed to zero.
const TINY: f32 = 1e-37;

/// Beyond these, what the scale is multiplied by would be denormal, or infinite, in f32.
const MIN_SCALE: f64 = 1e-30;
const MAX_SCALE: f64 = 1e30;

/// Ratio of the two roughnesses from which a plane across the thin axis pays.
const THIN: f64 = 3.0;

impl FlatLobe {
    /// `None` for a lobe that accepts nothing.
    pub fn new(lobe: &Lobe, constant: f64) -> Option<Self> {
        if !(constant > 0.0 && lobe.weight() > 0.0) {
            return None;
        }
        // Where f32 has no digits for the scale, a range that is too large stands in: the largest is everything.
        let scale = match 1.0 / (constant * lobe.weight()).sqrt() {
            s if s < MIN_SCALE => 0.0,
            s => s.min(MAX_SCALE),
        };
        let (frame, (ax, ay)) = (lobe.frame(), lobe.alpha());
        let a2 = ax.max(ay) * ax.max(ay);
        let (x, y, z) = (frame.x.as_vec3(), frame.y.as_vec3(), frame.z.as_vec3());
        let (x_row, y_row, z_row) = (x * (scale / ax) as f32, y * (scale / ay) as f32, z * scale as f32);
        let (x_step, y_step) = (x * (1.0 / ax) as f32, y * (1.0 / ay) as f32);
        let thin = match () {
            _ if ay > THIN * ax => Some(x.to_array()),
            _ if ax > THIN * ay => Some(y.to_array()),
            _ => None,
        };
        let (scale, ax, ay, a2) = (scale as f32, ax as f32, ay as f32, a2 as f32);

        // A world axis along the lobe's brings nothing nearer: the bound only shortens the step there.
        let length2 = (x_step * x_step + y_step * y_step).max(Vec3::splat(1e-12));
        let follow = |i: usize| ((x_step[i] * x_step + y_step[i] * y_step) / length2[i]).to_array();

        // The ellipsoid's centre and half width along the world axes; w - |m| without its cancellation.
        let side2 = (x * ax) * (x * ax) + (y * ay) * (y * ay);
        let m = 0.5 * (1.0 - a2) * z;
        let half = 0.5 * (1.0 + a2) * z;
        let far = (side2 + half * half).map(f32::sqrt) + m.abs();
        let near = (side2 + a2 * z * z) / far;
        let ahead = m.cmpgt(Vec3::ZERO);
        let inv = |support: Vec3| (scale / support).to_array();
        Some(Self {
            rows: [x_row.to_array(), y_row.to_array(), z_row.to_array()],
            follow: [follow(0), follow(1), follow(2)],
            inv_support: [inv(Vec3::select(ahead, far, near)), inv(Vec3::select(ahead, near, far))],
            thin,
            a2,
            inv_a2: 1.0 / a2,
        })
    }
}

/// Eight vectors.
///
/// No closures in what follows: one that is not inlined loses the instruction set that the walk was compiled for.
#[derive(Clone, Copy)]
pub struct Vec8<S: Simd> {
    /// First components.
    pub x: f32x8<S>,
    /// Second components.
    pub y: f32x8<S>,
    /// Third components.
    pub z: f32x8<S>,
}

impl<S: Simd> Vec8<S> {
    /// Eight vectors that lie component by component.
    #[inline(always)]
    pub fn load(simd: S, v: &[[f32; 8]; 3]) -> Self {
        let [x, y, z] = v;
        Self {
            x: f32x8::load_array_ref(simd, x),
            y: f32x8::load_array_ref(simd, y),
            z: f32x8::load_array_ref(simd, z),
        }
    }

    /// The same points relative to one given in two f32 parts, so that nothing is lost far from the origin.
    #[inline(always)]
    pub fn relative(self, high: [f32; 3], low: [f32; 3]) -> Self {
        Self {
            x: (self.x - high[0]) - low[0],
            y: (self.y - high[1]) - low[1],
            z: (self.z - high[2]) - low[2],
        }
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
}

/// Eight boxes relative to the eye vertex, grown by what roundings may move: their reach times a pad, by default [`PAD`].
#[derive(Clone, Copy)]
pub struct Box8<S: Simd> {
    center: Vec8<S>,
    half: Vec8<S>,
}

impl<S: Simd> Box8<S> {
    /// Boxes `center +- half`.
    #[inline(always)]
    pub fn new(center: Vec8<S>, half: Vec8<S>, pad: f32) -> Self {
        let pad = (center.abs().sum() + half.sum()).mul_add(pad, TINY);
        Self { center, half: half.add_to_each(pad) }
    }

    /// Boxes around points: nothing but the pad.
    #[inline(always)]
    pub fn around_points(points: Vec8<S>, pad: f32) -> Self {
        let pad = points.abs().sum().mul_add(pad, TINY);
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
        let mut bound = self.faces(lobe).max(positive(self.plane(lobe, self.nearest_to_axis(lobe))));
        if let Some(thin) = lobe.thin {
            // The point nearest to the plane across the thin axis, in the box's own metric.
            let (ex, ey, ez) = (e.x * e.x * thin[0], e.y * e.y * thin[1], e.z * e.z * thin[2]);
            let step = c.dot_row(thin) / (Vec8 { x: ex, y: ey, z: ez }).dot_row(thin);
            let near = Vec8 {
                x: c.x - (ex * step).max(-e.x).min(e.x),
                y: c.y - (ey * step).max(-e.y).min(e.y),
                z: c.z - (ez * step).max(-e.z).min(e.z),
            };
            bound = bound.max(positive(self.plane(lobe, near)));
        }
        bound
    }

    /// Bounds from the planes of the boxes' faces: where the ellipsoid ends along the world axes.
    #[inline(always)]
    fn faces(self, lobe: &FlatLobe) -> f32x8<S> {
        let (c, e) = (self.center, self.half);
        let [plus, minus] = lobe.inv_support;
        let x = ((c.x - e.x) * plus[0]).max((c.x + e.x) * -minus[0]);
        let y = ((c.y - e.y) * plus[1]).max((c.y + e.y) * -minus[1]);
        let z = ((c.z - e.z) * plus[2]).max((c.z + e.z) * -minus[2]);
        x.max(y).max(z)
    }

    /// A point of each box near the lobe's axis, in the lobe's metric: coordinates descend in turn, once. A second round
    /// saves a sixth of the visits at best and takes as long as it saves.
    #[inline(always)]
    fn nearest_to_axis(self, lobe: &FlatLobe) -> Vec8<S> {
        let (c, e) = (self.center, self.half);
        let [fx, fy, fz] = lobe.follow;
        // u: how far the point is off its best place along an axis; d: its displacement from the centre.
        let dx = (-c.dot_row(fx)).max(-e.x).min(e.x);
        let uy = dx.mul_add(fy[0], c.dot_row(fy));
        let dy = (-uy).max(-e.y).min(e.y);
        let uz = dy.mul_add(fz[1], dx.mul_add(fz[0], c.dot_row(fz)));
        let dz = (-uz).max(-e.z).min(e.z);
        Vec8 { x: c.x + dx, y: c.y + dy, z: c.z + dz }
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
        let (half_inv_u, t2_w) = (w * inv_uw * 0.5, t2 * (u * inv_uw));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Frame;
    use fearless_simd::{Level, dispatch};
    use glam::DVec3;
    use proptest::prelude::*;

    /// The f32 bounds of eight boxes, by the instruction set at hand.
    fn bounds(lobe: &Lobe, constant: f64, boxes: &[[[f32; 8]; 3]; 2], eye: DVec3, points: bool) -> [f32; 8] {
        let flat = FlatLobe::new(lobe, constant).unwrap();
        let high = eye.as_vec3();
        let low = (eye - high.as_dvec3()).as_vec3().to_array();
        let mut out = [0.0; 8];
        dispatch!(Level::new(), simd => {
            let center = Vec8::load(simd, &boxes[0]).relative(high.to_array(), low);
            let b = if points {
                Box8::around_points(center, PAD).bound::<true>(&flat)
            } else {
                Box8::new(center, Vec8::load(simd, &boxes[1]), PAD).bound::<false>(&flat)
            };
            b.store_slice(&mut out);
        });
        out
    }

    fn unit_vector() -> impl Strategy<Value = DVec3> {
        (-1.0..1.0f64, 0.0..std::f64::consts::TAU).prop_map(|(z, phi)| {
            let r = (1.0 - z * z).sqrt();
            DVec3::new(r * phi.cos(), r * phi.sin(), z)
        })
    }

    fn exponent(range: std::ops::Range<f64>) -> impl Strategy<Value = f64> {
        range.prop_map(|e| 10f64.powf(e))
    }

    prop_compose! {
        /// A lobe with a box near its axis, whose place it matters to know well, and points of the box.
        fn cases()(
            axis in unit_vector(), tangent in unit_vector(),
            ax in exponent(-7.0..0.0), aspect in exponent(-3.0..3.0),
            weight in exponent(-6.0..14.0), scale in exponent(-6.0..6.0),
            distance in exponent(-3.0..1.0), off in unit_vector(), aside in exponent(-7.0..0.0),
            half in (exponent(-7.0..0.0), exponent(-7.0..0.0), exponent(-7.0..0.0)),
            far in prop_oneof![Just(0.0), Just(1.0), Just(1e5)],
            eye in unit_vector(),
            inside in prop::collection::vec((-1.0..=1.0f64, -1.0..=1.0f64, -1.0..=1.0f64), 8),
        ) -> (Lobe, [[[f32; 8]; 3]; 2], DVec3, Vec<DVec3>) {
            let frame = Frame::from_z_tangent(axis, tangent);
            let lobe = Lobe::new(frame, ax, (ax * aspect).clamp(1e-7, 1.0), weight);
            let eye = eye * (far * scale);
            let center = eye + (axis * distance + off * (distance * aside)) * scale;
            let half = DVec3::new(half.0, half.1, half.2) * (distance * scale);
            let mut boxes = [[[0.0; 8]; 3]; 2];
            for lane in 0..8 {
                // Eight boxes, from the whole one down to a point.
                let h = half * 10f64.powi(-(lane as i32));
                let h = if lane == 7 { DVec3::ZERO } else { h };
                for axis in 0..3 {
                    boxes[0][axis][lane] = center[axis] as f32;
                    boxes[1][axis][lane] = h[axis] as f32;
                }
            }
            (lobe, boxes, eye, inside.into_iter().map(DVec3::from).collect())
        }
    }

    /// Points of a box to which a bound must not be above: random ones, corners, and the nearest to the axis and
    /// to the eye.
    fn probes(lobe: &Lobe, center: DVec3, half: DVec3, inside: &[DVec3]) -> Vec<DVec3> {
        let mut probes: Vec<_> = inside.iter().map(|s| center + half * *s).collect();
        for corner in 0..8 {
            let sign = |bit: i32| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
            probes.push(center + half * DVec3::new(sign(0), sign(1), sign(2)));
        }
        let (lo, hi) = (center - half, center + half);
        let mut near = center;
        for _ in 0..20 {
            near = (lobe.frame().z * lobe.frame().z.dot(near).max(0.0)).clamp(lo, hi);
            probes.push(near);
        }
        probes.push(DVec3::ZERO.clamp(lo, hi));
        probes
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 4000, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn no_bound_is_above_a_point_of_its_box((lobe, boxes, eye, inside) in cases()) {
            let scale = lobe.weight().sqrt().recip();
            let (wide, narrow) = (bounds(&lobe, 1.0, &boxes, eye, false), bounds(&lobe, 1.0, &boxes, eye, true));
            for lane in 0..8 {
                let at = |v: &[[f32; 8]; 3]| DVec3::new(v[0][lane].into(), v[1][lane].into(), v[2][lane].into());
                let (center, half) = (at(&boxes[0]) - eye, at(&boxes[1]));
                for p in probes(&lobe, center, half, &inside) {
                    let h = lobe.h(p) * scale;
                    // What the walk allows for after the bound: a square's worth of 1e-5.
                    prop_assert!(f64::from(wide[lane]) <= h * (1.0 + 4e-6), "lane {lane}: {} > {h}", wide[lane]);
                }
                let h = lobe.h(center) * scale;
                prop_assert!(f64::from(narrow[lane]) <= h * (1.0 + 4e-6), "point {lane}: {} > {h}", narrow[lane]);
            }
        }
    }

    #[test]
    fn bounds_of_points_are_tight() {
        // A bound of 0 everywhere would pass the test above.
        let frame = Frame::from_z_tangent(DVec3::new(0.3, -0.5, 0.8).normalize(), DVec3::X);
        for (alpha, tolerance) in [(1e-1, 1e-5), (1e-3, 1e-3), (1e-4, 1e-2)] {
            let lobe = Lobe::new(frame, alpha, 2.0 * alpha, 3.0);
            let at = frame.to_world(DVec3::new(2.0 * alpha, alpha, 1.0));
            let mut boxes = [[[0.0; 8]; 3]; 2];
            for axis in 0..3 {
                boxes[0][axis] = [at[axis] as f32; 8];
            }
            let stored = DVec3::from_array(boxes[0].map(|v| f64::from(v[0])));
            let h = lobe.h(stored) / 3f64.sqrt();
            for points in [false, true] {
                let b = f64::from(bounds(&lobe, 1.0, &boxes, DVec3::ZERO, points)[3]);
                assert!(b > h * (1.0 - tolerance), "{alpha}: {b} {h}");
            }
        }
    }

    #[test]
    fn most_disjoint_boxes_near_the_lobe_are_culled() {
        // Boxes of the size of a range, about twice its width beside the axis; disjoint says a fine search.
        use crate::sampler::counter::{mix, unit};
        let u = |i: u64, k: u64| unit(mix(mix(i) ^ k));
        let (mut disjoint, mut culled) = (0, 0);
        for i in 0..3000u64 {
            let axis = (DVec3::new(u(i, 1), u(i, 2), u(i, 3)) * 2.0 - 1.0).normalize();
            let frame = Frame::from_z_tangent(axis, DVec3::new(u(i, 4), u(i, 5), u(i, 6)) - 0.5);
            let alpha = 1e-3;
            let lobe = Lobe::new(frame, alpha, alpha, 1.0);
            let center = frame.to_world(DVec3::new(
                (u(i, 7) - 0.5) * 8.0 * alpha,
                (u(i, 8) - 0.5) * 8.0 * alpha,
                u(i, 9),
            ));
            let half = DVec3::new(u(i, 10), u(i, 11), u(i, 12)) * (2.0 * alpha);
            let mut boxes = [[[0.0; 8]; 3]; 2];
            for axis in 0..3 {
                boxes[0][axis] = [center[axis] as f32; 8];
                boxes[1][axis] = [half[axis] as f32; 8];
            }
            let mut least = f64::INFINITY;
            for n in 0..9i32.pow(3) {
                let s = DVec3::new(f64::from(n % 9), f64::from(n / 9 % 9), f64::from(n / 81)) / 4.0 - 1.0;
                least = least.min(lobe.h(center + half * s));
            }
            // Ranges of sizes (reach 1) that miss every probe by a tenth.
            if least > 1.1 {
                disjoint += 1;
                culled += u32::from(bounds(&lobe, 1.0, &boxes, DVec3::ZERO, false)[0] > 1.0);
            }
        }
        let share = f64::from(culled) / f64::from(disjoint);
        assert!(disjoint > 300 && share > 0.93, "{culled} of {disjoint}");
    }
}
