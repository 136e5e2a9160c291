//! A tree of four boxes a node, and its traversal. Tuned to nothing: no distance in it is absolute, zero directions and
//! flat boxes are fine, and rounding makes boxes larger, never smaller.

use super::Ray;
use glam::{Vec3, Vec4};
use obvhs::bvh2::Bvh2;
use smallvec::SmallVec;

/// Four boxes and what is in them.
#[derive(Debug, Clone, Copy)]
struct Node {
    /// Lower and upper bounds: axis, side, box.
    bounds: [[Vec4; 2]; 3],
    /// Node number, or the first primitive of a leaf.
    first: [u32; 4],
    /// Primitives of a leaf; 0 for a node.
    count: [u32; 4],
}

/// A tree over primitives numbered in the order of its leaves.
#[derive(Debug)]
pub(super) struct Bvh4 {
    /// The root is the first; empty for no primitives.
    nodes: Vec<Node>,
}

/// Covers three rounded operations on each of the near and the far side [Ize 2013, "Robust BVH Ray Traversal"].
const ROUNDING: f32 = 1.0 + 4.0 * f32::EPSILON;

impl Bvh4 {
    /// Takes every other level out of a binary tree.
    pub(super) fn new(tree: &Bvh2) -> Self {
        let mut nodes = Vec::new();
        if !tree.nodes.is_empty() {
            // Pairs of a binary node to split up and the place that waits for its number.
            let mut todo: Vec<(usize, Option<(usize, usize)>)> = vec![(0, None)];
            while let Some((root, parent)) = todo.pop() {
                let number = nodes.len();
                if let Some((node, slot)) = parent {
                    let node: &mut Node = &mut nodes[node];
                    node.first[slot] = number as u32;
                }
                let children = split(tree, root);
                nodes.push(Self::node(tree, &children));
                let inner = children.iter().enumerate().filter(|&(_, &child)| !tree.nodes[child].is_leaf());
                todo.extend(inner.map(|(slot, &child)| (child, Some((number, slot)))));
            }
        }
        Self { nodes }
    }

    fn node(tree: &Bvh2, children: &[usize]) -> Node {
        // A box that nothing hits: its near side is never before its far side.
        let mut node =
            Node { bounds: [[Vec4::INFINITY, Vec4::NEG_INFINITY]; 3], first: [0; 4], count: [0; 4] };
        for (slot, &child) in children.iter().enumerate() {
            let child = &tree.nodes[child];
            for axis in 0..3 {
                node.bounds[axis][0][slot] = child.aabb.min[axis];
                node.bounds[axis][1][slot] = child.aabb.max[axis];
            }
            if child.is_leaf() {
                node.first[slot] = child.first_index;
                node.count[slot] = child.prim_count;
            }
        }
        node
    }

    /// Bytes of all nodes.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..])
    }

    /// Visits the leaves that a ray may reach, near ones first. `test` looks at primitives `first..first + count` and
    /// returns the distance beyond which nothing matters any more; one below `ray.t_min` ends the search.
    #[inline]
    pub(super) fn traverse(&self, ray: &Ray, mut test: impl FnMut(u32, u32) -> f32) {
        if self.nodes.is_empty() {
            return;
        }
        let direction = ray.direction.to_array();
        // A finite inverse: 0 * inf would be NaN for an origin in the plane of a box's side.
        let inverse = direction.map(|d| if d.abs() < 1e-37 { 1e37f32.copysign(d) } else { 1.0 / d });
        let side = direction.map(|d| usize::from(d.is_sign_negative()));
        let [ox, oy, oz] = ray.origin.to_array().map(Vec4::splat);
        let [ix, iy, iz] = inverse.map(Vec4::splat);
        let mut t_max = ray.t_max;
        let mut stack: SmallVec<[(u32, f32); 64]> = SmallVec::new();
        let mut current = 0;
        loop {
            let node = &self.nodes[current as usize];
            let [x, y, z] = &node.bounds;
            let near = ((x[side[0]] - ox) * ix).max((y[side[1]] - oy) * iy).max((z[side[2]] - oz) * iz);
            let far =
                ((x[1 - side[0]] - ox) * ix).min((y[1 - side[1]] - oy) * iy).min((z[1 - side[2]] - oz) * iz);
            let near = near.max(Vec4::splat(ray.t_min));
            let far = far.min(Vec4::splat(t_max)) * ROUNDING;
            let mut reached = near.cmple(far).bitmask();
            let near = near.to_array();
            let base = stack.len();
            while reached != 0 {
                let slot = reached.trailing_zeros() as usize;
                reached &= reached - 1;
                // Ordered by distance, the nearest on top.
                let entry = ((current << 2) | slot as u32, near[slot]);
                let mut place = stack.len();
                stack.push(entry);
                while place > base && stack[place - 1].1 < entry.1 {
                    stack[place] = stack[place - 1];
                    place -= 1;
                }
                stack[place] = entry;
            }
            current = loop {
                let Some((reference, near)) = stack.pop() else { return };
                if near > t_max * ROUNDING {
                    continue;
                }
                let (node, slot) = (&self.nodes[(reference >> 2) as usize], (reference & 3) as usize);
                if node.count[slot] == 0 {
                    break node.first[slot];
                }
                t_max = test(node.first[slot], node.count[slot]);
                if t_max < ray.t_min {
                    return;
                }
            };
        }
    }
}

/// Up to four descendants that together hold what a node holds: the largest inner ones are opened first.
fn split(tree: &Bvh2, root: usize) -> SmallVec<[usize; 4]> {
    let mut children: SmallVec<[usize; 4]> = SmallVec::from_slice(&[root]);
    while children.len() < 4 {
        let size = |&i: &usize| {
            let extent = Vec3::from(tree.nodes[i].aabb.max - tree.nodes[i].aabb.min);
            extent.x * extent.y + extent.y * extent.z + extent.z * extent.x
        };
        let inner = children.iter().enumerate().filter(|&(_, &i)| !tree.nodes[i].is_leaf());
        let Some((slot, _)) = inner.max_by(|a, b| size(a.1).total_cmp(&size(b.1))) else { break };
        let first = tree.nodes[children[slot]].first_index as usize;
        children[slot] = first;
        children.push(first + 1);
    }
    children
}
