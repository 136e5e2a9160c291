//! The light-vertex cache: every vertex of an iteration's light subpaths, stored compactly.

use crate::geometry::SurfacePoint;
use crate::math::Spectrum;
use crate::mis::Side;
use crate::subpath::{Origin, Vertex, Walk, World};
use glam::Vec3;
use std::ops::Range;

/// What is kept of a light vertex beside its position, in a line of the cache. The scattering model is made again from the
/// triangle.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
struct Record {
    triangle: u32,
    barycentric: [f32; 2],
    wo: Vec3,
    distance: f32,
    throughput: Vec3,
    came: Came,
    side: Side,
}

/// How the subpath came to the vertex: what of a [`Walk`] is not the same for all first vertices, or for all others.
#[derive(Debug, Clone, Copy)]
enum Came {
    FromLight { from_afar: bool, preference: f32 },
    FromSurface { depth: u32, after_delta: bool, origins: [Origin; 2] },
}

const _: () = assert!(size_of::<Record>() == 64);

/// Light vertices in the order of their subpaths. Buffers are kept between iterations.
#[derive(Debug)]
pub struct LightCache {
    positions: Vec<Vec3>,
    records: Vec<Record>,
    /// First vertex of each subpath, and the end.
    starts: Vec<u32>,
}

impl Default for LightCache {
    fn default() -> Self {
        Self { positions: Vec::new(), records: Vec::new(), starts: vec![0] }
    }
}

impl LightCache {
    /// Forgets all vertices, keeping the memory.
    pub fn clear(&mut self) {
        self.positions.clear();
        self.records.clear();
        self.starts.clear();
        self.starts.push(0);
    }

    /// Stores a vertex of the subpath that is being traced.
    pub fn push(&mut self, light: &Walk) {
        let point = &light.vertex.point;
        self.positions.push(point.position.as_vec3());
        self.records.push(Record {
            triangle: point.triangle,
            barycentric: point.barycentric.as_vec2().to_array(),
            wo: light.vertex.wo.as_vec3(),
            distance: light.distance as f32,
            throughput: light.throughput.as_vec3(),
            came: match *light {
                Walk { depth: 1, from_afar, preference, .. } => {
                    Came::FromLight { from_afar, preference: preference as f32 }
                }
                Walk { depth, after_delta, origins, .. } => Came::FromSurface { depth, after_delta, origins },
            },
            side: light.side,
        });
    }

    /// Ends the subpath that is being traced.
    pub fn end_subpath(&mut self) {
        self.starts.push(self.positions.len() as u32);
    }

    /// Appends another cache's subpaths.
    pub fn append(&mut self, other: &Self) {
        let offset = self.positions.len() as u32;
        self.positions.extend_from_slice(&other.positions);
        self.records.extend_from_slice(&other.records);
        self.starts.extend(other.starts[1..].iter().map(|s| s + offset));
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// True when there is no vertex.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Positions relative to the mesh's origin, in the precision that the roulette judges them by.
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// The vertices of a subpath.
    pub fn subpath(&self, index: usize) -> Range<usize> {
        self.starts[index] as usize..self.starts[index + 1] as usize
    }

    /// The subpath that a vertex belongs to.
    pub fn subpath_of(&self, vertex: usize) -> usize {
        self.starts.partition_point(|&start| start as usize <= vertex) - 1
    }

    /// Number of subpaths.
    pub fn subpaths(&self) -> u64 {
        self.starts.len() as u64 - 1
    }

    /// Number of vertices in the first `subpaths` subpaths.
    pub fn end_of(&self, subpaths: u64) -> usize {
        let last = (self.starts.len() - 1).min(usize::try_from(subpaths).unwrap_or(usize::MAX));
        self.starts[last] as usize
    }

    /// Segments between a vertex and its light.
    pub fn depth(&self, index: usize) -> u32 {
        match self.records[index].came {
            Came::FromLight { .. } => 1,
            Came::FromSurface { depth, .. } => depth,
        }
    }

    /// A vertex, ready to be connected to. Its position is the stored one, to the bit.
    pub fn load(&self, world: &World<'_>, index: usize) -> Walk {
        let r = &self.records[index];
        let [u, v] = r.barycentric.map(f64::from);
        let mut point = SurfacePoint::at_barycentric(&world.scene.mesh, r.triangle, u, v);
        point.position = self.positions[index].as_dvec3();
        let walk = Walk {
            vertex: Vertex::new(world, point, r.wo.as_dvec3().normalize()),
            throughput: Spectrum::from(r.throughput),
            side: r.side,
            b_as_lamp: r.side.b,
            distance: f64::from(r.distance),
            depth: 1,
            after_delta: false,
            from_afar: false,
            preference: 1.0,
            origins: [Origin::Lamp; 2],
        };
        match r.came {
            Came::FromLight { from_afar, preference } => {
                Walk { from_afar, preference: preference.into(), ..walk }
            }
            Came::FromSurface { depth, after_delta, origins } => Walk { depth, after_delta, origins, ..walk },
        }
    }

    /// Bytes of all buffers.
    pub fn bytes(&self) -> usize {
        self.positions.capacity() * size_of::<Vec3>()
            + self.records.capacity() * size_of::<Record>()
            + self.starts.capacity() * size_of::<u32>()
    }
}
