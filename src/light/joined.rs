//! Which triangles are one lamp: those that share a corner.

use glam::DVec3;
use std::collections::HashMap;
use std::collections::hash_map::Entry;

/// For each triangle the number of the first one that is of the same lamp. Corners are shared where their positions are the
/// same to the bit, since files give a corner once for each of its normals.
pub(super) fn lamps(triangles: impl Iterator<Item = [DVec3; 3]>) -> Vec<usize> {
    let mut first_at: HashMap<[u64; 3], usize> = HashMap::new();
    let mut joined: Vec<usize> = Vec::new();
    for (i, corners) in triangles.enumerate() {
        joined.push(i);
        for corner in corners {
            // No negative zero.
            match first_at.entry((corner + DVec3::ZERO).to_array().map(f64::to_bits)) {
                Entry::Vacant(free) => _ = free.insert(i),
                Entry::Occupied(taken) => {
                    let (a, b) = (first(&mut joined, *taken.get()), first(&mut joined, i));
                    joined[a.max(b)] = a.min(b);
                }
            }
        }
    }
    (0..joined.len()).map(|i| first(&mut joined, i)).collect()
}

/// The first triangle of a triangle's lamp so far; the way there is halved for the next time.
fn first(joined: &mut [usize], mut i: usize) -> usize {
    while joined[i] != i {
        joined[i] = joined[joined[i]];
        i = joined[i];
    }
    i
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_touches_is_one_lamp() {
        let at = |x: i32, y: i32| DVec3::new(f64::from(x), f64::from(y), -0.0);
        // Two pairs that a fifth triangle joins at last, and one alone.
        let triangles = [
            [at(0, 0), at(1, 0), at(0, 1)],
            [at(9, 0), at(9, 1), at(8, 0)],
            [at(0, 1), at(0, 2), at(1, 2)],
            [at(50, 0), at(51, 0), at(50, 1)],
            [at(8, 0), at(7, 0), at(7, 1)],
            [at(1, 2) + DVec3::ZERO, at(4, 4), at(7, 1)],
        ];
        assert_eq!(lamps(triangles.into_iter()), [0, 0, 0, 3, 0, 0]);
        assert!(lamps([].into_iter()).is_empty());
    }
}
