//! A perfect tree of `W` children a node over blocks of `B` vertices: what `hrr::vertex_bvh` is for 8 and 8.

use glam::Vec3;
use hrr::math::Aabb;
use hrr::vertex_bvh::{Placed, order};
use rayon::prelude::*;

/// `N` vertices, component by component.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
pub struct Block<const N: usize> {
    pub position: [[f32; N]; 3],
    pub index: [u32; N],
}

/// The boxes of `N` children, component by component.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
pub struct Boxes<const N: usize> {
    pub center: [[f32; N]; 3],
    pub half: [[f32; N]; 3],
}

#[derive(Default)]
pub struct Tree<const W: usize, const B: usize> {
    pub len: usize,
    pub blocks: Vec<Block<B>>,
    /// Level 1 first.
    nodes: Vec<Boxes<W>>,
    /// Where each level begins in `nodes`; entry 0, of the blocks, is unused.
    start: Vec<usize>,
    /// Nodes of each level.
    level_len: Vec<usize>,
    order: Vec<Placed>,
    /// Of the level below the one that is being made.
    bounds: Vec<Aabb>,
}

/// Vertices that one task handles at least.
const GRAIN: usize = 2048;

impl<const W: usize, const B: usize> Tree<W, B> {
    pub fn build(&mut self, points: &[Vec3]) {
        rayon::scope(|_| self.build_here(points));
    }

    fn build_here(&mut self, points: &[Vec3]) {
        self.len = points.len();
        self.order.clear();
        let place = |(index, &position): (usize, &Vec3)| Placed { position, index: index as u32 };
        self.order.par_extend(points.par_iter().enumerate().map(place));
        order::<W, B>(&mut self.order);
        let none = Block { position: [[f32::INFINITY; B]; 3], index: [u32::MAX; B] };
        self.blocks.resize(self.len.div_ceil(B), none);
        self.bounds.resize(self.blocks.len(), Aabb::EMPTY);
        self.blocks
            .par_iter_mut()
            .zip(&mut self.bounds)
            .with_min_len(GRAIN / B)
            .zip(self.order.par_chunks(B))
            .for_each(|((block, bounds), order)| {
                *block = none;
                for (lane, vertex) in order.iter().enumerate() {
                    for axis in 0..3 {
                        block.position[axis][lane] = vertex.position[axis];
                    }
                    block.index[lane] = vertex.index;
                }
                *bounds = Aabb::around(order.iter().map(|vertex| vertex.position));
            });
        self.nodes.clear();
        (self.start, self.level_len) = (vec![0], vec![self.blocks.len()]);
        while self.bounds.len() > 1 {
            self.start.push(self.nodes.len());
            self.level_len.push(self.bounds.len().div_ceil(W));
            self.nodes.par_extend(self.bounds.par_chunks(W).with_min_len(GRAIN / W).map(boxes::<W>));
            let around = |below: &[Aabb]| below.iter().copied().fold(Aabb::EMPTY, Aabb::union);
            self.bounds = self.bounds.par_chunks(W).with_min_len(GRAIN / W).map(around).collect();
        }
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&self.blocks[..]) + size_of_val(&self.nodes[..])
    }

    /// The root's level.
    pub fn root(&self) -> usize {
        self.level_len.len() - 1
    }

    #[inline(always)]
    pub fn boxes(&self, level: usize, index: u32) -> &Boxes<W> {
        &self.nodes[self.start[level] + index as usize]
    }

    /// Children of a node, or vertices of a block.
    #[inline(always)]
    pub fn children(&self, level: usize, index: u32) -> usize {
        let (below, most) = if level == 0 { (self.len, B) } else { (self.level_len[level - 1], W) };
        (below - index as usize * most).min(most)
    }

    /// Reads a number of each cache line: `VertexBvh::touch`.
    #[inline(always)]
    pub fn touch(&self, level: usize, index: u32) -> f32 {
        if level == 0 {
            let [x, y, z] = &self.blocks[index as usize].position;
            [x, y, z].iter().map(|p| p.iter().step_by(16).sum::<f32>()).sum()
        } else {
            let boxes = self.boxes(level, index);
            [&boxes.center, &boxes.half]
                .iter()
                .flat_map(|v| v.iter())
                .map(|v| v.iter().step_by(16).sum::<f32>())
                .sum()
        }
    }

    /// Vertices there is room for below a node.
    #[inline(always)]
    pub fn capacity(level: usize) -> u64 {
        1 << (B.ilog2() + W.ilog2() * level as u32)
    }
}

/// Boxes so that `center +- half` contains them, as `hrr::vertex_bvh` makes them.
fn boxes<const N: usize>(bounds: &[Aabb]) -> Boxes<N> {
    let mut boxes = Boxes { center: [[0.0; N]; 3], half: [[0.0; N]; 3] };
    for (lane, b) in bounds.iter().enumerate() {
        for axis in 0..3 {
            let (lo, hi) = (f64::from(b.min[axis]), f64::from(b.max[axis]));
            let center = (0.5 * (lo + hi)) as f32;
            let half = (hi - f64::from(center)).max(f64::from(center) - lo);
            let rounded = half as f32;
            boxes.center[axis][lane] = center;
            boxes.half[axis][lane] = if f64::from(rounded) < half { rounded.next_up() } else { rounded };
        }
    }
    boxes
}
