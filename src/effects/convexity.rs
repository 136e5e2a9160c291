//! Whether a mesh can light itself.

use super::predicate::{Judge, Predicate};
use crate::geometry::Mesh;
use glam::DVec3;
use std::collections::HashMap;

/// Most triangles of a mesh that is tried for being convex.
const MOST_TRIANGLES: usize = 1024;

/// Whether no two points of a mesh see each other on the side on which the camera and lamps (`eyes`, world coordinates)
/// are: it is flat, or closed and convex, and they are outside.
pub(super) fn is_convex_from_outside(mesh: &Mesh, eyes: &[DVec3], judge: Judge) -> bool {
    let count = mesh.triangles.len();
    if count == 0 || count > MOST_TRIANGLES {
        return false;
    }
    let size = mesh.bounds().radius();
    let corners: Vec<DVec3> =
        mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize].as_dvec3()).collect();
    let planes: Vec<(DVec3, f64)> = (0..count as u32)
        .map(|t| {
            let n = mesh.scaled_normal(t).normalize_or_zero();
            (n, n.dot(mesh.corners(t)[0]))
        })
        .collect();
    let tolerance = 1e-5 * size;
    let flat = planes.iter().all(|(n, d)| corners.iter().all(|p| (n.dot(*p) - d).abs() <= tolerance));
    if judge.holds(Predicate::Flat, flat) {
        return true;
    }
    let behind = planes.iter().all(|(n, d)| corners.iter().all(|p| n.dot(*p) - d <= tolerance));
    // Closed: each edge is there once in either direction. Corners are the same where their positions are.
    let mut edges: HashMap<[[u32; 3]; 2], i32> = HashMap::new();
    for t in &mesh.triangles {
        let p = t.map(|v| mesh.positions[v as usize].to_array().map(|x| (x + 0.0).to_bits()));
        for [a, b] in [[p[0], p[1]], [p[1], p[2]], [p[2], p[0]]] {
            *edges.entry(if a < b { [a, b] } else { [b, a] }).or_default() += if a < b { 1 } else { -1 };
        }
    }
    let closed = edges.values().all(|&n| n == 0);
    let outside = eyes.iter().all(|eye| planes.iter().any(|(n, d)| n.dot(*eye - mesh.origin) > *d));
    judge.holds(Predicate::Convex, behind)
        && judge.holds(Predicate::Closed, closed)
        && judge.holds(Predicate::Outside, outside)
}
