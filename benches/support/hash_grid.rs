//! A grid of cubes as wide as the radius is long times two, hashed to a table as long as there are points: what most
//! renderers merge vertices with [Georgiev 2012]. Points of a cell lie side by side.

use glam::{DVec3, IVec3, Vec3};
use rayon::prelude::*;

pub struct HashGrid {
    cell: f32,
    /// First point of each cell, and the end.
    starts: Vec<u32>,
    points: Vec<(Vec3, u32)>,
}

impl HashGrid {
    pub fn new(points: &[Vec3], radius: f64) -> Self {
        let cell = 2.0 * radius as f32;
        let cells = points.len().next_power_of_two();
        let slots: Vec<u32> =
            points.par_iter().map(|&p| slot((p / cell).floor().as_ivec3(), cells)).collect();
        let mut starts = vec![0; cells + 1];
        for &slot in &slots {
            starts[slot as usize + 1] += 1;
        }
        for i in 0..cells {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut sorted = vec![(Vec3::ZERO, 0); points.len()];
        for (i, &slot) in slots.iter().enumerate() {
            sorted[next[slot as usize] as usize] = (points[i], i as u32);
            next[slot as usize] += 1;
        }
        Self { cell, starts, points: sorted }
    }

    /// Visits the index of every point within the radius that the grid was made for.
    pub fn within(&self, center: DVec3, radius: f64, visit: &mut impl FnMut(u32)) {
        let low = ((center.as_vec3() / self.cell) - 0.5).floor().as_ivec3();
        let mut slots = [0; 8];
        for (i, s) in slots.iter_mut().enumerate() {
            let i = i as i32;
            *s = slot(low + IVec3::new(i & 1, i >> 1 & 1, i >> 2), self.starts.len() - 1);
        }
        for (i, &slot) in slots.iter().enumerate() {
            if slots[..i].contains(&slot) {
                continue; // two cells of one hash
            }
            for &(p, index) in
                &self.points[self.starts[slot as usize] as usize..self.starts[slot as usize + 1] as usize]
            {
                if (p.as_dvec3() - center).length_squared() <= radius * radius {
                    visit(index);
                }
            }
        }
    }
}

fn slot(cell: IVec3, cells: usize) -> u32 {
    let hash = (cell.x as u32).wrapping_mul(73_856_093)
        ^ (cell.y as u32).wrapping_mul(19_349_663)
        ^ (cell.z as u32).wrapping_mul(83_492_791);
    hash & (cells as u32 - 1)
}
