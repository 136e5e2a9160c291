//! Cutting the polygons of an OBJ file into triangles.

use earcut::Earcut;
use glam::DVec3;

/// Cuts polygons; keeps its memory from one to the next.
#[derive(Default)]
pub(super) struct Cutter {
    earcut: Earcut<f64>,
    flat: Vec<[f64; 2]>,
    indices: Vec<u32>,
}

impl Cutter {
    /// Adds the triangles of a polygon to `out`, as indices of its corners, turning the way it turns: always two fewer
    /// than it has corners. False if it cannot be cut cleanly, because it crosses itself or has no area; it is then a
    /// fan all the same.
    pub(super) fn cut(&mut self, corners: &[DVec3], out: &mut Vec<[u32; 3]>) -> bool {
        let fan = (1..corners.len() as u32 - 1).map(|i| [0, i, i + 1]);
        if corners.len() == 3 {
            out.extend(fan);
            return true;
        }
        let normal_of = |[a, b, c]: [u32; 3]| {
            let [a, b, c] = [a, b, c].map(|i| corners[i as usize]);
            (b - a).cross(c - a)
        };
        // The sum over a fan is the polygon's own normal, whatever its shape [Newell].
        let normal: DVec3 = fan.clone().map(normal_of).sum();
        if fan.clone().all(|t| normal_of(t).dot(normal) >= 0.0) {
            out.extend(fan);
            return normal != DVec3::ZERO;
        }
        // Seen along its normal's largest component.
        let project = |p: DVec3| match normal.abs().max_position() {
            0 => [p.y, p.z],
            1 => [p.z, p.x],
            _ => [p.x, p.y],
        };
        self.flat.clear();
        self.flat.extend(corners.iter().map(|&p| project(p - corners[0])));
        self.earcut.earcut(self.flat.iter().copied(), &[], &mut self.indices);
        if self.indices.len() != 3 * (corners.len() - 2) {
            out.extend(fan);
            return false;
        }
        out.extend(self.indices.chunks_exact(3).map(|t| {
            let t = [t[0], t[1], t[2]];
            if normal_of(t).dot(normal) < 0.0 { [t[0], t[2], t[1]] } else { t }
        }));
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(corners: &[DVec3], triangles: &[[u32; 3]], normal: DVec3) -> f64 {
        let area = |&[a, b, c]: &[u32; 3]| {
            let [a, b, c] = [a, b, c].map(|i| corners[i as usize]);
            let area = 0.5 * (b - a).cross(c - a).dot(normal);
            assert!(area > 0.0, "turned over");
            area
        };
        triangles.iter().map(area).sum()
    }

    #[test]
    fn concave_polygons_keep_their_area_in_every_plane() {
        // A U of area 5, starting at each of its corners: only some of the fans would do.
        let u = [(0, 0), (3, 0), (3, 2), (2, 2), (2, 1), (1, 1), (1, 2), (0, 2)];
        for start in 0..8 {
            let axes = [
                (DVec3::X, DVec3::Y),
                (DVec3::Y, DVec3::X),
                (DVec3::Y, DVec3::Z),
                (DVec3::Z, DVec3::Y),
                (DVec3::Z, DVec3::X),
                (DVec3::X, DVec3::Z),
                (DVec3::new(0.6, 0.8, 0.0), DVec3::new(-0.48, 0.36, 0.8)),
            ];
            for (a, b) in axes {
                let far = DVec3::splat(1e5);
                let corners: Vec<DVec3> = (0..8)
                    .map(|i| u[(start + i) % 8])
                    .map(|(x, y)| far + a * x as f64 + b * y as f64)
                    .collect();
                let mut triangles = Vec::new();
                assert!(Cutter::default().cut(&corners, &mut triangles));
                assert_eq!(triangles.len(), 6);
                assert!((area(&corners, &triangles, a.cross(b)) - 5.0).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn what_cannot_be_cut_is_a_fan() {
        let mut triangles = Vec::new();
        let line: Vec<DVec3> = (0..5).map(|i| DVec3::X * f64::from(i)).collect();
        assert!(!Cutter::default().cut(&line, &mut triangles));
        assert_eq!(triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
        triangles.clear();
        assert!(!Cutter::default().cut(&[DVec3::ONE; 6], &mut triangles));
        assert_eq!(triangles.len(), 4);
    }
}
