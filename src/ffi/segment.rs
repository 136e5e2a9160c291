//! The host's light vertices: read where they lie, checked, gathered.

use super::memory::Held;
use super::pointer::Strided;
use super::points::Points;
use super::progress::Progress;
use super::status::{Failure, HRR_ERROR_OUT_OF_MEMORY, Outcome};
use crate::vertex_bvh::MAX_VERTICES;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::ffi::c_void;

/// Positions are three floats.
pub const HRR_FLOAT3: u32 = 0;
/// Positions are three doubles. They are stored as floats relative to the centre of their bounding box.
pub const HRR_DOUBLE3: u32 = 1;

/// Light vertices in a host's memory, such as one thread's or one light path's. Nothing needs to be aligned; nothing
/// is read behind the last element; nothing is referred to after the build.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct HrrSegment {
    /// The first position: three floats or three doubles, in the host's unit of length.
    pub position: *const c_void,
    /// Bytes from one position to the next; 0 = packed.
    pub position_stride: usize,
    /// The first vertex' mask (light groups, path depth, medium, ...); NULL = all bits set. A query passes over
    /// vertices whose mask shares no bit with its own.
    pub mask: *const u32,
    /// Bytes from one mask to the next; 0 = packed.
    pub mask_stride: usize,
    /// The first vertex' id, which hits report; NULL = first_id + i for vertex i.
    pub id: *const u64,
    /// Bytes from one id to the next; 0 = packed.
    pub id_stride: usize,
    /// Number of vertices; 0 is fine.
    pub count: u64,
    /// Id of the first vertex where id is NULL.
    pub first_id: u64,
}

/// Vertices on their way into a tree.
#[derive(Debug, Default)]
pub(super) struct Gathered {
    pub positions: Vec<Vec3>,
    /// Empty when no segment has masks.
    pub masks: Vec<u32>,
    pub ids: Vec<u64>,
    /// What was subtracted from the positions before they were rounded.
    pub origin: DVec3,
    pub dropped: u64,
    pub held: Option<Held>,
}

/// Vertices after which the host is asked whether to go on.
const LOOK: usize = 1 << 16;

/// How much of a build gathering is.
const GATHERING: f64 = 0.25;

/// How to gather.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rules {
    pub double: bool,
    /// Pass over vertices that are not finite.
    pub drop: bool,
    pub sort: bool,
}

/// Doubles up to here can be told from each other's distance in single precision without overflow.
pub(super) const MAX_DOUBLE: f64 = 1e38;

/// A segment whose numbers make sense.
struct Checked {
    positions: Points,
    masks: Option<Strided<u32>>,
    ids: Option<Strided<u64>>,
    count: usize,
    first_id: u64,
}

impl Checked {
    unsafe fn new(segment: &HrrSegment, number: usize, double: bool) -> Outcome<Self> {
        let name = |field: &str| format!("segments[{number}].{field}");
        let count = usize::try_from(segment.count).ok().filter(|&n| n <= MAX_VERTICES);
        let Some(count) = count else {
            let message = format!("{} is {}: at most 2^31", name("count"), segment.count);
            return Err(Failure::argument(message));
        };
        let format = if double { HRR_DOUBLE3 } else { HRR_FLOAT3 };
        let (at, stride) = (segment.position, segment.position_stride);
        // SAFETY: the caller passes on its own caller's word for the arrays.
        unsafe {
            let positions = Points::new(at, stride, count, format, &name("position"))?;
            let masks = (!segment.mask.is_null())
                .then(|| Strided::new(segment.mask, segment.mask_stride, count, &name("mask")))
                .transpose()?;
            let ids = (!segment.id.is_null())
                .then(|| Strided::new(segment.id, segment.id_stride, count, &name("id")))
                .transpose()?;
            Ok(Self { positions, masks, ids, count, first_id: segment.first_id })
        }
    }

    /// A position, when it is of any use.
    fn position(&self, index: usize) -> Result<DVec3, DVec3> {
        debug_assert!(index < self.count);
        // SAFETY: below the count that the array was given with.
        unsafe { self.positions.get(index) }
    }
}

impl Gathered {
    /// Reads all segments.
    pub unsafe fn fill(
        &mut self,
        segments: Strided<HrrSegment>,
        count: usize,
        rules: Rules,
        progress: Progress,
    ) -> Outcome {
        let mut total = 0u64;
        // SAFETY: `segments` has `count` of them; the caller passes on its own caller's word for their arrays.
        let checked = |i: usize| unsafe { Checked::new(&segments.get(i), i, rules.double) };
        let mut masked = false;
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for number in 0..count {
            let segment = checked(number)?;
            total += segment.count as u64;
            masked |= segment.masks.is_some();
            for i in 0..segment.count {
                if i % LOOK == 0 {
                    progress.at(0.0)?;
                }
                match segment.position(i) {
                    Ok(p) => (low, high) = (low.min(p), high.max(p)),
                    Err(_) if rules.drop => self.dropped += 1,
                    Err(p) => {
                        let message = format!("segments[{number}].position {i} is {p}");
                        return Err(Failure::non_finite(message));
                    }
                }
            }
        }
        let kept = total - self.dropped;
        if kept > MAX_VERTICES as u64 {
            return Err(Failure::argument(format!("{kept} light vertices: at most 2^31 fit a cache")));
        }
        if rules.double && kept > 0 {
            self.origin = 0.5 * low + 0.5 * high;
        }
        self.reserve(kept as usize, masked)?;
        for number in 0..count {
            let segment = checked(number)?;
            for i in 0..segment.count {
                if i % LOOK == 0 {
                    progress.at(GATHERING * self.ids.len() as f64 / kept.max(1) as f64)?;
                }
                let Ok(p) = segment.position(i) else { continue };
                self.positions.push((p - self.origin).as_vec3());
                // SAFETY: i is below the count that the arrays were given with.
                let (mask, id) =
                    unsafe { (segment.masks.map(|m| m.get(i)), segment.ids.map(|ids| ids.get(i))) };
                self.ids.push(id.unwrap_or(segment.first_id.wrapping_add(i as u64)));
                if masked {
                    self.masks.push(mask.unwrap_or(u32::MAX));
                }
            }
        }
        if rules.sort {
            self.sort_by_id();
        }
        Ok(())
    }

    pub fn clear(&mut self) {
        self.positions.clear();
        self.masks.clear();
        self.ids.clear();
        self.origin = DVec3::ZERO;
        self.dropped = 0;
    }

    pub fn bytes(&self) -> u64 {
        (size_of_val(&self.positions[..]) + size_of_val(&self.masks[..]) + 8 * self.ids.capacity()) as u64
    }

    pub fn reserve(&mut self, count: usize, masked: bool) -> Outcome {
        let masks = if masked { count } else { 0 };
        self.positions
            .try_reserve(count)
            .and_then(|()| self.ids.try_reserve(count))
            .and_then(|()| self.masks.try_reserve(masks))
            .map_err(|e| Failure::new(HRR_ERROR_OUT_OF_MEMORY, format!("{count} light vertices: {e}")))
    }

    /// Puts the vertices in an order that does not depend on how the host's threads found them.
    fn sort_by_id(&mut self) {
        let mut order: Vec<(u64, u32)> = self.ids.iter().copied().zip(0..).collect();
        order.par_sort_unstable();
        self.positions = order.iter().map(|&(_, i)| self.positions[i as usize]).collect();
        if !self.masks.is_empty() {
            self.masks = order.iter().map(|&(_, i)| self.masks[i as usize]).collect();
        }
        self.ids = order.into_iter().map(|(id, _)| id).collect();
    }
}
