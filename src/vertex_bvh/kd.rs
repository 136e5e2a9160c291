//! The order of vertices in the tree: recursive splits, each at a multiple of a child's capacity, so that every run
//! of 8^k vertices that the perfect tree makes a node is compact.

use glam::Vec3;

/// A vertex on its way to its place.
#[derive(Debug, Clone, Copy)]
pub struct Placed {
    /// Finite.
    pub position: Vec3,
    /// Among the vertices as they were given.
    pub index: u32,
}

impl Placed {
    /// Sorts as the coordinate along an axis and, where that is equal, as the index: a total order, so that the tree
    /// does not depend on how the work was shared out.
    #[inline(always)]
    fn key<const AXIS: usize>(&self) -> u64 {
        let bits = self.position.to_array()[AXIS].to_bits();
        let ordered = bits ^ ((bits as i32 >> 31) as u32 | 0x8000_0000);
        u64::from(ordered) << 32 | u64::from(self.index)
    }
}

/// Vertices below which a task is not worth handing to another thread.
const GRAIN: usize = 1 << 11;

/// Puts vertices into the order of a tree of `WIDTH` children a node over blocks of `BLOCK` vertices.
pub fn order<const WIDTH: usize, const BLOCK: usize>(vertices: &mut [Placed]) {
    let mut child = BLOCK;
    while child * WIDTH < vertices.len() {
        child *= WIDTH;
    }
    split::<WIDTH, BLOCK>(vertices, child);
}

/// Orders the vertices of one node whose children hold `child` each.
fn split<const WIDTH: usize, const BLOCK: usize>(vertices: &mut [Placed], child: usize) {
    if vertices.len() <= child {
        if child > BLOCK {
            split::<WIDTH, BLOCK>(vertices, child / WIDTH);
        }
        return;
    }
    let middle = vertices.len().div_ceil(child).div_ceil(2) * child;
    let axis = widest(vertices);
    // The axis as a constant makes the comparisons twice as fast.
    match axis {
        0 => vertices.select_nth_unstable_by_key(middle, Placed::key::<0>),
        1 => vertices.select_nth_unstable_by_key(middle, Placed::key::<1>),
        _ => vertices.select_nth_unstable_by_key(middle, Placed::key::<2>),
    };
    let (low, high) = vertices.split_at_mut(middle);
    if low.len() + high.len() > GRAIN {
        rayon::join(|| split::<WIDTH, BLOCK>(low, child), || split::<WIDTH, BLOCK>(high, child));
    } else {
        split::<WIDTH, BLOCK>(low, child);
        split::<WIDTH, BLOCK>(high, child);
    }
}

/// The axis along which the vertices spread furthest.
fn widest(vertices: &[Placed]) -> usize {
    let (mut lo, mut hi) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for v in vertices {
        lo = lo.min(v.position);
        hi = hi.max(v.position);
    }
    // Each difference may overflow to infinity: still the widest.
    (hi - lo).max_position()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_sort_as_numbers() {
        let at = |x: f32| Placed { position: Vec3::new(x, 0.0, 0.0), index: 0 }.key::<0>();
        let numbers = [f32::MIN, -2.0, -1e-40, -0.0, 0.0, 1e-40, 1.0, f32::MAX];
        assert!(numbers.windows(2).all(|w| at(w[0]) < at(w[1])));
    }
}
