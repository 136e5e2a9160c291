//! Images: the same to the bit without what is absent, the same in the mean with what is inert, and counters of what is
//! off at 0.

use super::*;
use crate::support::stats::{Family, Moments};
use glam::Vec2;
use hrr::film::Film;
use hrr::math::luminance;
use hrr::render::{Outcome, Silent, render};
use hrr::subpath::World;
use hrr::tally::Tally;
use hrr::visibility::Cutouts;

fn rendered(scene: &Scene, settings: &Settings) -> Outcome {
    render(scene, settings, &Silent).unwrap()
}

fn with(list: &str) -> Settings {
    Settings { with: list.parse().unwrap(), ..settings() }
}

/// All that an iteration of what is planned counts.
fn tally(scene: &Scene, settings: &Settings) -> Tally {
    let integrator = planned(scene, settings).unwrap().integrator;
    let settings = Settings { integrator, ..settings.clone() };
    let world = World::new(scene, &settings).unwrap();
    let mut film = Film::new(&scene.film);
    hrr::integrator::new(&world, &settings).unwrap().iterate(0, &mut film, &|_| ()).unwrap()
}

#[test]
fn counters_of_what_is_off_stay_0() {
    // Light subpaths, light vertices, queries of the roulette, what these visit and accept; merged vertices.
    let counts = |t: &Tally| {
        let r = &t.roulette;
        [t.light_subpaths, t.light_vertices, r.queries, r.nodes, r.accepted, t.merged]
    };
    let seconds = |t: &Tally| [t.light_trace, t.vertex_bvh_build, t.roulette_seconds];
    let on = |scene: &Scene, settings: &Settings| {
        let tally = tally(scene, settings);
        assert!(tally.camera_rays > 0 && tally.connection_rays > 0);
        // Time is spent on what counts something only; that of roulettes is sampled.
        let counts = counts(&tally);
        for (seconds, count) in seconds(&tally).into_iter().zip([counts[0], counts[2] + counts[5], counts[2]])
        {
            assert!(seconds == 0.0 || count > 0, "{tally:?}");
        }
        counts.map(|n| n > 0)
    };
    let glossy = with_cube(metal(1e-3, 1e-3));
    // Enough for something to be accepted.
    let many = |settings: Settings| Settings { samples: 32, expected: 100.0, ..settings };
    let under_lamp = |scene: Scene| lit(scene, lamp_without_size());
    let (yes, no) = (true, false);
    for (scene, settings, expected) in [
        (plain(), settings(), [no; 6]),
        (
            with_cube(mirror()),
            Settings { without: "sds".parse().unwrap(), ..settings() },
            [yes, yes, no, no, no, no],
        ),
        (glossy.clone(), many(settings()), [yes, yes, yes, yes, yes, no]),
        (under_lamp(with_cube(mirror())), many(settings()), [yes, yes, no, no, no, yes]),
        // Nothing smooth: nothing to merge.
        (under_lamp(glossy.clone()), many(with("sds")), [yes, yes, yes, yes, yes, no]),
        (under_lamp(glossy), many(Settings { integrator: Integrator::VcmHrr, ..settings() }), [yes; 6]),
    ] {
        assert_eq!(on(&scene, &settings), expected, "{:?}", planned(&scene, &settings));
    }
}

/// What counts nothing: is it there at all?
#[test]
fn machinery_of_the_scene_is_there_only_where_it_is_wanted() {
    let built = |scene: &Scene| {
        let world = World::new(scene, &settings()).unwrap();
        let any = |has: &dyn Fn(&Material) -> bool| scene.materials.iter().any(has);
        let mut lens = false;
        world.camera.lens_point(|| {
            lens = true;
            DVec2::ZERO
        });
        [
            (Effect::Opacity, Cutouts::new(&scene.mesh, &scene.materials).is_some()),
            (Effect::Textures, any(&|m| !m.is_constant())),
            (Effect::NormalMaps, any(&|m| m.bends_frame())),
            (Effect::Environment, !world.lights.only_area()),
            (Effect::Lens, lens),
        ]
    };
    assert!(built(&plain()).iter().all(|(_, on)| !on));
    for (effect, on) in
        rows().into_iter().flat_map(|(effect, scene, ..)| built(&scene).map(|(e, on)| ((effect, e), on)))
    {
        // A lamp without size is a light beside surfaces as well.
        let lamp = effect == (Effect::Sds, Effect::Environment);
        assert_eq!(on, effect.0 == effect.1 || lamp, "{effect:?}");
    }
}

/// Pixels, to the bit.
fn bits(scene: &Scene, settings: &Settings) -> Vec<[u32; 3]> {
    let image = rendered(scene, settings).film.image();
    image.pixels.iter().map(|p| p.to_array().map(f32::to_bits)).collect()
}

#[test]
fn what_is_absent_is_off_to_the_bit() {
    let glossy = || with_cube(metal(1e-2, 1e-2));
    for scene in [plain(), glossy()] {
        let auto = bits(&scene, &settings());
        assert!(auto.iter().any(|p| *p != [0; 3]));
        for effect in Effect::ALL {
            let (found, cannot) =
                (analyze(&scene, &settings()), ["refraction", "textures", "anisotropy", "specular"]);
            if found.of(effect).verdict == Verdict::Absent && !cannot.contains(&effect.id()) {
                let without = Settings { without: [effect].into_iter().collect(), ..settings() };
                assert_eq!(bits(&scene, &without), auto, "{effect}");
            }
        }
    }
    // With what is there, the image changes: the comparison can fail.
    let mut lens = plain();
    lens.camera.aperture_radius = 0.1;
    assert_ne!(bits(&lens, &settings()), bits(&plain(), &settings()));
    let without = Settings { without: "lens".parse().unwrap(), ..settings() };
    assert_eq!(bits(&lens, &without), bits(&plain(), &settings()));
}

#[test]
fn what_is_even_is_its_value_to_the_bit() {
    let even = |albedo: f64, map| with_cube(Scattering::Diffuse { albedo: Spectrum::splat(albedo), map });
    assert_eq!(
        bits(&even(1.0, texture([0.3, 0.3])), &settings()),
        bits(&even(f64::from(0.3f32), None), &settings())
    );
    let bright = |emission: f64, map| {
        let mut scene = mapped(Maps { emission: map, ..Maps::default() });
        scene.materials[0].emission = Spectrum::splat(emission);
        scene
    };
    assert_eq!(bits(&bright(4.0, texture([0.5, 0.5])), &settings()), bits(&bright(2.0, None), &settings()));
    let open = mapped(Maps { opacity: texture([1.0, 1.0]), ..Maps::default() });
    assert_eq!(bits(&open, &settings()), bits(&plain(), &settings()));
}

/// The machinery of what is absent, forced on: the roulette by name, that of the scene by something of it that is never
/// met.
#[test]
fn machinery_without_an_effect_changes_no_bit() {
    // Nothing glossy: the roulette has nobody to play for.
    let (plain_plans, mirror_plans) =
        ([Integrator::Lvc, Integrator::LvcHrr], [Integrator::LvcSds, Integrator::LvcHrrSds]);
    for (scene, plans) in [(plain(), plain_plans), (with_cube(mirror()), mirror_plans)] {
        let (without, with_roulette) = (with("light_subpaths"), with("light_subpaths,sdg"));
        let integrators = [&without, &with_roulette].map(|s| planned(&scene, s).unwrap().integrator);
        assert_eq!(integrators, plans);
        assert_eq!(bits(&scene, &without), bits(&scene, &with_roulette));
    }
    // Nothing smooth: there is nothing that shows caustics to merge.
    let merged = Settings { integrator: Integrator::LvcSds, ..settings() };
    assert_eq!(bits(&plain(), &with("light_subpaths")), bits(&plain(), &merged));
    let shown = lit(with_cube(mirror()), lamp_without_size());
    let many = Settings { samples: 32, ..settings() };
    let unmerged = Settings { without: "sds".parse().unwrap(), ..many.clone() };
    assert_ne!(bits(&shown, &many), bits(&shown, &unmerged));
    // Every surface looks up the middle of the first of two pixels.
    let looked_up = |mut scene: Scene| {
        scene.mesh.uvs = vec![Vec2::new(0.25, 0.5); scene.mesh.positions.len()];
        scene
    };
    let differ = |a: Scene, b: Scene, effect: Effect, name: &str| {
        let verdict = |scene: &Scene| analyze(scene, &settings()).of(effect).verdict;
        assert_eq!((verdict(&a), verdict(&b)), (Verdict::Absent, Verdict::Wanted), "{name}");
        bits(&a, &settings()) != bits(&b, &settings())
    };
    let painted =
        |albedo, map| looked_up(with_cube(Scattering::Diffuse { albedo: Spectrum::splat(albedo), map }));
    let opaque = |first: f32| {
        let mut scene = looked_up(plain());
        scene.materials[2].set_maps(Maps { opacity: texture([first, 0.5]), ..Maps::default() });
        scene
    };
    let rough = |alpha: f64, first: f32| {
        let mut scene = looked_up(with_cube(metal(alpha, alpha)));
        scene.materials[2].set_maps(Maps { roughness: texture([first, 0.7]), ..Maps::default() });
        scene
    };
    let smooth = looked_up(with_cube(metal(0.1, 0.1)));
    assert!(!differ(painted(0.5, None), painted(1.0, texture([0.5, 0.9])), Effect::Textures, "albedo"));
    assert!(!differ(smooth.clone(), rough(0.1, 1.0), Effect::Textures, "roughness"));
    assert!(!differ(looked_up(plain()), opaque(1.0), Effect::Opacity, "opacity"));
    // A lens of no width to speak of.
    let mut narrow = plain();
    narrow.camera.aperture_radius = 1e-300;
    assert!(!differ(plain(), narrow, Effect::Lens, "lens"));
    // Met, each changes the image.
    assert!(differ(painted(0.5, None), painted(1.0, texture([0.6, 0.9])), Effect::Textures, "albedo"));
    assert!(differ(smooth, rough(0.1, 0.9), Effect::Textures, "roughness"));
    assert!(differ(looked_up(plain()), opaque(0.9), Effect::Opacity, "opacity"));
}

/// The same for the machinery of what is shut up in a block: no path goes there.
#[test]
fn effects_that_no_path_meets_change_no_bit() {
    let pt = Settings { integrator: Integrator::Pt, ..settings() };
    let of = |name: &str, scattering: Scattering| Material::new(name, scattering);
    let grey = || Material::diffuse("grey", Spectrum::splat(0.5));
    let bumpy = || {
        let tilted = [Vec3::new(0.7, 0.5, 0.9), Vec3::new(0.5, 0.5, 1.0)];
        let image = Image { width: 2, height: 1, pixels: tilted.to_vec() };
        let map = Texture::new(Arc::new(image), DVec2::ONE, DVec2::ZERO);
        let mut material = grey();
        material.set_maps(Maps { normal: Some(map), ..Maps::default() });
        material
    };
    // So dim that it is not chosen among the lights, nor seen beside them.
    let glowing = |emission: f64| {
        let mut material = grey();
        material.emission = Spectrum::splat(emission);
        material.set_maps(Maps { emission: texture([0.5, 1.0]), ..Maps::default() });
        material
    };
    let painted = Scattering::Diffuse { albedo: Spectrum::ONE, map: texture([0.2, 0.8]) };
    let glass = || Scattering::Dielectric { ior: 1.5, alpha_x: 0.0, alpha_y: 0.0 };
    let rough_glass = Scattering::Dielectric { ior: 1.5, alpha_x: 0.1, alpha_y: 0.1 };
    for (effect, hidden, open) in [
        (Effect::Specular, of("mirror", mirror()), of("mirror", mirror())),
        (Effect::Refraction, of("glass", glass()), of("glass", glass())),
        (Effect::Refraction, of("rough glass", rough_glass.clone()), of("rough glass", rough_glass)),
        (Effect::Anisotropy, of("brushed", metal(1e-2, 0.1)), of("brushed", metal(1e-2, 0.1))),
        (Effect::Textures, of("painted", painted.clone()), of("painted", painted)),
        (Effect::NormalMaps, bumpy(), bumpy()),
        (Effect::EmissionTextures, glowing(1e-300), glowing(1.0)),
    ] {
        let place = |scene: &mut Scene, half: f32, at: Vec3, material: Material| {
            let index = scene.materials.len() as u32;
            let name = material.name.clone();
            scene.materials.push(material);
            cube(&mut scene.mesh, half, at, index);
            assert_eq!(analyze(scene, &pt).of(effect).verdict, Verdict::Wanted, "{name}");
        };
        let (mut inside, mut outside) = (plain(), plain());
        // All of a picture on every face; tangents follow it.
        let unrolled = |mut scene: Scene| {
            let corners = scene.mesh.positions.len();
            scene.mesh.uvs = (0..corners).map(|i| Vec2::new((i % 2) as f32, (i / 2 % 2) as f32)).collect();
            scene
        };
        place(&mut inside, 0.1, Vec3::new(0.2, 0.3, 0.0), hidden);
        place(&mut outside, 0.3, Vec3::new(-0.4, 0.3, 0.3), open);
        let [bare, inside, outside] = [plain(), inside, outside].map(|scene| bits(&unrolled(scene), &pt));
        assert!(inside == bare && outside != bare, "{effect}");
    }
    // A sky of next to no light, and the back of a lamp that nothing is behind.
    let lit = |color: f64| {
        let color = Spectrum::splat(color);
        lit(plain(), LightSource::Environment { color, image: None })
    };
    let [dark, bare, bright] = [lit(1e-300), plain(), lit(1.0)].map(|scene| bits(&scene, &pt));
    assert!(dark == bare && bright != bare);
    let two_sided = |ceiling: bool| {
        let mut scene = plain();
        if ceiling {
            quad(&mut scene.mesh, [[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], 2.0, Vec3::Y * 3.0, 1);
        }
        let one = bits(&scene, &pt);
        scene.materials[0].two_sided_emission = true;
        assert_eq!(analyze(&scene, &pt).of(Effect::TwoSidedEmission).verdict, Verdict::Wanted);
        (one, bits(&scene, &pt))
    };
    let [(one, two), (under_one, under_two)] = [false, true].map(two_sided);
    assert!(one == two && under_one != under_two);
}

/// Lobes that are as wide either way have one range, whatever its shape is called.
#[test]
fn isotropic_lobes_are_the_same_as_ellipsoids_and_as_spheroids() {
    use hrr::roulette::{Lobe, Range};
    let frame = hrr::math::Frame::from_z(DVec3::new(0.2, 0.9, -0.3).normalize());
    // Seen head on: a reflection seen askance is narrower one way than the other.
    let at = |alpha_x: f64, range: Range| {
        let lobe = Lobe::from_ggx_reflection(&frame, frame.z, alpha_x, 1e-2, 1.0);
        let lobe = lobe.with_range(range);
        [DVec3::new(0.4, 0.5, -1.0), DVec3::X, -DVec3::Y].map(|offset| lobe.h2(offset))
    };
    let differ = |alpha_x: f64| {
        let pairs = at(alpha_x, Range::Ellipsoid).into_iter().zip(at(alpha_x, Range::Spheroid));
        pairs.map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max)
    };
    // But for rounding.
    assert!(differ(1e-2) < 1e-12 && differ(1e-3) > 0.1, "{} {}", differ(1e-2), differ(1e-3));
}

/// Mean luminance of each tile of 4 x 4 pixels, over independent runs.
fn tiles(scene: &Scene, settings: &Settings, seed: u64) -> Vec<Moments> {
    const RUNS: u64 = 32;
    let integrator = planned(scene, settings).unwrap().integrator;
    let settings = Settings { integrator, seed, samples: 16, merge_radius: 1e-3, ..settings.clone() };
    let world = World::new(scene, &settings).unwrap();
    let mut machine = hrr::integrator::new(&world, &settings).unwrap();
    let mut moments = vec![Moments::default(); 16];
    for run in 0..RUNS {
        let mut film = Film::new(&scene.film);
        machine.iterate(run, &mut film, &|_| ()).unwrap();
        for (i, moments) in (0..).zip(&mut moments) {
            let pixels = (0..16).map(|j| (i % 4 * 4 + j % 4, i / 4 * 4 + j / 4));
            moments.push(pixels.map(|(x, y)| luminance(film.mean(x, y))).sum());
        }
    }
    moments
}

/// Equal expectation, whatever was switched on: no tile of either run differs [Welch 1947].
#[test]
fn what_is_inert_or_absent_does_not_change_the_mean() {
    let (mut family, dim) = (Family::default(), |scene: &Scene| {
        let mut scene = scene.clone();
        scene.materials[1] = Material::diffuse("floor", Spectrum::splat(0.48));
        scene
    });
    for (seed, (name, scene, effect, verdict, integrator)) in [
        ("plain", plain(), Effect::LightSubpaths, Verdict::Inert, Integrator::Lvc),
        ("plain", plain(), Effect::Caustics, Verdict::Absent, Integrator::Lvc),
        ("plain", plain(), Effect::Sdg, Verdict::Absent, Integrator::LvcHrr),
        ("plain", plain(), Effect::Sds, Verdict::Absent, Integrator::LvcSds),
        ("mirror", with_cube(mirror()), Effect::Sdg, Verdict::Absent, Integrator::LvcHrrSds),
        // Wanted for its noise alone: without, all of the light is found as well.
        ("mirror", with_cube(mirror()), Effect::Sds, Verdict::Wanted, Integrator::Lvc),
    ]
    .into_iter()
    .enumerate()
    {
        let seed = 2 * seed as u64;
        assert_eq!(analyze(&scene, &settings()).of(effect).verdict, verdict, "{name}, {effect}");
        let forced = match verdict {
            Verdict::Wanted => Settings { without: effect.id().parse().unwrap(), ..settings() },
            _ => with(effect.id()),
        };
        assert_eq!(planned(&scene, &forced).unwrap().integrator, integrator, "{name}, {effect}");
        let auto = tiles(&scene, &settings(), seed);
        for (tile, (a, b)) in auto.iter().zip(tiles(&scene, &forced, seed + 1)).enumerate() {
            family.add(format!("{name}, {effect}, tile {tile}: {} and {}", a.mean(), b.mean()), a.welch(&b));
        }
        // The test can fail: a floor that is 4 % darker is seen.
        let darker = tiles(&dim(&scene), &forced, seed + 1);
        let least = auto.iter().zip(&darker).map(|(a, b)| a.welch(b)).fold(1.0, f64::min);
        assert!(least < 1e-6, "{name}, {effect}: {least}");
    }
    family.assert();
}
