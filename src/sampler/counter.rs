//! Counter-based random numbers, keyed by (seed, iteration, stream, index, depth, purpose).
//!
//! A number is a pure function of its key: the same for any thread count and order of work, and switching one
//! technique off does not shift the numbers of another.

use super::sobol::Place;
use glam::DVec2;

/// Mixes 64 bits so that every input bit reaches every output bit [Stafford 2011, variant 13].
#[inline(always)]
pub fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Combines a key with one more word.
#[inline(always)]
pub fn combine(key: u64, word: u64) -> u64 {
    mix(key ^ word.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(0xd1b5_4a32_d192_ed03))
}

/// The independent families of subpaths.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u64)]
pub enum Stream {
    /// Light subpaths of an iteration.
    Light = 1,
    /// Eye subpaths (samples of pixels) of an iteration.
    Eye = 2,
    /// The pre-pass that measures how many vertices a light subpath leaves.
    Pilot = 3,
    /// Eye subpaths that importance records are made along.
    Records = 4,
    /// Light subpaths of the pre-pass that learns where to send them.
    GuideLight = 5,
    /// Eye subpaths of that.
    GuideEye = 6,
    /// What all samples of a pixel share.
    Pixel = 7,
    /// Points of lights that the roulette judges.
    Emitters = 8,
    /// The pre-pass that measures how many of them it would keep.
    EmitterPilot = 9,
}

/// What a number decides at a vertex.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u64)]
pub enum Purpose {
    /// Position within the pixel.
    Raster = 0,
    /// Position on the lens.
    Lens,
    /// Which emitter.
    LightPick,
    /// Which point of the emitter.
    LightPoint,
    /// Which direction from the emitter.
    LightDirection,
    /// Which lobe of the BSDF.
    Lobe,
    /// Which direction within the lobe.
    Direction,
    /// Whether the walk goes on.
    Survival,
    /// Which cached light vertex is picked.
    CachePick,
    /// Whether a light vertex is stored.
    Storing,
    /// Which distribution over cached light vertices it is picked by.
    RecordPick,
    /// Key of the roulette over all light vertices.
    Roulette,
    /// Key of the roulette over points of lights.
    EmitterRoulette,
}

impl Purpose {
    /// Where few numbers decide much, so that it pays to spread them evenly: the sequence, and the dimension of the first.
    /// Purposes of one sequence are spread evenly together: those that survive, or are of one lobe or light, are so too.
    #[inline(always)]
    fn even(self) -> Option<(Sequence, usize)> {
        use Purpose::*;
        match self {
            Raster => Some((Sequence::Camera, 0)),
            Lens => Some((Sequence::Camera, 2)),
            LightPoint => Some((Sequence::Light, 0)),
            LightPick => Some((Sequence::Light, 2)),
            LightDirection => Some((Sequence::Light, 3)),
            Direction => Some((Sequence::Scattering, 0)),
            Survival => Some((Sequence::Scattering, 2)),
            Lobe => Some((Sequence::Scattering, 3)),
            CachePick => Some((Sequence::Cache, 0)),
            Storing | RecordPick | Roulette | EmitterRoulette => None,
        }
    }
}

/// The sequences of points at a depth.
#[derive(Debug, Clone, Copy)]
#[repr(u64)]
enum Sequence {
    Camera,
    Light,
    Scattering,
    Cache,
}

/// Depths up to this one have their numbers spread evenly over a family. Deeper, too little depends on one number alone.
const EVEN_DEPTHS: u32 = 3;

/// Subpaths whose numbers are spread evenly over them all: the samples of a pixel, the light subpaths of an iteration.
/// Those that choose positions, directions and lights near a subpath's start are points of one sequence
/// (`sobol.rs`), which lowers the family's noise; each subpath's own are as uniform and independent as ever.
#[derive(Debug, Clone, Copy)]
pub struct Family(u64);

impl Family {
    /// A family of a stream in an iteration.
    #[inline]
    pub fn new(seed: u64, iteration: u64, stream: Stream, family: u64) -> Self {
        Self(combine(combine(combine(seed, iteration), stream as u64), family))
    }

    /// The numbers of one of its subpaths.
    #[inline(always)]
    pub fn member(self, index: u32) -> Sampler {
        Sampler { key: combine(self.0, !u64::from(index)), family: Some((self.0, Place::new(index))) }
    }
}

/// The random numbers of one subpath.
#[derive(Debug, Clone, Copy)]
pub struct Sampler {
    key: u64,
    /// Key of the family, and the place in it; `None`: all numbers are independent.
    family: Option<(u64, Place)>,
}

impl Sampler {
    /// Independent numbers for the subpath `index` of a stream in an iteration.
    pub fn new(seed: u64, iteration: u64, stream: Stream, index: u64) -> Self {
        Self { key: combine(combine(combine(seed, iteration), stream as u64), index), family: None }
    }

    /// 64 random bits for a purpose at a depth (vertex number along the subpath).
    #[inline(always)]
    pub fn bits(&self, depth: u32, purpose: Purpose) -> u64 {
        combine(self.key, (u64::from(depth) << 8) | purpose as u64)
    }

    /// `N` numbers for a purpose that are spread evenly over the family; `None` where they are independent. `n` tells several
    /// such apart.
    #[inline(always)]
    fn even<const N: usize>(&self, depth: u32, purpose: Purpose, n: u32) -> Option<[f64; N]> {
        let (family, place) = self.family.filter(|_| depth <= EVEN_DEPTHS)?;
        let (sequence, dimension) = purpose.even()?;
        let mut key = combine(family, (u64::from(depth) << 8) | sequence as u64);
        if n > 0 {
            key = combine(key, n.into());
        }
        Some(place.point(key, dimension).map(fraction))
    }

    /// Uniform in [0,1): 53 bits, or the 32 of a number that is spread evenly, which is never 0.
    #[inline(always)]
    pub fn u1(&self, depth: u32, purpose: Purpose) -> f64 {
        match self.even(depth, purpose, 0) {
            Some([u]) => u,
            None => unit(self.bits(depth, purpose)),
        }
    }

    /// Two independent uniforms in [0,1), as [`Sampler::u1`] gives one.
    #[inline(always)]
    pub fn u2(&self, depth: u32, purpose: Purpose) -> DVec2 {
        match self.even(depth, purpose, 0) {
            Some([x, y]) => DVec2::new(x, y),
            None => {
                let a = self.bits(depth, purpose);
                DVec2::new(unit(a), unit(mix(a ^ 0x6a09_e667_f3bc_c908)))
            }
        }
    }

    /// The `n`-th of any number of uniforms for a purpose, each as [`Sampler::u1`] gives one.
    #[inline]
    pub fn nth(&self, depth: u32, purpose: Purpose, n: u32) -> f64 {
        match self.even(depth, purpose, n) {
            Some([u]) => u,
            None => unit(combine(self.bits(depth, purpose), u64::from(n))),
        }
    }
}

/// The middle of one of 2^32 parts of [0,1).
#[inline(always)]
fn fraction(part: u32) -> f64 {
    (f64::from(part) + 0.5) * (1.0 / (1u64 << 32) as f64)
}

/// The top 53 bits as a number in [0,1).
#[inline]
pub fn unit(bits: u64) -> f64 {
    (bits >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn families_are_spread_evenly_where_it_matters() {
        for (depth, purpose, even) in
            [(1, Purpose::Direction, true), (1, Purpose::Storing, false), (9, Purpose::Direction, false)]
        {
            let hit = |family: u64| {
                let mut seen = [false; 64];
                for index in 0..64 {
                    let u = Family::new(3, 1, Stream::Eye, family).member(index).u2(depth, purpose);
                    seen[(u.x * 8.0) as usize * 8 + (u.y * 8.0) as usize] = true;
                }
                seen.iter().filter(|&&s| s).count()
            };
            let full = (0..20).filter(|&family| hit(family) == 64).count();
            assert_eq!(full, if even { 20 } else { 0 }, "{depth} {purpose:?}");
        }
    }

    /// Decisions that belong together are coordinates of one point: those of either light, and those that survive, are
    /// spread evenly as well.
    #[test]
    fn halves_of_a_family_are_spread_evenly() {
        use Purpose::*;
        for (half, square, even) in [
            (Survival, Direction, true),
            (Lobe, Direction, true),
            (LightPick, LightPoint, true),
            (Lobe, LightPoint, false),
        ] {
            let full = |family: u64| {
                let mut seen = [false; 16];
                for index in 0..64 {
                    let sampler = Family::new(5, 1, Stream::Eye, family).member(index);
                    if sampler.u1(1, half) < 0.5 {
                        let u = sampler.u2(1, square);
                        seen[(u.x * 4.0) as usize * 4 + (u.y * 4.0) as usize] = true;
                    }
                }
                seen.iter().all(|&s| s)
            };
            let full = (0..40).filter(|&family| full(family)).count();
            assert_eq!(full == 40, even, "{half:?} {square:?}: {full} of 40");
        }
    }

    #[test]
    fn streams_and_purposes_do_not_share_numbers() {
        let mut seen = std::collections::HashSet::new();
        for iteration in 0..4 {
            for stream in [Stream::Light, Stream::Eye, Stream::Pilot, Stream::Records] {
                for index in 0..64 {
                    let s = Sampler::new(7, iteration, stream, index);
                    for depth in 0..8 {
                        for purpose in [Purpose::Raster, Purpose::Direction, Purpose::Roulette] {
                            assert!(seen.insert(s.bits(depth, purpose)));
                        }
                    }
                }
            }
        }
    }
}
