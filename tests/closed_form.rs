//! Scenes whose radiance is known, by every integrator with the best backend and some with the others; by all with all:
//! `cargo test -- --ignored closed_form`.

use crate::support::estimate::estimate;
use crate::support::scenes::{cube, in_memory, quad};
use glam::{DQuat, DVec3, Vec3};
use hrr::bsdf::Reflectance;
use hrr::geometry::Mesh;
use hrr::light::LightSource;
use hrr::material::{Material, Scattering};
use hrr::math::Spectrum;
use hrr::scene::Scene;
use hrr::settings::{Backend, Integrator, Settings};
use std::f64::consts::FRAC_1_PI;

/// Asserts that the image's mean is `radiance` within half a percent, and within its noise.
fn assert_radiance(name: &str, scene: &Scene, settings: &Settings, radiance: f64) {
    let settings = Settings { max_depth: 24, ..settings.clone() };
    let e = estimate(scene, &settings, 8);
    let pixels = f64::from(scene.film.width * scene.film.height);
    let (mean, sigma) = (e.total.x / pixels, e.total_variance.x.sqrt() / pixels);
    let what = format!("{name}, {}, {}", settings.integrator, settings.visibility);
    println!("{what}: {mean:.6} +- {sigma:.6}, expected {radiance:.6}");
    assert!((mean / radiance - 1.0).abs() < 0.005, "{what}: {mean}, not {radiance}");
    // Some of these are exact but for the film's f32 and rounding.
    assert!(
        (mean - radiance).abs() < 4.5 * sigma + 1e-6 * radiance,
        "{what}: {mean}, not {radiance} +- {sigma}"
    );
}

/// How much is rendered.
#[derive(Clone, Copy, PartialEq)]
enum Extent {
    /// Every integrator with the best backend, these with the others.
    Quick,
    /// Every integrator with every backend.
    Full,
}

const WITH_OTHERS: [Integrator; 3] = [Integrator::Pt, Integrator::LvcHrr, Integrator::PcvcmHrr];

/// Every integrator but those of `without`.
fn check(
    extent: Extent,
    name: &str,
    scene: &Scene,
    settings: &Settings,
    without: &[Integrator],
    radiance: f64,
) {
    for visibility in Backend::ALL {
        if cfg!(feature = "embree") || visibility != Backend::Embree {
            for integrator in Integrator::ALL {
                let wanted = extent == Extent::Full
                    || visibility == Backend::BEST
                    || WITH_OTHERS.contains(&integrator);
                if wanted && integrator != Integrator::Auto && !without.contains(&integrator) {
                    let settings = Settings { integrator, visibility, ..settings.clone() };
                    assert_radiance(name, scene, &settings, radiance);
                }
            }
        }
    }
}

fn small(mut scene: Scene) -> Scene {
    (scene.film.width, scene.film.height) = (8, 8);
    scene
}

/// The six sides of a box two metres wide, front faces inward, the left one of material `left`.
fn room(materials: [u32; 2]) -> Mesh {
    let mut mesh = Mesh::default();
    let [other, left] = materials;
    for (corners, material) in [
        ([[-1, -1, 1], [1, -1, 1], [1, -1, -1], [-1, -1, -1]], other),
        ([[-1, 1, -1], [1, 1, -1], [1, 1, 1], [-1, 1, 1]], other),
        ([[-1, -1, -1], [-1, 1, -1], [-1, 1, 1], [-1, -1, 1]], left),
        ([[1, -1, 1], [1, 1, 1], [1, 1, -1], [1, -1, -1]], other),
        ([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1]], other),
        ([[-1, -1, 1], [-1, 1, 1], [1, 1, 1], [1, -1, 1]], other),
    ] {
        quad(&mut mesh, corners, 1.0, Vec3::ZERO, material);
    }
    mesh
}

fn lit(name: &str, scattering: Scattering, emission: f64) -> Material {
    let mut material = Material::new(name, scattering);
    material.emission = Spectrum::splat(emission);
    material
}

fn diffuse(albedo: f64) -> Scattering {
    Scattering::Diffuse { albedo: Spectrum::splat(albedo), map: None }
}

/// Walls that all emit 1 and reflect one half, diffuse ones and a mirror: everything has radiance 1 + 1/2 + 1/4 ...
fn furnace(extent: Extent) {
    let mirror = Scattering::Mirror { reflectance: Spectrum::splat(0.5) };
    for (name, left) in [("diffuse furnace", diffuse(0.5)), ("furnace with a mirror", mirror)] {
        let materials = vec![lit("wall", diffuse(0.5), 1.0), lit("left", left, 1.0)];
        let scene = in_memory(room([0, 1]), materials, DVec3::new(0.3, 0.1, 0.8), DVec3::NEG_X, 60.0);
        let settings = Settings { iterations: 64, samples: 64, merge_radius: 0.01, ..Settings::default() };
        // What comes by way of the mirror, light tracing does not see.
        let without = if name == "diffuse furnace" { &[][..] } else { &[Integrator::Lt] };
        check(extent, name, &small(scene), &settings, without, 2.0);
    }
}

/// A convex thing in surroundings of radiance 1 shows its albedo.
fn even_surroundings(extent: Extent) {
    let materials = vec![lit("sky", diffuse(0.0), 1.0), Material::diffuse("thing", Spectrum::splat(0.6))];
    let mut mesh = room([0, 0]);
    cube(&mut mesh, 0.3, Vec3::ZERO, 1);
    let scene = small(in_memory(mesh, materials, DVec3::new(0.2, 0.1, 0.9), DVec3::ZERO, 8.0));
    let settings = Settings { iterations: 64, samples: 256, ..Settings::default() };
    // What is seen under 8 degrees, too few light subpaths meet.
    check(extent, "surroundings", &scene, &settings, &[Integrator::Lt], 0.6);
}

/// Form factor of a rectangle of sides a, b at distance 1, from below one of its corners [Howell, B-3].
fn corner(a: f64, b: f64) -> f64 {
    let (p, q) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
    (a / p * (b / p).atan() + b / q * (a / q).atan()) / std::f64::consts::TAU
}

/// A lamp of one square metre a metre above a plate of albedo 0.7, whose middle the camera sees from aside.
fn plates(mesh: &mut Mesh, materials: &mut Vec<Material>) -> f64 {
    *materials = vec![Material::diffuse("plate", Spectrum::splat(0.7)), lit("lamp", diffuse(0.0), 1.0)];
    quad(mesh, [[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]], 0.5, Vec3::ZERO, 0);
    quad(mesh, [[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], 0.5, Vec3::Y, 1);
    0.7 * 4.0 * corner(0.5, 0.5)
}

fn lamp_over_a_plate(extent: Extent) {
    let (mut mesh, mut materials) = (Mesh::default(), Vec::new());
    let radiance = plates(&mut mesh, &mut materials);
    let mut scene = small(in_memory(mesh, materials, DVec3::new(2.0, 0.6, 0.0), DVec3::ZERO, 0.2));
    let settings = Settings { iterations: 64, samples: 16, ..Settings::default() };
    check(extent, "plates", &scene, &settings, &[Integrator::Lt], radiance);
    // Half of a lamp gives half of the light; a veil that stops a third takes a third of it.
    scene.materials[1].opacity = 0.5;
    scene.materials.push(Material::diffuse("veil", Spectrum::ZERO));
    scene.materials[2].opacity = 1.0 / 3.0;
    quad(&mut scene.mesh, [[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], 1.5, Vec3::Y * 0.95, 2);
    let settings = Settings { iterations: 64, samples: 64, ..Settings::default() };
    check(extent, "half a lamp behind a veil", &scene, &settings, &[Integrator::Lt], radiance / 3.0);
}

/// The same plate, seen in a mirror that also throws the lamp's image on it: light by way of the mirror arrives as if
/// from a second lamp behind it.
fn plate_in_a_mirror(extent: Extent) {
    for (name, alpha) in [("smooth mirror", 0.0), ("mirror of alpha 1e-4", 1e-4)] {
        let (mut mesh, mut materials) = (Mesh::default(), Vec::new());
        let direct = plates(&mut mesh, &mut materials);
        let white = Reflectance::Schlick { f0: Spectrum::ONE };
        let scattering = Scattering::Conductor { reflectance: white, alpha_x: alpha, alpha_y: alpha };
        materials.push(Material::new("mirror", scattering));
        let at = Vec3::new(-1.5, 0.5, 0.0);
        quad(&mut mesh, [[0, -1, -1], [0, 1, -1], [0, 1, 1], [0, -1, 1]], 1.0, at, 2);
        let second = 0.7 * 2.0 * (corner(3.5, 0.5) - corner(2.5, 0.5));
        let scene =
            small(in_memory(mesh, materials, DVec3::new(1.0, 0.8, 0.0), DVec3::new(-3.0, 0.0, 0.0), 0.2));
        let settings =
            Settings { iterations: 96, samples: 64, light_subpaths: 20_000, ..Settings::default() };
        check(extent, name, &scene, &settings, &[Integrator::Lt], direct + second);
    }
}

/// A plate of albedo 0.7, whose middle the camera sees from aside, and nothing else.
fn plate(lights: Vec<LightSource>) -> Scene {
    let mut mesh = Mesh::default();
    quad(&mut mesh, [[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]], 0.5, Vec3::ZERO, 0);
    let materials = vec![Material::diffuse("plate", Spectrum::splat(0.7))];
    let mut scene = small(in_memory(mesh, materials, DVec3::new(2.0, 0.6, 0.0), DVec3::ZERO, 0.005));
    scene.lights = lights;
    scene
}

/// Lamps at (0.3, 0.4, 0), half a metre from the plate's middle, and parallel light from there, all at a cosine of 0.8.
fn lamps_without_size(extent: Extent) {
    let position = DVec3::new(0.3, 0.4, 0.0);
    let direction = -position.normalize();
    let intensity = Spectrum::splat(2.0);
    let by_lamp = 0.7 * FRAC_1_PI * 2.0 * 0.8 / 0.25;
    // The middle lies off the spot's axis, where three quarters of the way in the cosine give 27/32.
    let axis = DQuat::from_rotation_z(0.3) * direction;
    let (inner, outer) = ((0.3f64.cos() + 0.03).acos(), (0.3f64.cos() - 0.09).acos());
    // Merging takes a share of the light that it seldom finds: here nearly none.
    let settings = Settings { iterations: 16, samples: 16, merge_radius: 1e-8, ..Settings::default() };
    for (name, light, radiance) in [
        ("point", LightSource::Point { position, intensity }, by_lamp),
        (
            "spot",
            LightSource::Spot { position, direction: axis, intensity, inner, outer },
            by_lamp * 27.0 / 32.0,
        ),
        ("sun", LightSource::Directional { direction, irradiance: intensity }, 0.7 * FRAC_1_PI * 2.0 * 0.8),
    ] {
        check(extent, name, &plate(vec![light]), &settings, &[Integrator::Lt], radiance);
    }
    // And together.
    let all = vec![
        LightSource::Point { position, intensity },
        LightSource::Directional { direction, irradiance: intensity },
        LightSource::Environment { color: Spectrum::ONE, image: None },
    ];
    let radiance = by_lamp + 0.7 * FRAC_1_PI * 2.0 * 0.8 + 0.7;
    for integrator in [Integrator::Pt, Integrator::LvcHrr] {
        let settings = Settings { integrator, iterations: 64, samples: 256, ..settings.clone() };
        assert_radiance("all lights", &plate(all.clone()), &settings, radiance);
    }
}

/// In a sky of radiance 1 a convex thing shows its albedo, and clear glass shows the sky.
fn even_sky(extent: Extent) {
    let glass = Scattering::Dielectric { ior: 1.5, alpha_x: 0.0, alpha_y: 0.0 };
    let thing =
        [(Material::diffuse("thing", Spectrum::splat(0.6)), 0.6), (Material::new("thing", glass), 1.0)];
    for (material, radiance) in thing {
        let mut mesh = Mesh::default();
        cube(&mut mesh, 0.3, Vec3::ZERO, 0);
        let mut scene = small(in_memory(mesh, vec![material], DVec3::new(0.2, 0.1, 0.9), DVec3::ZERO, 8.0));
        scene.lights = vec![LightSource::Environment { color: Spectrum::ONE, image: None }];
        let settings = Settings { iterations: 64, samples: 64, merge_radius: 1e-4, ..Settings::default() };
        check(extent, "sky", &scene, &settings, &[Integrator::Lt], radiance);
        // Seen from aside of the thing, the sky is itself.
        scene.camera.target = DVec3::new(0.2, 2.0, 0.9);
        scene.camera.up = DVec3::X;
        let settings = Settings { iterations: 4, ..settings };
        check(extent, "the sky itself", &scene, &settings, &[], 1.0);
    }
}

#[test]
fn a_furnace_is_evenly_bright() {
    furnace(Extent::Quick);
}

#[test]
fn even_surroundings_show_the_albedo() {
    even_surroundings(Extent::Quick);
}

#[test]
fn a_lamp_over_a_plate_has_its_form_factor() {
    lamp_over_a_plate(Extent::Quick);
}

#[test]
fn a_mirror_shows_the_plate_and_the_lamps_second_light() {
    plate_in_a_mirror(Extent::Quick);
}

#[test]
fn lamps_without_size_light_a_plate() {
    lamps_without_size(Extent::Quick);
}

#[test]
fn an_even_sky_shows_the_albedo_and_fills_glass() {
    even_sky(Extent::Quick);
}

#[test]
#[ignore = "several minutes"]
fn every_integrator_with_every_backend() {
    let scenes =
        [furnace, even_surroundings, lamp_over_a_plate, plate_in_a_mirror, lamps_without_size, even_sky];
    scenes.into_iter().for_each(|scene| scene(Extent::Full));
}
