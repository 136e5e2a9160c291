//! Other numbers of children and of vertices in a block than the library's eight and eight: queries, builds, bytes.

mod tree;
mod walk;

use crate::workload::{cpu_seconds, eye_vertices, light_vertices};
use glam::Vec3;
use hrr::roulette::{Query, QueryCounters, constant_for, query};
use hrr::vertex_bvh::VertexBvh;
use std::time::Instant;
use tree::Tree;
use walk::Waiting;

const VERTICES: usize = 1_000_000;
/// Repetitions, in turns, of which the fastest counts.
const RUNS: usize = 25;
const BUILDS: usize = 9;

/// A tree to be measured.
trait Variant {
    fn build(&mut self, points: &[Vec3]);
    fn bytes(&self) -> usize;
    fn ask(&mut self, q: &Query<'_>, stats: &mut QueryCounters, visit: &mut dyn FnMut(u32, f64));
    /// What brute force finds, where the tree has one of its own.
    fn ask_all(&mut self, q: &Query<'_>, visit: &mut dyn FnMut(u32, f64));
}

impl Variant for VertexBvh {
    fn build(&mut self, points: &[Vec3]) {
        self.build(points).expect("finite points");
    }

    fn bytes(&self) -> usize {
        self.bytes()
    }

    fn ask(&mut self, q: &Query<'_>, stats: &mut QueryCounters, visit: &mut dyn FnMut(u32, f64)) {
        query(self, q, stats, &mut |i, p| visit(i, p));
    }

    fn ask_all(&mut self, q: &Query<'_>, visit: &mut dyn FnMut(u32, f64)) {
        hrr::roulette::query_brute_force(self, q, &mut QueryCounters::default(), &mut |i, p| visit(i, p));
    }
}

struct Own<const W: usize, const B: usize>(Tree<W, B>, Waiting);

impl<const W: usize, const B: usize> Variant for Own<W, B> {
    fn build(&mut self, points: &[Vec3]) {
        self.0.build(points);
    }

    fn bytes(&self) -> usize {
        self.0.bytes()
    }

    fn ask(&mut self, q: &Query<'_>, stats: &mut QueryCounters, visit: &mut dyn FnMut(u32, f64)) {
        self.0.query(&mut self.1, q, true, stats, visit);
    }

    fn ask_all(&mut self, q: &Query<'_>, visit: &mut dyn FnMut(u32, f64)) {
        self.0.query(&mut self.1, q, false, &mut QueryCounters::default(), visit);
    }
}

fn own<const W: usize, const B: usize>() -> Box<dyn Variant> {
    Box::new(Own::<W, B>(Tree::default(), Waiting::new()))
}

/// The indices that a query accepts, sorted.
fn accepted(ask: impl FnOnce(&mut dyn FnMut(u32, f64))) -> Vec<u32> {
    let mut found = Vec::new();
    ask(&mut |i, _| found.push(i));
    found.sort_unstable();
    found
}

/// Every tree accepts what testing all of its vertices accepts; ours of eight and eight, what the library's accepts.
fn check(variants: &mut [(String, Box<dyn Variant>)], queries: &[Query<'_>]) {
    for q in queries {
        let mut of_library = Vec::new();
        for (i, (name, v)) in variants.iter_mut().enumerate() {
            let tree = accepted(|visit| v.ask(q, &mut QueryCounters::default(), visit));
            assert_eq!(tree, accepted(|visit| v.ask_all(q, visit)), "{name}");
            match i {
                0 => of_library = tree,
                1 => assert_eq!(tree, of_library),
                _ => {}
            }
        }
    }
}

pub fn widths() {
    println!("-- other widths: children x vertices of a block ({VERTICES} vertices, k = 1)");
    let points = light_vertices(VERTICES);
    let library: Box<dyn Variant> = Box::new(VertexBvh::new());
    let mut variants = vec![("library 8 x 8".to_owned(), library)];
    let shapes = [
        ("8 x 8", own::<8, 8>()),
        ("4 x 8", own::<4, 8>()),
        ("16 x 8", own::<16, 8>()),
        ("8 x 4", own::<8, 4>()),
        ("8 x 16", own::<8, 16>()),
        ("8 x 32", own::<8, 32>()),
        ("4 x 4", own::<4, 4>()),
        ("4 x 16", own::<4, 16>()),
        ("16 x 16", own::<16, 16>()),
    ];
    variants.extend(shapes.map(|(name, tree)| (name.to_owned(), tree)));

    let mut built = vec![f64::INFINITY; variants.len()];
    for _ in 0..BUILDS {
        for ((_, v), best) in variants.iter_mut().zip(&mut built) {
            let start = Instant::now();
            v.build(&points);
            *best = best.min(start.elapsed().as_secs_f64());
        }
    }
    for ((name, v), seconds) in variants.iter().zip(&built) {
        let n = VERTICES as f64;
        println!(
            "{name:14} {:6.1} ns/vertex to build ({:.2}) {:6.1} bytes/vertex",
            seconds * 1e9 / n,
            seconds / built[1],
            v.bytes() as f64 / n
        );
    }

    for (ax, ay) in [(1e-4, 1e-4), (1e-4, 1e-2), (1e-2, 1e-2), (1e-6, 1e-6), (0.1, 0.1)] {
        println!("alpha ({ax:e}, {ay:e})");
        let eyes = eye_vertices(20_000, ax, ay);
        let c = constant_for(1.0, 24.0, VERTICES);
        let queries: Vec<_> = eyes.iter().map(|e| Query::new(e.position, &e.lobes, c, e.key)).collect();
        check(&mut variants, &queries[..10]);
        let mut measured = vec![(f64::INFINITY, QueryCounters::default()); variants.len()];
        for _ in 0..RUNS {
            for ((_, v), best) in variants.iter_mut().zip(&mut measured) {
                let (mut stats, mut sum) = (QueryCounters::default(), 0.0);
                let start = cpu_seconds();
                for q in &queries {
                    v.ask(q, &mut stats, &mut |_, p| sum += 1.0 / p);
                }
                let seconds = cpu_seconds() - start;
                std::hint::black_box(sum);
                *best = (best.0.min(seconds), stats);
            }
        }
        for ((name, _), (seconds, s)) in variants.iter().zip(&measured) {
            let n = s.queries as f64;
            println!(
                "{name:14} {:7.3} us/query ({:.3}) {:7.1} nodes {:7.1} tests {:6.2} accepted",
                seconds / n * 1e6,
                seconds / measured[1].0,
                s.nodes as f64 / n,
                s.tests as f64 / n,
                s.accepted as f64 / n
            );
        }
    }
}
