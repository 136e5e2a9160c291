//! Light vertices near a point, for vertex merging.

use super::{MAX_LEVELS, NodeId, VertexBvh, WIDTH};
use glam::{DVec3, Vec3};

/// Nodes that can wait: all children but one of each level's, and one to take up.
const STACK: usize = MAX_LEVELS * (WIDTH - 1) + 1;

impl VertexBvh {
    /// Visits the index of every vertex whose squared distance to `center` is at most `radius`^2, world units, in tree
    /// order. Distances are those of the stored positions, in double precision.
    pub fn within(&self, center: DVec3, radius: f64, visit: &mut impl FnMut(u32)) {
        let Some(root) = self.root() else { return };
        // Nodes are judged in single precision, on the safe side by more than what that rounds away.
        let near = center.as_vec3();
        let reach = near.abs().max_element()
            + self.bounds().map_or(0.0, |b| b.min.abs().max(b.max.abs()).max_element());
        let wide = radius as f32 * 1.000_01 + reach * (4.0 * f32::EPSILON);
        let mut stack = [root; STACK];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let node = stack[top];
            let count = self.children(node);
            if node.level == 0 {
                let block = &self.blocks()[node.index as usize];
                for lane in 0..count {
                    if (block.point(lane).as_dvec3() - center).length_squared() <= radius * radius {
                        visit(block.index[lane]);
                    }
                }
                continue;
            }
            let touched = self.touched(node, near, wide * wide);
            for lane in (0..count as u32).rev().filter(|lane| touched >> lane & 1 != 0) {
                stack[top] = node.child(lane);
                top += 1;
            }
        }
    }

    /// The children of an inner node within a distance of a point, one bit for each.
    #[inline]
    fn touched(&self, node: NodeId, point: Vec3, distance2: f32) -> u32 {
        let boxes = self.boxes(node);
        let mut sum = [0.0f32; WIDTH];
        for axis in 0..3 {
            for lane in 0..WIDTH {
                let outside =
                    ((boxes.center[axis][lane] - point[axis]).abs() - boxes.half[axis][lane]).max(0.0);
                sum[lane] += outside * outside;
            }
        }
        (0..WIDTH).fold(0, |bits, lane| bits | u32::from(sum[lane] <= distance2) << lane)
    }
}
