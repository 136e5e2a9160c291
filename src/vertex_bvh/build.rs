//! Building: order the vertices, cut them into blocks of eight, box upwards.

use super::kd::{self, Placed};
use super::{Block, Boxes, MAX_LEVELS, MAX_VERTICES, VertexBvh, WIDTH};
use crate::math::Aabb;
use crate::{Error, Result};
use glam::Vec3;
use rayon::prelude::*;

/// Buffers that a build needs and the next one reuses.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    order: Vec<Placed>,
}

impl Scratch {
    pub(super) fn bytes(&self) -> usize {
        self.order.capacity() * size_of::<Placed>()
    }
}

/// Vertices that one task handles at a time.
const GRAIN: usize = 2048;

impl VertexBvh {
    /// Builds the tree over positions (relative to whatever origin keeps them precise), on the current rayon pool.
    ///
    /// The tree depends on the positions and their order only, never on the number of threads. Fails, leaving an
    /// empty tree, on a position that is not finite and on more than [`MAX_VERTICES`].
    pub fn build(&mut self, positions: &[Vec3]) -> Result<()> {
        self.build_masked(positions, None)
    }

    /// As [`VertexBvh::build`], with a mask for each vertex: queries pass over vertices whose mask shares no bit
    /// with their own.
    pub fn build_masked(&mut self, positions: &[Vec3], masks: Option<&[u32]>) -> Result<()> {
        // The whole build on a thread of the pool: handing it each step by itself would take longer than small trees do.
        rayon::scope(|_| self.build_here(positions, masks))
    }

    fn build_here(&mut self, positions: &[Vec3], masks: Option<&[u32]>) -> Result<()> {
        self.clear();
        if positions.len() > MAX_VERTICES {
            return Err(Error::Input(format!("{} light vertices: at most 2^31 fit a tree", positions.len())));
        }
        if let Some(masks) = masks.filter(|m| m.len() != positions.len()) {
            let (m, p) = (masks.len(), positions.len());
            return Err(Error::Input(format!("{m} masks were given for {p} light vertices")));
        }
        if let Some(i) = positions.par_iter().position_first(|p| !p.is_finite()) {
            return Err(Error::Input(format!(
                "light vertex {i}: its position {} is not finite",
                positions[i]
            )));
        }
        if positions.is_empty() {
            return Ok(());
        }
        self.bounds = Some(bounds(positions));
        self.len = positions.len();
        let order = &mut self.scratch.order;
        let place = |(index, &position): (usize, &Vec3)| Placed { position, index: index as u32 };
        order.clear();
        order.par_extend(positions.par_iter().enumerate().map(place));
        kd::order::<WIDTH, WIDTH>(order);
        self.fill_blocks(masks);
        self.fill_nodes();
        Ok(())
    }

    fn clear(&mut self) {
        self.len = 0;
        self.levels = 0;
        self.bounds = None;
        self.blocks.clear();
        self.nodes.clear();
        self.block_masks.clear();
        self.node_masks.clear();
    }

    fn fill_blocks(&mut self, masks: Option<&[u32]>) {
        let order = &self.scratch.order;
        self.blocks.resize(self.len.div_ceil(WIDTH), Block::EMPTY);
        self.blocks.par_iter_mut().with_min_len(GRAIN / WIDTH).zip(order.par_chunks(WIDTH)).for_each(
            |(block, order)| {
                *block = Block::EMPTY;
                for (lane, vertex) in order.iter().enumerate() {
                    for axis in 0..3 {
                        block.position[axis][lane] = vertex.position[axis];
                    }
                    block.index[lane] = vertex.index;
                }
            },
        );
        let Some(masks) = masks else { return };
        self.block_masks.resize(self.blocks.len(), [0; WIDTH]);
        self.block_masks.par_iter_mut().zip(order.par_chunks(WIDTH)).for_each(|(block, order)| {
            *block = [0; WIDTH];
            for (lane, vertex) in order.iter().enumerate() {
                block[lane] = masks[vertex.index as usize];
            }
        });
    }

    fn fill_nodes(&mut self) {
        self.level_len = [0; MAX_LEVELS + 1];
        self.level_start = [0; MAX_LEVELS + 1];
        self.level_len[0] = self.blocks.len();
        self.levels = 1;
        let mut total = 0;
        while self.level_len[self.levels - 1] > 1 {
            self.level_start[self.levels] = total;
            self.level_len[self.levels] = self.level_len[self.levels - 1].div_ceil(WIDTH);
            total += self.level_len[self.levels];
            self.levels += 1;
        }
        self.nodes.resize(total, Boxes::ZERO);
        if !self.block_masks.is_empty() {
            self.node_masks.resize(total, [0; WIDTH]);
        }
        for level in 1..self.levels {
            let (below, here) = self.nodes.split_at_mut(self.level_start[level]);
            let below = &below[if level > 1 { self.level_start[level - 1] } else { 0 }..];
            let here = &mut here[..self.level_len[level]];
            let (blocks, len, children) = (&self.blocks, self.len, self.level_len[level - 1]);
            here.par_iter_mut().with_min_len(GRAIN / WIDTH).enumerate().for_each(|(i, boxes)| {
                *boxes = Boxes::ZERO;
                for lane in 0..WIDTH.min(children - i * WIDTH) {
                    let child = i * WIDTH + lane;
                    let bounds = if level == 1 {
                        let count = WIDTH.min(len - child * WIDTH);
                        Aabb::around((0..count).map(|lane| blocks[child].point(lane)))
                    } else {
                        let count = WIDTH.min(self.level_len[level - 2] - child * WIDTH);
                        (0..count).fold(Aabb::EMPTY, |b, lane| b.union(below[child].get(lane)))
                    };
                    boxes.set(lane, bounds);
                }
            });
            if self.block_masks.is_empty() {
                continue;
            }
            let (below, here) = self.node_masks.split_at_mut(self.level_start[level]);
            let below = &below[if level > 1 { self.level_start[level - 1] } else { 0 }..];
            let source = if level == 1 { &self.block_masks[..] } else { below };
            for (i, masks) in here[..self.level_len[level]].iter_mut().enumerate() {
                *masks = [0; WIDTH];
                for (lane, child) in source[i * WIDTH..children.min((i + 1) * WIDTH)].iter().enumerate() {
                    masks[lane] = child.iter().fold(0, |a, b| a | b);
                }
            }
        }
    }
}

impl Boxes {
    /// Stores a box so that `center +- half`, computed in f64, contains it.
    fn set(&mut self, lane: usize, bounds: Aabb) {
        for axis in 0..3 {
            let (lo, hi) = (f64::from(bounds.min[axis]), f64::from(bounds.max[axis]));
            let center = (0.5 * (lo + hi)) as f32;
            let half = (hi - f64::from(center)).max(f64::from(center) - lo);
            let rounded = half as f32;
            self.center[axis][lane] = center;
            self.half[axis][lane] = if f64::from(rounded) < half { rounded.next_up() } else { rounded };
        }
    }

    /// A box in f32 that contains `center +- half`.
    fn get(&self, lane: usize) -> Aabb {
        let mut b = Aabb::EMPTY;
        for axis in 0..3 {
            let (c, h) = (f64::from(self.center[axis][lane]), f64::from(self.half[axis][lane]));
            let (lo, hi) = ((c - h) as f32, (c + h) as f32);
            b.min[axis] = if f64::from(lo) > c - h { lo.next_down() } else { lo };
            b.max[axis] = if f64::from(hi) < c + h { hi.next_up() } else { hi };
        }
        b
    }
}

fn bounds(positions: &[Vec3]) -> Aabb {
    positions
        .par_chunks(GRAIN)
        .map(|chunk| Aabb::around(chunk.iter().copied()))
        .reduce(|| Aabb::EMPTY, Aabb::union)
}

#[cfg(test)]
mod tests {
    use super::super::NodeId;
    use super::*;
    use crate::sampler::counter::{mix, unit};

    fn points(n: usize) -> Vec<Vec3> {
        let u = |i: usize, k: u64| unit(mix(mix(i as u64) ^ k)) as f32;
        (0..n).map(|i| Vec3::new(u(i, 1), u(i, 2) * 3.0, u(i, 3) * 1e-3)).collect()
    }

    /// Every box contains the vertices below it and every vertex is in the tree once.
    fn check(bvh: &VertexBvh, positions: &[Vec3]) {
        let mut seen = vec![false; positions.len()];
        let mut stack: Vec<_> = bvh.root().into_iter().collect();
        while let Some(node) = stack.pop() {
            if node.level == 0 {
                let block = &bvh.blocks()[node.index as usize];
                for lane in 0..bvh.children(node) {
                    let i = block.index[lane] as usize;
                    assert_eq!(block.point(lane), positions[i]);
                    assert!(!std::mem::replace(&mut seen[i], true));
                }
                continue;
            }
            for lane in 0..bvh.children(node) {
                let child = node.child(lane as u32);
                check_box(bvh, node, lane, child);
                stack.push(child);
            }
        }
        assert!(seen.iter().all(|&s| s));
    }

    fn check_box(bvh: &VertexBvh, node: NodeId, lane: usize, child: NodeId) {
        let boxes = bvh.boxes(node);
        let blocks = WIDTH.pow(child.level);
        let first = child.index as usize * blocks;
        for i in first * WIDTH..((first + blocks) * WIDTH).min(bvh.len()) {
            let p = bvh.blocks()[i / WIDTH].point(i % WIDTH);
            for axis in 0..3 {
                let off = (f64::from(p[axis]) - f64::from(boxes.center[axis][lane])).abs();
                assert!(off <= f64::from(boxes.half[axis][lane]));
            }
        }
    }

    #[test]
    fn boxes_contain_their_vertices() {
        let mut bvh = VertexBvh::new();
        for n in [1, 2, 7, 8, 9, 64, 65, 513, 5000, 3] {
            let positions = points(n);
            bvh.build(&positions).unwrap();
            check(&bvh, &positions);
        }
        bvh.build(&[]).unwrap();
        assert!(bvh.is_empty() && bvh.root().is_none() && bvh.bytes() == 0);
    }

    #[test]
    fn threads_do_not_change_the_tree() {
        let positions = points(30_000);
        let order = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut bvh = VertexBvh::new();
            pool.install(|| bvh.build(&positions)).unwrap();
            bvh.blocks().iter().flat_map(|b| b.index).collect::<Vec<_>>()
        };
        assert_eq!(order(1), order(3));
    }

    #[test]
    fn bad_input_is_named() {
        let mut bvh = VertexBvh::new();
        let e = bvh.build(&[Vec3::ZERO, Vec3::new(0.0, f32::NAN, 0.0)]).unwrap_err();
        assert!(e.to_string().contains("light vertex 1"), "{e}");
        assert!(bvh.is_empty());
        assert!(bvh.build_masked(&[Vec3::ZERO], Some(&[])).is_err());
    }

    #[test]
    fn masks_are_ored_upwards() {
        let positions = points(1000);
        let masks: Vec<u32> = (0..1000).map(|i| 1 << (i % 7)).collect();
        let mut bvh = VertexBvh::new();
        bvh.build_masked(&positions, Some(&masks)).unwrap();
        let root = bvh.root().unwrap();
        assert_eq!(bvh.masks(root).unwrap()[0], 0x7f);
        let block = NodeId { level: 0, index: 5 };
        for lane in 0..WIDTH {
            assert_eq!(bvh.masks(block).unwrap()[lane], masks[bvh.blocks()[5].index[lane] as usize]);
        }
    }
}
