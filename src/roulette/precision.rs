//! The probability in single precision, to show what double precision is for and what it costs.

use super::{Lobe, probability};
pub use crate::settings::LobePrecision;
use glam::{DVec3, Vec3};

/// A lobe for single precision.
#[derive(Debug, Clone, Copy)]
pub(super) struct NarrowLobe {
    /// Frame, x and y over their roughness.
    rows: [Vec3; 3],
    /// max(alpha_x, alpha_y)^2.
    a2: f32,
    /// sqrt(C c): the probability is (this / h)^2, whose parts stay within range longer than C, c and h^2 do.
    root: f32,
}

impl NarrowLobe {
    pub fn new(lobe: &Lobe, constant: f64) -> Self {
        let (frame, (ax, ay)) = (lobe.frame(), lobe.alpha());
        let row = |axis: DVec3, alpha: f64| axis.as_vec3() * (1.0 / alpha as f32);
        Self {
            rows: [row(frame.x, ax), row(frame.y, ay), frame.z.as_vec3()],
            a2: ax.max(ay) as f32 * ax.max(ay) as f32,
            root: (constant * lobe.weight()).sqrt() as f32,
        }
    }

    /// As [`Lobe::h`].
    #[inline(always)]
    fn h(&self, offset: Vec3) -> f32 {
        let [x, y, z] = self.rows.map(|row| row.dot(offset));
        let t2 = x * x + y * y;
        let u = (self.a2 * t2 + z * z).sqrt();
        if z > 0.0 {
            let w = u + z;
            0.5 * (t2 / w + w)
        } else if u > 0.0 {
            let w = u - z;
            0.5 * (w / self.a2 + self.a2 * t2 / w)
        } else {
            u
        }
    }
}

/// `P` of a light vertex at an offset.
#[inline(always)]
pub(super) fn narrow(lobes: impl Iterator<Item = NarrowLobe>, offset: Vec3) -> f64 {
    let mut sum = 0.0;
    for lobe in lobes {
        let root = lobe.root / lobe.h(offset);
        sum += root * root;
    }
    if sum >= 1.0 {
        1.0
    } else if sum > 0.0 {
        f64::from(sum)
    } else {
        0.0 // also for NaN
    }
}

/// [`probability`] in some arithmetic, as queries have it from an eye vertex at `position`.
#[inline]
pub fn probability_in(
    precision: LobePrecision,
    lobes: &[Lobe],
    constant: f64,
    position: DVec3,
    offset: DVec3,
) -> f64 {
    let offset = match precision {
        LobePrecision::F64 => return probability(lobes, constant, offset),
        LobePrecision::Rebased => offset.as_vec3(),
        // Rounding to f32 leaves the light vertex's stored position.
        LobePrecision::F32 => (offset + position).as_vec3() - position.as_vec3(),
    };
    narrow(lobes.iter().map(|lobe| NarrowLobe::new(lobe, constant)), offset)
}
