//! What scenes call for: each effect in a scene that has it and in one that has not, what is switched on for it, and that
//! what is off does nothing.

mod coverage;
mod images;
mod predicates;

use crate::support::scenes::{self, cube, in_memory, quad};
use glam::{DVec2, DVec3, Vec3};
use hrr::effects::{Effect, Verdict, analyze};
use hrr::geometry::Mesh;
use hrr::image::Image;
use hrr::integrator::plan::{Plan, plan};
use hrr::light::LightSource;
use hrr::material::{Maps, Material, Scattering};
use hrr::math::Spectrum;
use hrr::scene::Scene;
use hrr::settings::{Backend, Integrator, Settings};
use hrr::texture::Texture;
use std::sync::Arc;

/// A lamp over a floor with a cube on it, all diffuse: material 0 is the lamp, 1 the floor, 2 the cube.
fn plain() -> Scene {
    let mut lamp = Material::diffuse("lamp", Spectrum::ZERO);
    lamp.emission = Spectrum::splat(5.0);
    let grey = Material::diffuse("floor", Spectrum::splat(0.5));
    let mut block = grey.clone();
    block.name = "cube".into();
    let materials = vec![lamp, grey, block];
    let mut mesh = Mesh::default();
    quad(&mut mesh, [[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], 0.5, Vec3::Y * 2.0, 0);
    quad(&mut mesh, [[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]], 1.0, Vec3::ZERO, 1);
    cube(&mut mesh, 0.3, Vec3::new(0.2, 0.3, 0.0), 2);
    let mut scene = in_memory(mesh, materials, DVec3::new(0.0, 1.5, 3.0), DVec3::Y * 0.3, 40.0);
    (scene.film.width, scene.film.height) = (16, 16);
    scene
}

fn with_cube(scattering: Scattering) -> Scene {
    let mut scene = plain();
    scene.materials[2] = Material::new("cube", scattering);
    scene
}

fn mirror() -> Scattering {
    Scattering::Mirror { reflectance: Spectrum::splat(0.9) }
}

fn metal(alpha_x: f64, alpha_y: f64) -> Scattering {
    let reflectance = hrr::bsdf::Reflectance::Schlick { f0: Spectrum::splat(0.9) };
    Scattering::Conductor { reflectance, alpha_x, alpha_y }
}

fn texture(values: [f32; 2]) -> Option<Texture> {
    let pixels = values.map(Vec3::splat).to_vec();
    Some(Texture::new(Arc::new(Image { width: 2, height: 1, pixels }), DVec2::ONE, DVec2::ZERO))
}

fn mapped(maps: Maps) -> Scene {
    let mut scene = plain();
    scene.materials[0].set_maps(maps);
    scene
}

fn lamp_without_size() -> LightSource {
    LightSource::Point { position: DVec3::new(0.0, 1.8, 0.5), intensity: Spectrum::ONE }
}

fn lit(mut scene: Scene, light: LightSource) -> Scene {
    scene.lights.push(light);
    scene
}

fn settings() -> Settings {
    Settings { visibility: Backend::Obvhs, iterations: 2, samples: 1, max_depth: 6, ..scenes::settings() }
}

fn planned(scene: &Scene, settings: &Settings) -> hrr::Result<Plan> {
    plan(scene, settings, &analyze(scene, settings))
}

/// Every row: a scene that has the effect, and what that switches on. The plain scene has but the first two.
fn rows() -> Vec<(Effect, Scene, &'static str, &'static str)> {
    let mut lens = plain();
    lens.camera.aperture_radius = 0.1;
    let mut two_sided = plain();
    two_sided.materials[0].two_sided_emission = true;
    let mut veil = plain();
    veil.materials[2].opacity = 0.5;
    let textured = Scattering::Diffuse { albedo: Spectrum::ONE, map: texture([0.2, 0.8]) };
    let sky = LightSource::Environment { color: Spectrum::ONE, image: None };
    let glass = Scattering::Dielectric { ior: 1.5, alpha_x: 0.0, alpha_y: 0.0 };
    vec![
        (Effect::LightSubpaths, with_cube(mirror()), "light_subpaths", "cube"),
        (Effect::Caustics, with_cube(mirror()), "light_image", "cube"),
        (Effect::Sdg, with_cube(metal(1e-3, 1e-3)), "hrr", "cube"),
        (Effect::Sds, lit(with_cube(mirror()), lamp_without_size()), "merging", "cube"),
        (Effect::Specular, with_cube(mirror()), "delta_lobes", "cube"),
        (Effect::Refraction, with_cube(glass), "transmission", "cube"),
        (Effect::Opacity, veil, "any_hit_filter", "cube"),
        (Effect::Textures, with_cube(textured), "texture_lookups", "cube"),
        (
            Effect::EmissionTextures,
            mapped(Maps { emission: texture([0.5, 1.0]), ..Maps::default() }),
            "emission_lookups",
            "lamp",
        ),
        (
            Effect::NormalMaps,
            mapped(Maps { normal: texture([0.6, 0.7]), ..Maps::default() }),
            "tangent_frames",
            "lamp",
        ),
        (Effect::Anisotropy, with_cube(metal(1e-3, 1e-2)), "ellipsoids", "cube"),
        (Effect::Environment, lit(plain(), sky), "sky_sampling", ""),
        (Effect::Lens, lens, "lens_sampling", ""),
        (Effect::TwoSidedEmission, two_sided, "two_sided_emission", "lamp"),
    ]
}

#[test]
fn every_effect_is_found_where_it_is_and_nowhere_else() {
    let nothing = analyze(&plain(), &settings());
    let bare = planned(&plain(), &settings()).unwrap();
    assert_eq!((bare.integrator, &bare.machinery[..]), (Integrator::Pt, &["eye_subpaths", "next_event"][..]));
    for effect in [Effect::Direct, Effect::Interreflection] {
        assert_eq!(nothing.of(effect).verdict, Verdict::Wanted, "{effect}");
    }
    for (effect, scene, machinery, witness) in rows() {
        let expected = if effect == Effect::LightSubpaths { Verdict::Inert } else { Verdict::Absent };
        assert_eq!(nothing.of(effect).verdict, expected, "{effect} in the plain scene");
        let found = analyze(&scene, &settings());
        assert_eq!(found.of(effect).verdict, Verdict::Wanted, "{effect}");
        let materials: Vec<_> = found.of(effect).materials.iter().map(|w| w.material.as_str()).collect();
        assert_eq!(materials.join(" "), witness, "{effect}");
        let plan = planned(&scene, &settings()).unwrap();
        assert!(plan.machinery.contains(&machinery), "{effect}: {plan:?}");
        assert!(!bare.machinery.contains(&machinery) && !plan.is_biased(), "{effect}");
    }
    // Neither light nor a second surface, neither depth.
    let mut dark = plain();
    dark.materials[0].emission = Spectrum::ZERO;
    assert_eq!(analyze(&dark, &settings()).of(Effect::Direct).verdict, Verdict::Absent);
    let mut alone = plain();
    alone.mesh = Mesh::default();
    cube(&mut alone.mesh, 0.3, Vec3::ZERO, 2);
    alone.lights.push(LightSource::Environment { color: Spectrum::ONE, image: None });
    let found = analyze(&alone, &settings());
    assert_eq!(found.of(Effect::Interreflection).verdict, Verdict::Absent, "a convex body");
    // From inside, it does light itself.
    alone.camera.origin = DVec3::splat(0.1);
    assert_eq!(analyze(&alone, &settings()).of(Effect::Interreflection).verdict, Verdict::Wanted);
    let shallow = analyze(&plain(), &Settings { max_depth: 2, ..settings() });
    assert_eq!(shallow.of(Effect::Interreflection).verdict, Verdict::Absent);
    // What no triangle uses does not count; nor does a mirror that reflects nothing.
    let mut unused = plain();
    unused.materials.push(Material::new("mirror", mirror()));
    let black = with_cube(Scattering::Mirror { reflectance: Spectrum::ZERO });
    for scene in [unused, black] {
        assert_eq!(planned(&scene, &settings()).unwrap().integrator, Integrator::Pt);
    }
}

#[test]
fn the_plan_is_the_least_that_finds_the_light() {
    for (scene, integrator) in [
        (plain(), Integrator::Pt),
        (with_cube(mirror()), Integrator::LvcSds),
        (with_cube(metal(1e-3, 1e-3)), Integrator::LvcHrr),
        (with_cube(metal(1e-6, 1e-6)), Integrator::LvcHrr),
        // As good as diffuse.
        (with_cube(metal(0.5, 0.5)), Integrator::Pt),
        (lit(with_cube(mirror()), lamp_without_size()), Integrator::LvcSds),
        (lit(with_cube(metal(1e-3, 1e-3)), lamp_without_size()), Integrator::LvcHrr),
    ] {
        assert_eq!(planned(&scene, &settings()).unwrap().integrator, integrator);
    }
    let asked = |list: &str| Settings { with: list.parse().unwrap(), ..settings() };
    assert_eq!(planned(&plain(), &asked("sds")).unwrap().integrator, Integrator::LvcSds);
    assert_eq!(planned(&plain(), &asked("sdg")).unwrap().integrator, Integrator::LvcHrr);
    assert_eq!(planned(&plain(), &asked("caustics")).unwrap().integrator, Integrator::Lvc);
}
