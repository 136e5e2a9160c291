//! Ordering vertices so that every subtree of the perfect tree is compact: recursive splits at child boundaries.

use glam::Vec3;

/// Sorts (position, index) so that runs of 8^k are compact.
pub(super) fn order(points: &mut [(Vec3, u32)]) {
    // the largest power of 8 times 8 below len
    let mut child = 8usize;
    while child * 8 < points.len() {
        child *= 8;
    }
    split(points, child);
}

fn split(points: &mut [(Vec3, u32)], child: usize) {
    if points.len() <= 8 {
        return;
    }
    if points.len() <= child {
        return split(points, child / 8);
    }
    let children = points.len().div_ceil(child);
    let at = children.div_ceil(2) * child;
    let (mut lo, mut hi) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for p in points.iter() {
        lo = lo.min(p.0);
        hi = hi.max(p.0);
    }
    let e = hi - lo;
    let axis = if e.x >= e.y && e.x >= e.z {
        0
    } else if e.y >= e.z {
        1
    } else {
        2
    };
    points.select_nth_unstable_by(at, |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
    let (a, b) = points.split_at_mut(at);
    if a.len() > 20_000 {
        rayon::join(|| split(a, child), || split(b, child));
    } else {
        split(a, child);
        split(b, child);
    }
}
