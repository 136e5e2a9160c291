//! The project's own scenes.

use glam::DVec3;
use hrr::material::Scattering;
use hrr::scene::Scene;
use std::path::Path;

#[allow(dead_code)]
#[path = "../../examples/make_scenes/main.rs"]
mod make_scenes;

#[test]
fn the_scenes_are_what_their_generator_makes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for (name, text) in make_scenes::files() {
        let committed = std::fs::read_to_string(folder.join(&name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(committed == text, "{name} differs: run `cargo run --example make_scenes`");
        assert!(text.len() < 2_000_000, "{name} is too large");
    }
}

#[test]
fn the_scenes_load_without_a_warning() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for (name, triangles) in [
        ("cornell", 36),
        ("caustic_mirror", 5530),
        ("caustic_mirror_aniso", 5530),
        ("glass_caustic", 20214),
        ("mirror_room", 13056),
        ("brushed_funnel", 7364),
        ("glossy_corridor", 13020),
    ] {
        let scene = Scene::load(&folder.join(name).join("scene.toml"), &[]).unwrap();
        assert_eq!(scene.warnings, [""; 0], "{name}");
        assert_eq!(scene.mesh.triangles.len(), triangles, "{name}");
        scene.mesh.validate().unwrap();
        // The lamp shines into the scene.
        let lamp = (0..triangles as u32)
            .find(|&t| scene.materials[scene.mesh.materials[t as usize] as usize].emits());
        assert!(scene.mesh.scaled_normal(lamp.unwrap()).y < 0.0, "{name}");
        // Bare, it means the same but for the view.
        let bare = Scene::load(&folder.join(name).join("scene.obj"), &[]).unwrap();
        assert_eq!(bare.mesh.triangles, scene.mesh.triangles);
        assert_eq!(bare.warnings, [""; 0], "{name}");
    }
}

#[test]
fn the_mirrors_are_as_glossy_as_they_say() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for (name, alpha) in [
        ("caustic_mirror", [1e-4, 1e-4]),
        ("caustic_mirror_aniso", [1e-4, 1e-2]),
        ("glass_caustic", [1e-4, 1e-4]),
        ("mirror_room", [1e-4, 1e-4]),
    ] {
        for file in ["scene.toml", "scene.obj"] {
            let scene = Scene::load(&folder.join(name).join(file), &[]).unwrap();
            let index = scene.materials.iter().position(|m| m.name == "mirror").unwrap();
            let Scattering::Conductor { alpha_x, alpha_y, .. } = *scene.materials[index].scattering() else {
                panic!("{name}")
            };
            assert_eq!([alpha_x, alpha_y], alpha, "{name}/{file}");
            // Its u direction, which alpha_x belongs to, is horizontal.
            let t = scene.mesh.materials.iter().position(|&m| m as usize == index).unwrap() as u32;
            let point = hrr::geometry::SurfacePoint::at_barycentric(&scene.mesh, t, 0.2, 0.3);
            let frame = point.shading(&scene.mesh).frame;
            assert!((frame.x - DVec3::X).length() < 1e-5, "{name}: {frame:?}");
            assert!(frame.z.z > 0.9);
        }
    }
}
