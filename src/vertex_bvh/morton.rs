//! The order along a space-filling curve.

use crate::math::Aabb;
use glam::Vec3;

/// Maps a box to a 2^21 grid along each axis; cells are cubes, so that thin boxes do not waste key bits on nothing.
#[derive(Debug, Clone, Copy)]
pub struct Grid {
    origin: [f64; 3],
    scale: f64,
}

const CELLS: f64 = (1u32 << 21) as f64;

impl Grid {
    /// A grid over a box that is not empty.
    pub fn over(bounds: Aabb) -> Self {
        let (lo, hi) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
        let extent = (hi - lo).max_element();
        Self { origin: lo.to_array(), scale: if extent > 0.0 { CELLS / extent } else { 0.0 } }
    }

    /// The cell of a point within the box, 63 bits of Morton code.
    pub fn key(&self, p: Vec3) -> u64 {
        let cell = |axis: usize| {
            let c = (f64::from(p[axis]) - self.origin[axis]) * self.scale;
            (c as u64).min(CELLS as u64 - 1)
        };
        spread(cell(0)) << 2 | spread(cell(1)) << 1 | spread(cell(2))
    }
}

/// Moves bit i of 21 bits to bit 3 i.
fn spread(x: u64) -> u64 {
    let x = (x | x << 32) & 0x001f_0000_0000_ffff;
    let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_spread_in_threes() {
        for bit in 0..21 {
            assert_eq!(spread(1 << bit), 1 << (3 * bit));
        }
        assert_eq!(spread((1 << 21) - 1), 0x1249_2492_4924_9249);
    }
}
