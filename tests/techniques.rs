//! What the roulette's settings say, and what it then does.

use crate::support::scenes;
use glam::{DVec3, Vec3};
use hrr::connect::EyeVertex;
use hrr::film::Film;
use hrr::integrator::Size;
use hrr::math::{Frame, warp};
use hrr::mis::Heuristic;
use hrr::render::{Silent, render};
use hrr::roulette::{Lobe, Query, QueryCounters, probability, query};
use hrr::sampler::{Family, Purpose, Sampler, Stream};
use hrr::settings::{AutoSwitch, Backend, Integrator, Settings};
use hrr::subpath::World;
use hrr::techniques::{Lobes, Numerics, Roulette, Techniques};
use hrr::vertex_bvh::VertexBvh;
use std::f64::consts::PI;

/// Axis probabilities of the tests.
const PROBABILITIES: [f64; 3] = [0.02, 1.0, 4.0];

fn with_roulette(constant: f64, most: f64) -> Techniques {
    let numerics = Numerics::DEFAULT;
    let roulette = Some(Roulette { light_subpaths: 1.0, constant, most, max_alpha: 0.3, numerics });
    Techniques { roulette, ..Techniques::none(Heuristic::Balance) }
}

fn total_weight(lobes: &Lobes) -> f64 {
    lobes.iter().map(|lobe| lobe.weight()).sum()
}

/// `axis_probability` X keeps what `expected` = X N / (4 pi c) would keep at a vertex whose lobes weigh c, to the vertex.
#[test]
fn an_axis_probability_is_a_number_of_expected_vertices() {
    let scene = scenes::box_of_everything();
    let world = World::new(&scene, &Settings { visibility: Backend::Obvhs, ..scenes::settings() }).unwrap();
    let area = scene.mesh.total_area();
    let points: Vec<Vec3> = (0..4096u32)
        .map(|i| Sampler::new(5, 0, Stream::Light, i.into()).u2(0, Purpose::LightPoint).as_vec2())
        .enumerate()
        .map(|(i, u)| [Vec3::new(u.x, u.y, 1.0), Vec3::new(1.0, u.x, u.y), Vec3::new(u.x, 1.0, u.y)][i % 3])
        .map(|p| 2.0 * p - 1.0)
        .collect();
    let mut bvh = VertexBvh::new();
    bvh.build(&points).unwrap();
    let kept = |vertex: &EyeVertex, lobes: &Lobes, constant: f64| {
        let mut kept = Vec::new();
        let asked = Query::new(vertex.walk.vertex.point.position, lobes, constant, 7);
        query(&bvh, &asked, &mut QueryCounters::default(), &mut |index, p| kept.push((index, p)));
        kept
    };
    for x in PROBABILITIES {
        // Far more than any lobe may have: the limit decides everywhere.
        let limited = with_roulette(1e6, x * area / (4.0 * PI));
        let (mut vertices, mut accepted) = (0, 0);
        for index in 0..400 {
            let sampler = Sampler::new(1, 0, Stream::Eye, index);
            let raster = sampler.u2(0, Purpose::Raster) * 32.0;
            let mut eye = EyeVertex::first(&world, &limited, raster, &sampler).vertex();
            while let Some(vertex) = eye {
                if !vertex.lobes.is_empty() {
                    let plain =
                        with_roulette(1.0, f64::INFINITY).lobes(&vertex.walk.vertex, vertex.walk.vertex.wo);
                    let expected = x * points.len() as f64 / (4.0 * PI * total_weight(&plain));
                    let constant = expected * area / points.len() as f64;
                    let [a, b] = [kept(&vertex, &vertex.lobes, 1e6), kept(&vertex, &plain, constant)];
                    assert_eq!(a.len(), b.len());
                    for ((i, p), (j, q)) in a.iter().zip(&b) {
                        assert!(i == j && (p / q - 1.0).abs() < 1e-12, "{i} {p} {j} {q}");
                    }
                    if let [lobe] = &vertex.lobes[..] {
                        let far = lobe.frame().z * (area / (4.0 * PI)).sqrt();
                        assert!((probability(&vertex.lobes, 1e6, far) / x.min(1.0) - 1.0).abs() < 1e-12);
                    }
                    (vertices, accepted) = (vertices + 1, accepted + a.len());
                }
                eye = vertex.next(&world, &limited, &sampler).vertex();
            }
        }
        println!("X = {x}: {vertices} eye vertices kept {accepted} light vertices");
        assert!(vertices > 200 && accepted > 100);
    }
}

/// Seen at a right angle, metal that absorbs nothing keeps X N alpha^2 of N light vertices around it, and 2 sqrt(X) - 1
/// times what X = 1 would keep where X is over 1.
#[test]
fn an_axis_probability_counts_vertices_in_the_footprint() {
    let count = 1u32 << 20;
    let alpha = 0.03;
    let lobe = Lobe::from_ggx_reflection(&Frame::from_z(DVec3::Z), DVec3::Z, alpha, alpha, 1.0);
    let points = Family::new(3, 0, Stream::Light, 0);
    for x in PROBABILITIES {
        // At distance 1 all around, where C c is X.
        let constant = x / lobe.weight();
        let kept: f64 = (0..count)
            .map(|i| points.member(i).u2(0, Purpose::LightPoint))
            .map(|u| probability(&[lobe], constant, warp::square_to_sphere(u)))
            .sum();
        let expected = f64::from(count) * alpha * alpha * if x > 1.0 { 2.0 * f64::sqrt(x) - 1.0 } else { x };
        println!("X = {x}: {kept} kept, {expected} by the formula");
        assert!((kept / expected - 1.0).abs() < 0.01, "X = {x}: {kept} kept, {expected} by the formula");
    }
}

/// Where `expected` asks for less, `axis_probability` changes nothing, to the bit; where it asks for more, fewer are kept.
#[test]
fn of_expected_and_axis_probability_the_least_counts() {
    let scene = scenes::box_of_everything();
    let run = |axis_probability| {
        let integrator = Integrator::LvcHrr;
        let settings = Settings { integrator, axis_probability, samples: 2, ..scenes::settings() };
        let world = World::new(&scene, &settings).unwrap();
        let mut film = Film::new(&scene.film);
        let tally = hrr::integrator::new(&world, &settings).unwrap().iterate(0, &mut film, &|_| ()).unwrap();
        (tally.roulette.accepted, film.mean(16, 20).to_array().map(f64::to_bits))
    };
    let [unset, large, small] = [None, Some(1e6), Some(1e-3)].map(run);
    assert_eq!(unset, large);
    assert!(small.0 < unset.0 / 2, "{small:?} {unset:?}");
}

/// `expected` says what it says, whatever the lamps' number and size; where lamps are few, nothing changes by itself.
#[test]
fn as_many_emitter_vertices_are_kept_as_expected() {
    for across in [1, 4, 14] {
        let scene = scenes::lamps_over_a_glossy_floor(across);
        for expected in [0.5, 4.0] {
            let kept = |emitters| {
                let integrator = Integrator::LvcHrr;
                let settings = Settings { integrator, emitters, expected, samples: 4, ..scenes::settings() };
                let world = World::new(&scene, &settings).unwrap();
                let mut machine = hrr::integrator::new(&world, &settings).unwrap();
                let mut film = Film::new(&scene.film);
                let tallies = (0..4).map(|i| machine.iterate(i, &mut film, &|_| ()).unwrap().emitters);
                tallies.fold((0, 0), |sum, t| (sum.0 + t.queries, sum.1 + t.accepted))
            };
            assert_eq!(kept(AutoSwitch::Off), (0, 0));
            assert_eq!(kept(AutoSwitch::Auto).0 > 0, across > 1);
            let (queries, accepted) = kept(AutoSwitch::On);
            let mean = accepted as f64 / queries as f64 / expected;
            println!("{across}^2 lamps, {expected} expected: {mean} of these");
            assert!((0.5..2.0).contains(&mean), "{across}^2 lamps, {expected} expected: {mean} of these");
        }
    }
}

/// Light is guided where the roulette has a good part of the noise, or where that is not known; not where what it finds is
/// little and steady, as on a metal block that caustics do not fall on.
#[test]
fn light_is_guided_where_that_pays() {
    for (name, guided) in [("cornell", false), ("caustic_mirror", true)] {
        let scene = scenes::load(name, &[("film.width", "64"), ("film.height", "48")]);
        let [auto, on, off] = [AutoSwitch::Auto, AutoSwitch::On, AutoSwitch::Off].map(|guiding| {
            let settings = Settings {
                integrator: Integrator::LvcHrr,
                samples: 4,
                light_subpaths: 1 << 17,
                iterations: 1,
                time: None,
                guiding,
                ..scene.settings.clone()
            };
            render(&scene, &settings, &Silent).unwrap().film.image()
        });
        assert!(on != off, "{name}: it makes no difference");
        assert!(auto == if guided { on } else { off }, "{name}");
    }
}

/// The pre-pass of a larger iteration has fewer light vertices than the iteration before it, and picks from its own.
#[test]
fn a_pre_pass_picks_from_its_own_light_vertices() {
    let scene = scenes::load("cornell", &[("film.width", "64"), ("film.height", "48")]);
    let settings = Settings {
        integrator: Integrator::LvcHrr,
        samples: 4,
        light_subpaths: 1 << 12,
        ..scene.settings.clone()
    };
    let world = World::new(&scene, &settings).unwrap();
    let mut machine = hrr::integrator::new(&world, &settings).unwrap();
    for light_subpaths in [1 << 17, 1 << 20] {
        machine.resize(Size { samples: 4, light_subpaths }).unwrap();
        if light_subpaths == 1 << 17 {
            machine.iterate(0, &mut Film::new(&scene.film), &|_| ()).unwrap();
        }
    }
}
