//! A cache's light vertices as bytes: for files that caches are saved to, and for captures.

use super::cache::{HrrCache, Source};
use super::context::HrrContext;
use super::progress::Progress;
use super::segment::Gathered;
use super::status::{Failure, HRR_ERROR_IO, Outcome};
use crate::vertex_bvh::{NodeId, VertexBvh};
use glam::{DVec3, Vec3};

/// What such bytes begin with. The tree is not among them: it is built again, and is the same.
const MAGIC: &[u8; 8] = b"HRRCACH1";

/// The bytes of a cache, little-endian throughout.
pub(super) fn write(cache: &HrrCache) -> Vec<u8> {
    let bvh = &cache.storage.bvh;
    let mut bytes = Vec::with_capacity(72 + bvh.len() * 24);
    bytes.extend(MAGIC);
    bytes.extend((bvh.len() as u64).to_le_bytes());
    bytes.extend(u64::from(cache.masked()).to_le_bytes());
    bytes.extend(cache.dropped().to_le_bytes());
    bytes.extend(cache.storage.origin.to_array().iter().flat_map(|x| x.to_bits().to_le_bytes()));
    bytes.extend(cache.fingerprint().to_le_bytes());
    let (positions, masks) = in_order(bvh);
    bytes.extend(positions.iter().flat_map(|p| p.to_array()).flat_map(|x| x.to_bits().to_le_bytes()));
    bytes.extend((0..bvh.len() as u32).flat_map(|index| cache.storage.id(index).to_le_bytes()));
    if cache.masked() {
        bytes.extend(masks.iter().flat_map(|mask| mask.to_le_bytes()));
    }
    bytes
}

/// Positions and masks as they were given to the build.
fn in_order(bvh: &VertexBvh) -> (Vec<Vec3>, Vec<u32>) {
    let (mut positions, mut masks) = (vec![Vec3::ZERO; bvh.len()], vec![u32::MAX; bvh.len()]);
    for (number, block) in bvh.blocks().iter().enumerate() {
        let node = NodeId { level: 0, index: number as u32 };
        for lane in 0..bvh.children(node) {
            let index = block.index[lane] as usize;
            positions[index] = block.point(lane);
            if let Some(own) = bvh.masks(node) {
                masks[index] = own[lane];
            }
        }
    }
    (positions, masks)
}

/// Takes bytes from the front.
pub(super) struct Reader<'a>(pub &'a [u8]);

impl<'a> Reader<'a> {
    pub fn take(&mut self, count: usize) -> Outcome<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or_else(|| damaged("it ends too early"))?;
        self.0 = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Outcome<[u8; N]> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    pub fn u32(&mut self) -> Outcome<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub fn u64(&mut self) -> Outcome<u64> {
        self.array().map(u64::from_le_bytes)
    }

    pub fn f64(&mut self) -> Outcome<f64> {
        self.u64().map(f64::from_bits)
    }

    pub fn f64s<const N: usize>(&mut self) -> Outcome<[f64; N]> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.f64()?;
        }
        Ok(numbers)
    }
}

/// The error of bytes that are not what was written.
pub(super) fn damaged(what: &str) -> Failure {
    Failure::new(HRR_ERROR_IO, format!("damaged, or not written by hrr: {what}"))
}

/// The cache that was written; an error when it would not be the same.
pub(super) fn read(context: &HrrContext, bytes: &[u8]) -> Outcome<HrrCache> {
    let mut from = Reader(bytes);
    if from.take(MAGIC.len())? != MAGIC {
        return Err(damaged("it does not begin as it should"));
    }
    let (count, masked, dropped) = (from.u64()?, from.u64()?, from.u64()?);
    let (origin, fingerprint) = (DVec3::from_array(from.f64s()?), from.u64()?);
    let each = if masked == 1 { 24 } else { 20 };
    if masked > 1 || count.checked_mul(each) != Some(from.0.len() as u64) || !origin.is_finite() {
        return Err(damaged("its parts do not fit together"));
    }
    let count = count as usize;
    let word = |four: &[u8]| u32::from_le_bytes([four[0], four[1], four[2], four[3]]);
    let number = |four: &[u8]| f32::from_bits(word(four));
    let point = |p: &[u8]| Vec3::new(number(&p[..4]), number(&p[4..8]), number(&p[8..]));
    let fill = |gathered: &mut Gathered| -> Outcome {
        gathered.reserve(count, masked == 1)?;
        gathered.positions.extend(from.take(12 * count)?.chunks_exact(12).map(point));
        let id = |b: &[u8]| u64::from(word(b)) | u64::from(word(&b[4..])) << 32;
        gathered.ids.extend(from.take(8 * count)?.chunks_exact(8).map(id));
        gathered.masks.extend(from.0.chunks_exact(4).map(word));
        (gathered.origin, gathered.dropped) = (origin, dropped);
        Ok(())
    };
    let source = Source { count: count as u64, masked: masked == 1, fill, progress: Progress::NONE };
    let cache = HrrCache::new(context, source)?;
    if cache.fingerprint() != fingerprint {
        return Err(damaged("its contents have another fingerprint"));
    }
    Ok(cache)
}
