//! Scenes of the tests: the project's own at any size, and small ones made in memory.

use glam::{DVec2, DVec3, Vec3};
use hrr::bsdf::Reflectance;
use hrr::camera::CameraSettings;
use hrr::film::FilmSettings;
use hrr::geometry::Mesh;
use hrr::image::Image;
use hrr::light::LightSource;
use hrr::material::{Maps, Material, Scattering};
use hrr::math::Spectrum;
use hrr::scene::Scene;
use hrr::settings::Settings;
use hrr::texture::Texture;
use std::path::Path;
use std::sync::Arc;

/// A scene of the project with some keys changed.
pub fn load(name: &str, overrides: &[(&str, &str)]) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name).join("scene.toml");
    let overrides: Vec<_> = overrides.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    Scene::load(&path, &overrides).unwrap()
}

/// Default settings, but that the roulette plays on the rougher metals of these scenes too.
pub fn settings() -> Settings {
    Settings { hrr_alpha: 0.3, ..Settings::default() }
}

/// The inside of a box, two metres wide, with a side for every kind of material and a lamp under the ceiling.
pub fn box_of_everything() -> Scene {
    let gold = Reflectance::Schlick { f0: Spectrum::new(0.9, 0.7, 0.3) };
    let conductor = |alpha_x, alpha_y| Scattering::Conductor { reflectance: gold, alpha_x, alpha_y };
    let mut lamp = Material::diffuse("lamp", Spectrum::splat(0.5));
    lamp.emission = Spectrum::new(9.0, 8.0, 7.0);
    let mut turned = Material::new("brushed", conductor(0.05, 0.25));
    turned.tangent_angle = 0.6;
    let materials = vec![
        Material::diffuse("white", Spectrum::splat(0.8)),
        Material::new("rough metal", conductor(0.2, 0.2)),
        turned,
        Material::new("mirror", Scattering::Mirror { reflectance: Spectrum::splat(0.9) }),
        Material::new("glass", Scattering::Dielectric { ior: 1.5, alpha_x: 0.0, alpha_y: 0.0 }),
        Material::new("frosted", Scattering::Dielectric { ior: 1.5, alpha_x: 0.2, alpha_y: 0.2 }),
        lamp,
        Material::new(
            "varnish",
            Scattering::Coated {
                albedo: Spectrum::new(0.3, 0.5, 0.7),
                map: None,
                f0: Spectrum::splat(0.2),
                alpha_x: 0.15,
                alpha_y: 0.1,
            },
        ),
    ];
    let mut mesh = Mesh::default();
    // Floor, ceiling, left, right, back; front faces inward.
    quad(&mut mesh, [[-1, -1, 1], [1, -1, 1], [1, -1, -1], [-1, -1, -1]], 1.0, Vec3::ZERO, 0);
    quad(&mut mesh, [[-1, 1, -1], [1, 1, -1], [1, 1, 1], [-1, 1, 1]], 1.0, Vec3::ZERO, 1);
    quad(&mut mesh, [[-1, -1, -1], [-1, 1, -1], [-1, 1, 1], [-1, -1, 1]], 1.0, Vec3::ZERO, 2);
    quad(&mut mesh, [[1, -1, 1], [1, 1, 1], [1, 1, -1], [1, -1, -1]], 1.0, Vec3::ZERO, 3);
    quad(&mut mesh, [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1]], 1.0, Vec3::ZERO, 7);
    quad(&mut mesh, [[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], 0.4, Vec3::new(0.0, 0.9, 0.0), 6);
    cube(&mut mesh, 0.3, Vec3::new(-0.5, -0.6, 0.1), 4);
    cube(&mut mesh, 0.25, Vec3::new(0.5, -0.6, -0.2), 5);
    in_memory(mesh, materials, DVec3::new(0.1, 0.0, 2.6), DVec3::new(0.0, -0.1, 0.0), 60.0)
}

/// The same box with what varies over its surfaces: a smooth coat on the floor, uneven roughness and bent normals on the
/// walls, a cube that is half there and one with holes, and a patterned lamp with holes.
pub fn box_of_textures() -> Scene {
    let mut scene = box_of_everything();
    let map = |pixels: [[f32; 3]; 4]| {
        let pixels = pixels.map(Vec3::from).to_vec();
        Some(Texture::new(Arc::new(Image { width: 2, height: 2, pixels }), DVec2::splat(2.0), DVec2::ZERO))
    };
    let grey = |a: f32, b: f32| map([[a; 3], [b; 3], [b; 3], [a; 3]]);
    let m = &mut scene.materials;
    let coat = Scattering::Coated {
        albedo: Spectrum::splat(0.6),
        map: grey(1.0, 0.5),
        f0: Spectrum::splat(0.15),
        alpha_x: 0.0,
        alpha_y: 0.0,
    };
    m[0] = Material::new("coat", coat);
    m[1].set_maps(Maps { roughness: grey(1.0, 0.8), ..Maps::default() });
    let bumps = [[0.5, 0.5, 1.0], [0.7, 0.5, 0.9], [0.5, 0.3, 0.9], [0.4, 0.6, 0.9]];
    m[2].set_maps(Maps { normal: map(bumps), ..Maps::default() });
    m[4] = Material::diffuse("half there", Spectrum::new(0.7, 0.3, 0.3));
    m[4].opacity = 0.5;
    m[5].set_maps(Maps { opacity: grey(1.0, 0.0), ..Maps::default() });
    m[6].set_maps(Maps { emission: grey(1.5, 0.2), opacity: grey(0.4, 1.0), ..Maps::default() });
    scene
}

/// A floor of glossy tiles, isotropic, brushed, varnished and rough, before a white wall, under a grid of `across` x
/// `across` lamps of 1 cm that shine downwards.
pub fn lamps_over_a_glossy_floor(across: u32) -> Scene {
    let silver = Reflectance::Schlick { f0: Spectrum::splat(0.8) };
    let metal = |alpha_x, alpha_y| Scattering::Conductor { reflectance: silver, alpha_x, alpha_y };
    let varnish = Scattering::Coated {
        albedo: Spectrum::new(0.2, 0.4, 0.6),
        map: None,
        f0: Spectrum::splat(0.08),
        alpha_x: 0.06,
        alpha_y: 0.03,
    };
    let mut brushed = Material::new("brushed", metal(0.02, 0.2));
    brushed.tangent_angle = 0.5;
    let mut lamp = Material::diffuse("lamp", Spectrum::ZERO);
    // Whatever their number, the same light.
    lamp.emission = Spectrum::new(1.0, 0.9, 0.8) * (2e4 / f64::from(across * across));
    let materials = vec![
        Material::diffuse("white", Spectrum::splat(0.7)),
        Material::new("polished", metal(0.02, 0.02)),
        brushed,
        Material::new("varnished", varnish),
        Material::new("rough", metal(0.2, 0.2)),
        lamp,
    ];
    let mut mesh = Mesh::default();
    for tile in 0..16u32 {
        let (column, row) = (tile % 4, tile / 4);
        let center = Vec3::new(column as f32 - 1.5, 0.0, row as f32 - 1.5) * 0.5;
        let material = 1 + (column + row) % 4;
        quad(&mut mesh, [[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]], 0.25, center, material);
    }
    quad(&mut mesh, [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], 1.0, Vec3::new(0.0, 1.0, -1.0), 0);
    for i in 0..across * across {
        let at = |i: u32| ((i as f32 + 0.5) / across as f32 - 0.5) * 1.8;
        let center = Vec3::new(at(i % across), 1.2, at(i / across));
        quad(&mut mesh, [[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], 0.005, center, 5);
    }
    in_memory(mesh, materials, DVec3::new(0.3, 0.9, 2.2), DVec3::new(0.0, 0.1, 0.0), 45.0)
}

/// Five booths with walls between them and a lamp in each, one that shines upwards as well, over floors that are white, polished,
/// of glass, varnished and rough.
pub fn lamps_in_booths() -> Scene {
    let Scene { mut materials, .. } = lamps_over_a_glossy_floor(1);
    materials[2] = Material::new("glass", Scattering::Dielectric { ior: 1.5, alpha_x: 0.2, alpha_y: 0.2 });
    materials[5].emission = Spectrum::new(60.0, 50.0, 40.0);
    let mut both = materials[5].clone();
    both.two_sided_emission = true;
    materials.push(both);
    let mut mesh = Mesh::default();
    for booth in 0..5u32 {
        let middle = Vec3::new(booth as f32 - 2.0, 0.0, 0.0) * 0.6;
        quad(&mut mesh, [[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]], 0.3, middle, booth);
        let wall = middle + Vec3::new(0.3, 0.3, 0.0);
        quad(&mut mesh, [[0, -1, 1], [0, -1, -1], [0, 1, -1], [0, 1, 1]], 0.3, wall, 0);
        let lamp = middle + Vec3::new(0.1, 0.45, -0.05);
        let material = if booth == 3 { 6 } else { 5 };
        quad(&mut mesh, [[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], 0.04, lamp, material);
    }
    quad(&mut mesh, [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], 1.5, Vec3::new(0.0, 1.0, -0.3), 0);
    quad(&mut mesh, [[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]], 1.5, Vec3::new(0.0, -0.3, 0.0), 0);
    in_memory(mesh, materials, DVec3::new(0.3, 1.2, 2.9), DVec3::new(0.0, 0.1, 0.0), 50.0)
}

/// A point and a spot light in the box, a sun and an uneven sky in front of it.
pub fn lights_of_every_kind() -> Vec<LightSource> {
    let sky = |i: u32| Vec3::splat(0.2 + (i % 7) as f32 * 0.3) * Vec3::new(1.0, 1.2, 1.5);
    let image = Image { width: 16, height: 8, pixels: (0..16 * 8).map(sky).collect() };
    vec![
        LightSource::Point { position: DVec3::new(0.6, 0.3, 0.4), intensity: Spectrum::new(0.5, 0.4, 0.3) },
        LightSource::Spot {
            position: DVec3::new(-0.2, 0.5, 0.6),
            direction: DVec3::new(-0.3, -1.0, -0.5).normalize(),
            intensity: Spectrum::new(1.0, 2.0, 1.0),
            inner: 0.4,
            outer: 0.7,
        },
        LightSource::Directional {
            direction: DVec3::new(-0.2, -0.4, -1.0).normalize(),
            irradiance: Spectrum::new(1.0, 0.9, 0.8),
        },
        LightSource::Environment { color: Spectrum::splat(0.8), image: Some(Arc::new(image)) },
    ]
}

/// A scene of 32x32 pixels, as loaded from nowhere.
pub fn in_memory(mesh: Mesh, materials: Vec<Material>, origin: DVec3, target: DVec3, fov_y: f64) -> Scene {
    Scene {
        path: "memory".into(),
        mesh,
        materials,
        lights: Vec::new(),
        camera: CameraSettings { origin, target, fov_y, ..CameraSettings::default() },
        film: FilmSettings { width: 32, height: 32, ..FilmSettings::default() },
        settings: Settings::default(),
        warnings: Vec::new(),
        hash: 0,
    }
}

/// A quadrilateral, counter-clockwise seen from its front.
pub fn quad(mesh: &mut Mesh, corners: [[i8; 3]; 4], scale: f32, center: Vec3, material: u32) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(corners.map(|c| center + scale * Vec3::from(c.map(f32::from))));
    mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    mesh.materials.extend([material; 2]);
}

pub fn cube(mesh: &mut Mesh, half: f32, center: Vec3, material: u32) {
    for axis in 0..3 {
        for side in [-1i8, 1] {
            let corner = |u: i8, v: i8| {
                let mut c = [0; 3];
                (c[axis], c[(axis + 1) % 3], c[(axis + 2) % 3]) = (side, u * side, v);
                c
            };
            quad(mesh, [corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)], half, center, material);
        }
    }
}
