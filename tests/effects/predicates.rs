//! Scenes with what is expected of the analysis, and that each predicate is needed: with any of them stuck at either
//! answer, the expectations fail.

use super::*;
use hrr::effects::analyze_as;
use hrr::effects::predicate::{Judge, Predicate};
use hrr::material::Unsupported;

/// A scene, the longest path, and what is expected: the plan, and what is not absent with its witnesses; `~` inert, `!`
/// unsupported.
type Case = (&'static str, Scene, u32, &'static str);

/// What is expected of the plain scene.
const PLAIN: &str = "pt: direct(lamp floor cube) interreflection(floor cube) ~light_subpaths()";

/// What a judge makes of a scene, in the notation of [`Case`].
fn summary(scene: &Scene, max_depth: u32, judge: Judge) -> String {
    let settings = Settings { max_depth, ..settings() };
    let effects = analyze_as(scene, &settings, judge);
    let mut words = vec![match plan(scene, &settings, &effects) {
        Ok(plan) => {
            // What the verdict on an effect of the scene's own switches on, is on.
            for effect in Effect::ALL.into_iter().filter(|e| *e >= Effect::Specular) {
                let finding = effects.of(effect);
                let on = finding.machinery.iter().all(|m| plan.machinery.contains(m));
                assert_eq!(on, finding.verdict == Verdict::Wanted, "{effect}");
            }
            format!("{}:", plan.integrator)
        }
        Err(_) => "refused:".into(),
    }];
    words.extend(effects.findings.iter().filter(|f| f.verdict != Verdict::Absent).map(|f| {
        let mark = match f.verdict {
            Verdict::Inert => "~",
            Verdict::Unsupported => "!",
            _ => "",
        };
        let materials: Vec<_> = f.materials.iter().map(|w| w.material.as_str()).collect();
        format!("{mark}{}({})", f.id, materials.join(" "))
    }));
    words.join(" ")
}

/// Nothing but cubes of the third material, half of one unit 0.6 wide each, under an even sky.
fn cubes(centers: &[Vec3], scattering: Scattering) -> Scene {
    let mut scene = with_cube(scattering);
    scene.mesh = Mesh::default();
    centers.iter().for_each(|&center| cube(&mut scene.mesh, 0.3, center, 2));
    lit(scene, sky(1.0))
}

fn sky(radiance: f64) -> LightSource {
    LightSource::Environment { color: Spectrum::splat(radiance), image: None }
}

fn grey() -> Scattering {
    Scattering::Diffuse { albedo: Spectrum::splat(0.5), map: None }
}

fn changed(mut scene: Scene, change: impl FnOnce(&mut Scene)) -> Scene {
    change(&mut scene);
    scene
}

fn cases() -> Vec<Case> {
    let one = || cubes(&[Vec3::ZERO], grey());
    let rough = |low: f32, alpha: f64| {
        let map = Maps { roughness: texture([low, 1.0]), ..Maps::default() };
        changed(with_cube(metal(alpha, alpha)), |s| s.materials[2].set_maps(map))
    };
    let albedo = |values| with_cube(Scattering::Diffuse { albedo: Spectrum::ONE, map: texture(values) });
    let maps = |emission, normal| mapped(Maps { emission, normal, ..Maps::default() });
    let glass = Scattering::Dielectric { ior: 1.5, alpha_x: 0.0, alpha_y: 0.0 };
    let dark = |s: &mut Scene| s.materials[0].emission = Spectrum::ZERO;
    let rimmed = |s: &mut Scene| {
        s.mesh.triangles.truncate(10);
        s.mesh.materials.truncate(10);
    };
    let flat = |s: &mut Scene| {
        s.mesh = Mesh::default();
        quad(&mut s.mesh, [[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]], 1.0, Vec3::ZERO, 2);
    };
    let sheen = |s: &mut Scene| {
        let place = hrr::error::Place::line("a.mtl", 3);
        s.materials[2].unsupported.push(Unsupported { key: "Ps", what: "sheen".into(), place });
    };
    let black_lamp = LightSource::Point { position: DVec3::Y, intensity: Spectrum::ZERO };
    let mutual = "pt: direct(cube) interreflection(cube) ~light_subpaths() environment()";
    let alone = "pt: direct(cube) ~light_subpaths() environment()";
    let plus = |more: &str| -> &'static str { Box::leak(format!("{PLAIN} {more}").into_boxed_str()) };
    vec![
        ("plain", plain(), 6, PLAIN),
        ("two segments at most", plain(), 2, "pt: direct(lamp floor cube) ~light_subpaths()"),
        ("one segment", plain(), 1, "pt: ~light_subpaths()"),
        ("dark", changed(plain(), dark), 6, "pt:"),
        ("a lamp that is off", lit(changed(plain(), dark), black_lamp), 6, "pt:"),
        (
            "a lamp without size",
            lit(changed(plain(), dark), lamp_without_size()),
            6,
            "pt: direct(floor cube) interreflection(floor cube) ~light_subpaths()",
        ),
        (
            "mirror",
            with_cube(mirror()),
            6,
            "lvc+sds: direct(lamp floor) interreflection(floor cube) light_subpaths(cube) caustics(cube) sds(cube) \
             specular(cube)",
        ),
        (
            "black mirror",
            with_cube(Scattering::Mirror { reflectance: Spectrum::ZERO }),
            6,
            "pt: direct(lamp floor) interreflection(floor) ~light_subpaths()",
        ),
        ("unused mirror", changed(plain(), |s| s.materials.push(Material::new("m", mirror()))), 6, PLAIN),
        (
            "glossy",
            with_cube(metal(1e-3, 1e-3)),
            6,
            "lvc+hrr: direct(lamp floor cube) interreflection(floor cube) light_subpaths(cube) caustics(cube) sdg(cube)",
        ),
        (
            "as good as smooth",
            with_cube(metal(1e-6, 1e-6)),
            6,
            "lvc+hrr: direct(lamp floor) interreflection(floor cube) light_subpaths(cube) caustics(cube) sdg(cube) \
             specular(cube)",
        ),
        ("as good as diffuse", with_cube(metal(0.5, 0.5)), 6, PLAIN),
        (
            "rough in parts",
            rough(0.5, 0.5),
            6,
            "lvc+hrr: direct(lamp floor cube) interreflection(floor cube) light_subpaths(cube) caustics(cube) sdg(cube) \
             textures(cube)",
        ),
        (
            "smooth in parts",
            rough(0.0, 1e-3),
            6,
            "lvc+hrr+sds: direct(lamp floor cube) interreflection(floor cube) light_subpaths(cube) caustics(cube) sdg(cube) \
             sds(cube) specular(cube) textures(cube)",
        ),
        (
            "mirror under a lamp without size",
            lit(with_cube(mirror()), lamp_without_size()),
            6,
            "lvc+sds: direct(lamp floor) interreflection(floor cube) light_subpaths(cube) caustics(cube) sds(cube) \
             specular(cube)",
        ),
        (
            "only a mirror under a lamp without size",
            changed(cubes(&[Vec3::ZERO], mirror()), |s| s.lights = vec![lamp_without_size()]),
            6,
            "pt: ~light_subpaths(cube) specular(cube)",
        ),
        (
            "glass",
            with_cube(glass),
            6,
            "lvc+sds: direct(lamp floor) interreflection(floor cube) light_subpaths(cube) caustics(cube) sds(cube) \
             specular(cube) refraction(cube)",
        ),
        ("veil", changed(plain(), |s| s.materials[2].opacity = 0.5), 6, plus("opacity(cube)")),
        ("picture", albedo([0.2, 0.8]), 6, plus("textures(cube)")),
        ("even picture", albedo([0.5, 0.5]), 6, PLAIN),
        ("patterned lamp", maps(texture([0.5, 1.0]), None), 6, plus("emission_textures(lamp)")),
        ("bent normals", maps(None, texture([0.6, 0.7])), 6, plus("normal_maps(lamp)")),
        ("evenly bent normals", maps(None, texture([0.6, 0.6])), 6, plus("normal_maps(lamp)")),
        (
            "brushed",
            with_cube(metal(1e-3, 1e-2)),
            6,
            "lvc+hrr: direct(lamp floor cube) interreflection(floor cube) light_subpaths(cube) caustics(cube) sdg(cube) \
             anisotropy(cube)",
        ),
        ("sky", lit(plain(), sky(1.0)), 6, plus("environment()")),
        ("black sky", lit(plain(), sky(0.0)), 6, PLAIN),
        ("lens", changed(plain(), |s| s.camera.aperture_radius = 0.1), 6, plus("lens()")),
        (
            "lamp with two sides",
            changed(plain(), |s| s.materials[0].two_sided_emission = true),
            6,
            plus("two_sided_emission(lamp)"),
        ),
        ("two sides of no lamp", changed(plain(), |s| s.materials[1].two_sided_emission = true), 6, PLAIN),
        ("sheen", changed(plain(), sheen), 6, plus("!Ps(cube)")),
        ("convex body", one(), 6, alone),
        ("convex body from inside", changed(one(), |s| s.camera.origin = DVec3::splat(0.1)), 6, mutual),
        (
            "convex veil",
            changed(one(), |s| s.materials[2].opacity = 0.5),
            6,
            "pt: direct(cube) interreflection(cube) ~light_subpaths() opacity(cube) environment()",
        ),
        ("body with a rim", changed(one(), rimmed), 6, mutual),
        ("two bodies", cubes(&[Vec3::ZERO, Vec3::X], grey()), 6, mutual),
        ("flat", changed(one(), flat), 6, alone),
    ]
}

#[test]
fn every_scene_gets_what_is_expected() {
    for (name, scene, max_depth, expected) in cases() {
        assert_eq!(summary(&scene, max_depth, Judge::default()), expected, "{name}");
    }
}

#[test]
fn every_predicate_is_needed() {
    let cases = cases();
    let mut idle = Vec::new();
    for &predicate in Predicate::ALL {
        for answer in [false, true] {
            let judge = Judge::stuck(predicate, answer);
            let missed =
                |(_, scene, max_depth, expected): &Case| summary(scene, *max_depth, judge) != *expected;
            if !cases.iter().any(missed) {
                idle.push((predicate, answer));
            }
        }
    }
    assert!(idle.is_empty(), "stuck at these answers, nobody would notice: {idle:?}");
}

/// The image is part of what is expected: a predicate that hides a kind of paths takes their light out of it.
#[test]
fn light_is_lost_without_the_predicates_that_find_it() {
    let mut scene = lit(with_cube(mirror()), lamp_without_size());
    scene.materials[0].emission = Spectrum::ZERO;
    let total = |judge: Judge| {
        let plan = plan(&scene, &settings(), &analyze_as(&scene, &settings(), judge)).unwrap();
        let settings = Settings { integrator: plan.integrator, iterations: 64, ..settings() };
        let world = hrr::subpath::World::new(&scene, &settings).unwrap();
        let mut integrator = hrr::integrator::new(&world, &settings).unwrap();
        let mut film = hrr::film::Film::new(&scene.film);
        for iteration in 0..settings.iterations {
            integrator.iterate(iteration, &mut film, &|_| ()).unwrap();
        }
        film.image().pixels.iter().map(|p| f64::from(p.y)).sum::<f64>()
    };
    let whole = total(Judge::default());
    for (predicate, answer) in [
        (Predicate::Used, false),
        (Predicate::Reflects, false),
        (Predicate::Delta, false),
        (Predicate::LampGives, false),
        (Predicate::ShortEnough, false),
    ] {
        let rest = total(Judge::stuck(predicate, answer)) / whole;
        assert!(rest < 0.97, "{predicate:?}: {rest:.4} of the light is left");
    }
    // That of others does not hang on them here.
    for (predicate, answer) in
        [(Predicate::Sky, false), (Predicate::Anisotropic, true), (Predicate::Flat, false)]
    {
        let rest = total(Judge::stuck(predicate, answer)) / whole;
        assert!((rest - 1.0).abs() < 0.01, "{predicate:?}: {rest:.4} of the light is left");
    }
}
