//! Bytes to light vertices and a query, and what must hold whatever they say. The fuzzer and the test suite share it.

use super::bytes::Bytes;
use glam::{DVec3, Vec3};
use hrr::math::Frame;
use hrr::roulette::{
    Lobe, MinimumRandom, Pregenerated, Query, QueryCounters, probability, query, query_brute_force,
};
use hrr::vertex_bvh::VertexBvh;

impl Bytes<'_> {
    /// Any bits at all, or a number of everyday size: a search by bytes finds the one seldom, the other hardly ever.
    fn real(&mut self, wild: bool) -> f64 {
        if wild {
            f64::from_le_bytes(self.take())
        } else {
            f64::from(i16::from_le_bytes(self.take())) / 4096.0
        }
    }

    fn vector(&mut self, wild: bool) -> DVec3 {
        DVec3::new(self.real(wild), self.real(wild), self.real(wild))
    }

    /// A length or roughness on a logarithmic scale, 1e-8 .. 10.
    fn scale(&mut self) -> f64 {
        10f64.powf(f64::from(u16::from_le_bytes(self.take())) * (9.0 / 65535.0) - 8.0)
    }
}

/// Bits of the first byte.
const WILD_POINTS: u8 = 1;
const WILD_LOBES: u8 = 2;
const WILD_QUERY: u8 = 4;
const MASKED: u8 = 8;

/// Builds the tree and asks, by the tree and by testing every vertex. Panics if anything is amiss; says how many
/// vertices were accepted.
pub fn check(bytes: &[u8]) -> usize {
    let mut bytes = Bytes(bytes);
    let what = bytes.byte();
    let rule = bytes.byte();
    let lobe_count = usize::from(bytes.byte() % 11);
    let lobes: Vec<_> = (0..lobe_count).map(|_| lobe(&mut bytes, what & WILD_LOBES != 0)).collect();
    let wild = what & WILD_QUERY != 0;
    let position = bytes.vector(wild);
    let constant = if wild { bytes.real(true) } else { bytes.scale() };
    let key = u64::from_le_bytes(bytes.take());
    let seed = bytes.byte();

    let mut points = Vec::new();
    let copies = if what & WILD_POINTS == 0 { 1 + usize::from(bytes.byte() % 4) * 20 } else { 1 };
    while !bytes.0.is_empty() && points.len() < 5000 {
        let point = if what & WILD_POINTS != 0 {
            Vec3::from_array(std::array::from_fn(|_| f32::from_le_bytes(bytes.take())))
        } else {
            bytes.vector(false).as_vec3()
        };
        // Copies a little apart, so that few bytes make a tree of some depth.
        points.extend((0..copies).map(|i| point * (1.0 + i as f32 * 1e-3)));
    }
    let masks: Vec<_> = (0..points.len() as u32).map(|i| i.wrapping_mul(0x9e37_79b9) >> 28).collect();
    let mut bvh = VertexBvh::new();
    let masked = what & MASKED != 0;
    if bvh.build_masked(&points, masked.then_some(&masks)).is_err() {
        assert!(points.iter().any(|p| !p.is_finite()), "finite positions make a tree");
        assert!(bvh.is_empty());
    }
    let numbers = (rule % 4 == 3).then(|| Pregenerated::new(&bvh, seed.into()));
    let q = Query {
        rule: [MinimumRandom::Nested, MinimumRandom::SemiStratified, MinimumRandom::Exact]
            [usize::from(rule % 3)],
        pregenerated: numbers.as_ref(),
        mask: if masked { seed.into() } else { u32::MAX },
        ..Query::new(position, &lobes, constant, key)
    };
    let (mut tree, mut brute) = (Vec::new(), Vec::new());
    let mut stats = QueryCounters::default();
    query(&bvh, &q, &mut stats, &mut |i, p| tree.push((i, p)));
    assert_eq!(stats.accepted as usize, tree.len());
    query_brute_force(&bvh, &q, &mut stats, &mut |i, p| brute.push((i, p)));
    for &(i, p) in &tree {
        assert!(p > 0.0 && p <= 1.0, "{p}");
        let offset = points[i as usize].as_dvec3() - position;
        assert_eq!(probability(&lobes, constant, offset).to_bits(), p.to_bits());
        assert!(!masked || masks[i as usize] & q.mask != 0);
    }
    // Lobes without a frame are no lobes: nothing is promised of them but that they do no harm.
    if lobes.iter().all(is_sound) && position.is_finite() {
        assert_eq!(tree, brute, "{q:?}");
    }
    tree.len()
}

fn lobe(bytes: &mut Bytes<'_>, wild: bool) -> Lobe {
    if wild {
        let frame = Frame { x: bytes.vector(true), y: bytes.vector(true), z: bytes.vector(true) };
        return Lobe::new(frame, bytes.real(true), bytes.real(true), bytes.real(true));
    }
    let frame = Frame::from_z_tangent(bytes.vector(false).normalize_or(DVec3::Z), bytes.vector(false));
    let (kind, ax, ay, c) = (bytes.byte(), bytes.scale(), bytes.scale(), bytes.scale());
    let wo = bytes.vector(false).normalize_or(DVec3::Z);
    match kind % 4 {
        0 => Lobe::sphere(c),
        1 => Lobe::from_ggx_reflection(&frame, wo, ax, ay, c),
        2 => Lobe::from_ggx_transmission(&frame, wo, ax, ay, 0.5 + c.min(2.0), 1.0),
        _ => Lobe::new(frame, ax, ay, c / (ax * ay)),
    }
}

/// Orthonormal axes.
fn is_sound(lobe: &Lobe) -> bool {
    let Frame { x, y, z } = *lobe.frame();
    let off = [x.dot(x) - 1.0, y.dot(y) - 1.0, z.dot(z) - 1.0, x.dot(y), y.dot(z), z.dot(x)];
    off.iter().all(|o| o.abs() < 1e-6)
}
