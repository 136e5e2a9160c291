//! A bounding volume hierarchy over light vertices that knows points and leaf ranges only; nothing random is stored.
//!
//! The tree is *perfect*: an inner node has eight children, a node of level `l` has room for `8^(l+1)` vertices, and
//! all nodes but those on the right edge are full. Children are found by arithmetic, leaf counts are powers of
//! eight, and the minimum random numbers of the roulette (docs/theory.md section 2) need no division. Level 0 is the
//! [`Block`]s of eight vertices. A tree over n vertices takes 16 n bytes for positions and indices and 3.4 n for
//! boxes.

mod ball;
mod build;
mod kd;
mod validate;

/// The order of the vertices, for trees of other widths to be measured with (`benches/support/widths`).
#[doc(hidden)]
pub use kd::{Placed, order};

use crate::math::Aabb;
use glam::Vec3;

/// Children of a node, vertices of a block.
pub const WIDTH: usize = 8;

/// Most light vertices in one tree.
pub const MAX_VERTICES: usize = 1 << 31;

/// Levels of the largest tree: `8^(MAX_LEVELS)` >= [`MAX_VERTICES`].
pub const MAX_LEVELS: usize = 11;

/// Eight vertices, component by component. Unused places hold +infinity and `u32::MAX`.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub struct Block {
    /// x, y, z as given to [`VertexBvh::build`], to the last bit.
    pub position: [[f32; WIDTH]; 3],
    /// Indices into the positions given to [`VertexBvh::build`].
    pub index: [u32; WIDTH],
}

/// The boxes of eight children, component by component: each child lies within `center +- half`, rounding included.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub struct Boxes {
    /// Centres: x, y, z.
    pub center: [[f32; WIDTH]; 3],
    /// Half extents: x, y, z; at least 0.
    pub half: [[f32; WIDTH]; 3],
}

/// A node: its level (0 = block) and its number within the level.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct NodeId {
    /// 0 = [`Block`].
    pub level: u32,
    /// From 0, in tree order.
    pub index: u32,
}

impl NodeId {
    /// Level and index in 32 bits: [`MAX_VERTICES`] make 2^28 blocks.
    #[inline(always)]
    pub fn pack(self) -> u32 {
        self.level << 28 | self.index
    }

    /// The node of [`NodeId::pack`].
    #[inline(always)]
    pub fn unpack(packed: u32) -> Self {
        Self { level: packed >> 28, index: packed & ((1 << 28) - 1) }
    }

    /// The child in place `lane` (0..8) of an inner node.
    #[inline(always)]
    pub fn child(self, lane: u32) -> Self {
        Self { level: self.level - 1, index: self.index * WIDTH as u32 + lane }
    }
}

/// The tree. Its buffers are kept from build to build.
#[derive(Debug, Default)]
pub struct VertexBvh {
    len: usize,
    bounds: Option<Aabb>,
    blocks: Vec<Block>,
    /// Masks of the vertices, block by block; empty when every mask is all ones.
    block_masks: Vec<[u32; WIDTH]>,
    /// Boxes of the inner nodes' children, level 1 first.
    nodes: Vec<Boxes>,
    /// Masks of the inner nodes' children (OR of all below); empty as `block_masks`.
    node_masks: Vec<[u32; WIDTH]>,
    /// Where each level begins in `nodes`; entry 0 (blocks) is unused.
    level_start: [usize; MAX_LEVELS + 1],
    /// Nodes of each level.
    level_len: [usize; MAX_LEVELS + 1],
    levels: usize,
    scratch: build::Scratch,
}

impl VertexBvh {
    /// A tree over nothing.
    pub fn new() -> Self {
        Self::default()
    }

    /// Number of light vertices.
    pub fn len(&self) -> usize {
        self.len
    }

    /// True when there is no vertex.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The box around all vertices; `None` when there are none.
    pub fn bounds(&self) -> Option<Aabb> {
        self.bounds
    }

    /// Bytes that queries read: positions, indices, boxes, masks. Build buffers are not counted.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.blocks[..])
            + size_of_val(&self.nodes[..])
            + size_of_val(&self.block_masks[..])
            + size_of_val(&self.node_masks[..])
    }

    /// Bytes of the buffer that builds use and keep for the next one.
    pub fn build_bytes(&self) -> usize {
        self.scratch.bytes()
    }

    /// Positions, indices and boxes are laid out; the root is the only node of the highest level. `None` when empty.
    pub fn root(&self) -> Option<NodeId> {
        (self.levels > 0).then(|| NodeId { level: self.levels as u32 - 1, index: 0 })
    }

    /// The blocks of level 0 in tree order.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// The boxes of an inner node's children.
    #[inline(always)]
    pub fn boxes(&self, node: NodeId) -> &Boxes {
        &self.nodes[self.level_start[node.level as usize] + node.index as usize]
    }

    /// Reads a number from each cache line of a node and returns some sum of them. Done for several nodes before any of
    /// them is looked into, what is not in the cache arrives all at once: a seventh off a query over 1e7 vertices.
    #[inline(always)]
    pub(crate) fn touch(&self, node: NodeId) -> f32 {
        if node.level == 0 {
            let block = &self.blocks[node.index as usize];
            block.position[0][0] + block.position[2][0]
        } else {
            let boxes = self.boxes(node);
            boxes.center[0][0] + boxes.center[2][0] + boxes.half[1][0]
        }
    }

    /// How many children of an inner node exist, or vertices of a block: they are the first lanes. 1..=8.
    #[inline(always)]
    pub fn children(&self, node: NodeId) -> usize {
        let first = node.index as usize * WIDTH;
        let below = if node.level == 0 { self.len } else { self.level_len[node.level as usize - 1] };
        (below - first).min(WIDTH)
    }

    /// Masks of an inner node's children or of a block's vertices; `None` when all are all ones.
    #[inline(always)]
    pub fn masks(&self, node: NodeId) -> Option<&[u32; WIDTH]> {
        if node.level == 0 {
            self.block_masks.get(node.index as usize)
        } else {
            self.node_masks.get(self.level_start[node.level as usize] + node.index as usize)
        }
    }

    /// Vertices there is room for below a node: `8^(level + 1)`, exact.
    #[inline(always)]
    pub fn capacity(level: u32) -> f64 {
        (1u64 << (3 * (level + 1))) as f64
    }
}

impl Block {
    /// A block of unused places.
    pub const EMPTY: Self = Self { position: [[f32::INFINITY; WIDTH]; 3], index: [u32::MAX; WIDTH] };

    /// The position in a lane.
    #[inline(always)]
    pub fn point(&self, lane: usize) -> Vec3 {
        Vec3::new(self.position[0][lane], self.position[1][lane], self.position[2][lane])
    }
}

impl Boxes {
    /// Boxes at the origin without extent.
    pub const ZERO: Self = Self { center: [[0.0; WIDTH]; 3], half: [[0.0; WIDTH]; 3] };
}
