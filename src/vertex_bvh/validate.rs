//! Checks a tree against what queries count on.

use super::{Aabb, NodeId, VertexBvh, WIDTH};
use crate::{Error, Result};
use glam::Vec3;

/// What a subtree must be covered by: its vertices' box and the union of their masks.
struct Below {
    bounds: Aabb,
    mask: u32,
}

impl VertexBvh {
    /// Checks that every vertex is there once, every box holds what is below it and every mask is the union of those
    /// below.
    ///
    /// # Errors
    /// [`Error::Internal`] with the node: a bug, or memory that something else has written to.
    pub fn validate(&self) -> Result<()> {
        let mut seen = vec![false; self.len];
        let Some(root) = self.root() else { return Ok(()) };
        if self.blocks.len() != self.len.div_ceil(WIDTH) {
            return Err(wrong(root, "the number of blocks"));
        }
        self.below(root, &mut seen).map(|_| ())
    }

    fn below(&self, node: NodeId, seen: &mut [bool]) -> Result<Below> {
        let mut all = Below { bounds: Aabb::EMPTY, mask: 0 };
        for lane in 0..self.children(node) {
            let own_mask = self.masks(node).map(|masks| masks[lane]);
            let bounds = if node.level == 0 {
                let block = &self.blocks[node.index as usize];
                match seen.get_mut(block.index[lane] as usize) {
                    Some(seen) if !*seen => *seen = true,
                    _ => return Err(wrong(node, &format!("light vertex {}", block.index[lane]))),
                }
                if !block.point(lane).is_finite() {
                    return Err(wrong(node, &format!("the position {}", block.point(lane))));
                }
                Aabb::around([block.point(lane)])
            } else {
                let child = self.below(node.child(lane as u32), seen)?;
                if own_mask.is_some_and(|mask| mask != child.mask) {
                    return Err(wrong(node, &format!("the mask of child {lane}")));
                }
                let boxes = self.boxes(node);
                let column =
                    |of: &[[f32; WIDTH]; 3]| Vec3::new(of[0][lane], of[1][lane], of[2][lane]).as_dvec3();
                let (center, half) = (column(&boxes.center), column(&boxes.half));
                for corner in [child.bounds.min, child.bounds.max] {
                    // Also for a NaN.
                    if !(corner.as_dvec3() - center).abs().cmple(half).all() {
                        return Err(wrong(node, &format!("the box of child {lane}")));
                    }
                }
                child.bounds
            };
            all.bounds = all.bounds.union(bounds);
            all.mask |= own_mask.unwrap_or(u32::MAX);
        }
        Ok(all)
    }
}

fn wrong(node: NodeId, what: &str) -> Error {
    Error::Internal(format!("node {} of level {} is wrong: {what}", node.index, node.level))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wrong_is_found() {
        let points: Vec<Vec3> =
            (0..700).map(|i| Vec3::new((i % 7) as f32, (i % 11) as f32, i as f32)).collect();
        let masks: Vec<u32> = (0..700).map(|i| 1 << (i % 5)).collect();
        let mut bvh = VertexBvh::new();
        bvh.validate().unwrap();
        bvh.build_masked(&points, Some(&masks)).unwrap();
        bvh.validate().unwrap();
        let spoilt = |spoil: fn(&mut VertexBvh)| {
            let mut bvh = VertexBvh::new();
            bvh.build_masked(&points, Some(&masks)).unwrap();
            spoil(&mut bvh);
            bvh.validate().unwrap_err().to_string()
        };
        assert!(spoilt(|b| b.blocks[3].index[1] = 5000).contains("light vertex 5000"));
        assert!(spoilt(|b| b.blocks[3].index[1] = b.blocks[2].index[0]).contains("light vertex"));
        assert!(spoilt(|b| b.blocks[3].position[0][1] = f32::NAN).contains("position"));
        assert!(spoilt(|b| b.blocks[3].position[0][1] = 1e6).contains("box"));
        assert!(spoilt(|b| b.nodes[0].half[2][0] = 0.0).contains("box"));
        assert!(spoilt(|b| b.nodes[0].half[2][0] = f32::NAN).contains("box"));
        assert!(spoilt(|b| b.block_masks[3][1] = 1 << 30).contains("mask"));
    }
}
