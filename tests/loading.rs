//! Scenes from files: every way in which a file can be wrong is an error or a warning with its file and line, and
//! what is right arrives as it was meant.

use glam::{DVec2, DVec3};
use hrr::bsdf::Reflectance;
use hrr::film::Filter;
use hrr::material::Scattering;
use hrr::scene::Scene;
use hrr::settings::Integrator;
use hrr::{Error, Result};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

#[allow(dead_code)]
#[path = "../examples/make_scenes/main.rs"]
mod make_scenes;

/// A triangle in the plane z = 0, its front towards +z.
const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
const LAMP: &str = "newmtl lamp\nKe 1 1 1\n";

/// Files in a folder of their own.
struct Files(TempDir);

impl Files {
    fn new(files: &[(&str, &str)]) -> Self {
        let folder = Self(TempDir::new().unwrap());
        for (name, text) in files {
            folder.write(name, text.as_bytes());
        }
        folder
    }

    fn write(&self, name: &str, bytes: &[u8]) {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Loads one of them with `-D` flags.
    fn load(&self, name: &str, flags: &[(&str, &str)]) -> Result<Scene> {
        let flags: Vec<_> = flags.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
        Scene::load(&self.path(name), &flags)
    }

    /// An error's text without the folder's name.
    fn message(&self, e: &Error) -> String {
        e.to_string().replace(&format!("{}/", self.0.path().display()), "")
    }

    fn warnings(&self, scene: &Scene) -> Vec<String> {
        scene.warnings.iter().map(|w| w.replace(&format!("{}/", self.0.path().display()), "")).collect()
    }
}

/// The text of the error, of exit code 3, that an OBJ file gives.
fn obj_error(text: &str) -> String {
    let files = Files::new(&[("s.obj", text)]);
    let e = files.load("s.obj", &[]).unwrap_err();
    assert!(matches!(e, Error::Scene { .. }) && e.exit_code() == 3, "{e:?}");
    files.message(&e)
}

/// A scene of faces (after `TRIANGLE`) that use the materials of an MTL text; a lamp comes with it.
fn with_mtl(mtl: &str, faces: &str) -> (Files, Result<Scene>) {
    let obj = format!("mtllib s.mtl lamp.mtl\n{TRIANGLE}usemtl lamp\nf 1 2 3\n{faces}");
    let files = Files::new(&[("s.obj", &obj), ("s.mtl", mtl), ("lamp.mtl", LAMP)]);
    let scene = files.load("s.obj", &[]);
    (files, scene)
}

/// The first material of an MTL text, with the warnings that it gives.
fn material(mtl: &str) -> (hrr::material::Material, Vec<String>) {
    let (files, scene) = with_mtl(mtl, "");
    let scene = scene.unwrap_or_else(|e| panic!("{mtl}: {e}"));
    (scene.materials[0].clone(), files.warnings(&scene))
}

fn scattering(mtl: &str) -> Scattering {
    let (m, warnings) = material(mtl);
    assert_eq!(warnings, [""; 0], "{mtl}");
    m.scattering
}

/// A TOML scene around a triangle that emits.
fn toml_scene(toml: &str) -> Files {
    let obj = format!("mtllib s.mtl\n{TRIANGLE}usemtl lamp\nf 1 2 3\n");
    Files::new(&[("s.toml", toml), ("s.obj", &obj), ("s.mtl", LAMP)])
}

fn toml_error(toml: &str) -> (String, u8) {
    let files = toml_scene(toml);
    let e = files.load("s.toml", &[]).unwrap_err();
    (files.message(&e), e.exit_code())
}

const OBJ_LINE: &str = "obj = [\"s.obj\"]\n";

// ---- OBJ ----

#[test]
fn broken_obj_lines_are_named() {
    for (line, message) in [
        ("v 1 2", "a vertex has 3 coordinates; this line has 2"),
        ("v 1 2 3 4 5", "a vertex has 3 coordinates; this line has 5"),
        ("v 1 2 x", "'x' in v is not a number"),
        ("v 1 nan 3", "v holds NaN; coordinates must be finite"),
        ("v 1 2 -inf", "v holds -inf; coordinates must be finite"),
        ("v 1 2 1e19", "coordinate 1e19 is out of range (at most 1.844e18)"),
        ("vn 1 2", "vn takes 3 numbers; this line has 2"),
        ("vn nan 0 0", "vn holds NaN; coordinates must be finite"),
        ("vt", "vt takes 1 to 3 numbers; this line has 0"),
        ("f 1 2", "a face has at least 3 corners; this line has 2"),
        ("f 1 2 4", "there is no vertex 4: 3 of them come before this line"),
        ("f 1 2 0", "there is no vertex 0: 3 of them come before this line"),
        ("f -1 -2 -4", "there is no vertex -4: 3 of them come before this line"),
        ("f 1 2 99999999999999999999", "'99999999999999999999' is not an index"),
        ("f 1/1 2/1 3/1", "there is no texture coordinate 1: 0 of them come before this line"),
        ("f 1//1 2//1 3//1", "there is no normal 1: 0 of them come before this line"),
        ("f 1 2 a", "'a' is not an index"),
        ("f 1 2 /3", "'/3' is not a corner of a face"),
        ("f 1///1 2 3", "'1///1' is not a corner of a face"),
        ("usemtl", "usemtl without the name of a material"),
        ("mtllib", "mtllib without the name of a file"),
    ] {
        let text = format!("# comment\n{TRIANGLE}{line}\nf 1 2 3\n");
        assert_eq!(obj_error(&text), format!("s.obj:5: {message}"));
    }
    let mixed = format!("{TRIANGLE}vn 0 0 1\nf 1//1 2 3\n");
    assert_eq!(obj_error(&mixed), "s.obj:5: corner '2' has other indices than the corners before it");
}

#[test]
fn missing_files_are_named() {
    let files = Files::new(&[]);
    for name in ["no.obj", "no.toml"] {
        let e = files.load(name, &[]).unwrap_err();
        assert!(files.message(&e).starts_with(&format!("{name}: cannot be read: ")), "{e}");
        assert_eq!(e.exit_code(), 3);
    }
    let e = files.load("scene.blend", &[]).unwrap_err();
    assert_eq!(files.message(&e), "scene.blend: is neither a .toml scene nor an .obj file");

    let message = obj_error(&format!("{TRIANGLE}mtllib no.mtl\nf 1 2 3\n"));
    assert!(message.starts_with("s.obj:4: material library 'no.mtl' cannot be read: "), "{message}");
    let (message, code) = toml_error("# one\nobj = [\"s.obj\",\n \"no.obj\"]\n");
    assert_eq!((message.as_str(), code), ("s.toml:3: there is no file 'no.obj'", 3));
}

#[test]
fn a_scene_without_triangles_is_refused() {
    assert_eq!(obj_error("# nothing\nv 0 0 0\n"), "s.obj: the scene has no triangles");
    assert_eq!(obj_error(""), "s.obj: the scene has no triangles");
    assert_eq!(obj_error("v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\n"), "s.obj: the scene has no triangles");
    let missing = "s.toml: no geometry: obj = [\"scene.obj\"] is missing";
    assert_eq!(toml_error("[film]\nwidth = 4\n"), (missing.into(), 3));
    assert_eq!(toml_error("obj = []\n"), (missing.into(), 3));
}

#[test]
fn garbage_does_not_panic() {
    let files = Files::new(&[]);
    files.write(
        "s.obj",
        &(0..4096u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect::<Vec<_>>(),
    );
    assert!(files.load("s.obj", &[]).is_err());
    files.write("s.toml", &[0xff, 0xfe, 0]);
    let e = files.load("s.toml", &[]).unwrap_err();
    assert_eq!(files.message(&e), "s.toml: is not text (UTF-8)");
}

/// Any damage to good files is an error or a warning.
#[test]
fn damaged_files_do_not_panic() {
    use proptest::prelude::*;
    let obj = "mtllib s.mtl\no a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0.5\nvt 0 0\nvt 1 0\nvn 0 0 1\nusemtl lamp\n\
               f 1/1/1 2/2/1 3/1/1\nf -1 -2 -3 -4\nusemtl m\nf 1//1 \\\n2//1 3//1\ns off\n";
    let mtl = "newmtl lamp\nKe 1 1 1\nnewmtl m\nKd 0.5 0.5 0.5\nKs 1 1 1\nPr 0.1\naniso 0.5\nillum 7\nTf 1 0 0\nd 0.5\n";
    let toml = "obj = [\"s.obj\"]\n[camera]\norigin = [0, 0, 3]\ntarget = [0, 0, 0]\nfov_y = 30.0\n[film]\nwidth = 8\n\
                height = 8\n[render]\nseed = 1\n[material.m]\ntype = \"conductor\"\nreflectance = 0.5\nalpha = [0.1, 0.2]\n";
    let files = Files::new(&[]);
    let edits =
        prop::collection::vec((0..3usize, any::<prop::sample::Index>(), 0..4usize, any::<u8>()), 1..6);
    let run = |edits: Vec<(usize, prop::sample::Index, usize, u8)>| {
        let mut texts = [obj, mtl, toml].map(|t| t.as_bytes().to_vec());
        for (file, at, cut, byte) in edits {
            // Half of what is put in belongs to numbers and indices.
            let byte = if byte < 128 { b" \n-/.0123456789e#"[byte as usize % 17] } else { byte };
            let at = at.index(texts[file].len());
            let end = (at + cut).min(texts[file].len());
            texts[file].splice(at..end, [byte]);
            if texts[file].is_empty() {
                texts[file].push(byte);
            }
        }
        for (name, text) in ["s.obj", "s.mtl", "s.toml"].iter().zip(&texts) {
            files.write(name, text);
        }
        for name in ["s.toml", "s.obj"] {
            if let Ok(scene) = files.load(name, &[]) {
                scene.mesh.validate().unwrap();
            }
        }
        Ok(())
    };
    let config = ProptestConfig { cases: 500, failure_persistence: None, ..Default::default() };
    let rng = proptest::test_runner::TestRng::deterministic_rng(config.rng_algorithm);
    proptest::test_runner::TestRunner::new_with_rng(config, rng).run(&edits, run).unwrap();
}

#[test]
fn what_can_be_mended_is_a_warning_with_its_line() {
    // Lines: 1 mtllib, 2-4 vertices, 5-6 the lamp's face.
    let faces = "f 1 1 2\nf 1 2 2\nusemtl lump\nf 1 2 3\nl 1 2 3\nwobble 1\ncstype bezier\nf 1 2 3\n";
    let (files, scene) = with_mtl("", faces);
    let scene = scene.unwrap();
    assert_eq!(
        files.warnings(&scene),
        [
            "s.obj:11: lines and points have no area and are left out",
            "s.obj:12: 'wobble' is not a statement of OBJ; the line is left out",
            "s.obj:13: curves and free-form surfaces are not rendered; export them as polygons",
            "s.obj:10: there is no material 'lump'; its faces are made a diffuse grey; did you mean 'lamp'?",
            "s.obj:7: 2 triangle(s) without area, of which this is the first, are left out",
        ]
    );
    assert_eq!(scene.mesh.triangles.len(), 3);
    let names: Vec<_> =
        scene.mesh.materials.iter().map(|&m| scene.materials[m as usize].name.as_str()).collect();
    assert_eq!(names, ["lamp", "(none)", "(none)"]);
}

#[test]
fn faces_before_any_material_are_grey() {
    let files = Files::new(&[
        ("s.obj", &format!("{TRIANGLE}\nf 1 2 3\nmtllib s.mtl\nusemtl lamp\nf 1 2 3\n")),
        ("s.mtl", LAMP),
    ]);
    let scene = files.load("s.obj", &[]).unwrap();
    assert_eq!(files.warnings(&scene), ["s.obj:5: faces before any usemtl are made a diffuse grey"]);
    let grey = &scene.materials[scene.mesh.materials[0] as usize];
    assert!(
        matches!(grey.scattering, Scattering::Diffuse { albedo, map: None } if albedo == DVec3::splat(0.5))
    );
    assert!(scene.materials[scene.mesh.materials[1] as usize].emits());
}

#[test]
fn polygons_continued_lines_and_relative_indices() {
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0 0.5 0.5 0.5\nv 0 1 0 1.0\nv 0.5 2 0\n";
    let (_, scene) = with_mtl("", &format!("{square}f -5 -4 \\\n -3 -2 # a square\nf 4 \\\n5 6\\\n 8 7\n"));
    let scene = scene.unwrap();
    assert_eq!(scene.mesh.triangles.len(), 1 + 2 + 3);
    let area: f64 = (1..3).map(|t| scene.mesh.area(t)).sum();
    assert!((area - 1.0).abs() < 1e-6, "{area}");
    for t in 0..6 {
        assert!(scene.mesh.scaled_normal(t).z > 0.0);
    }
}

#[test]
fn concave_polygons_keep_their_shape() {
    // An arrow head; the fan from its first corner would fill the notch.
    let arrow = "v 1 0 1\nv 2 2 1\nv 1 0.5 1\nv 0 2 1\nv 1 1 0\n";
    let (files, scene) = with_mtl("", &format!("{arrow}f 5 6 7 4\nf 1 8 2 3\n"));
    let scene = scene.unwrap();
    let normals = [1, 2].map(|t| scene.mesh.scaled_normal(t).z);
    assert!(normals.iter().all(|&z| z < 0.0) || normals.iter().all(|&z| z > 0.0), "{normals:?}");
    assert!((normals.iter().sum::<f64>().abs() * 0.5 - 0.5).abs() < 1e-6, "{normals:?}");
    // The second one crosses itself.
    assert_eq!(
        files.warnings(&scene),
        ["s.obj:13: the polygon crosses itself or has no area, and is cut into a fan"]
    );
}

#[test]
fn normals_and_texture_coordinates_may_be_missing_from_some_faces() {
    let faces = "vn 0 0 2\nvn 0 1 1\nvt 0.25 0.5\nvt 1 1\nvt 0.5\n\
                 f 1//1 2//1 3//2\nf 1/1 2/2 3/3\nf 1/1/1 2/2/1 3/3/2\nf 1 2 3\n";
    let (_, scene) = with_mtl("", faces);
    let mesh = scene.unwrap().mesh;
    mesh.validate().unwrap();
    assert_eq!((mesh.triangles.len(), mesh.normals.len(), mesh.uvs.len()), (5, 15, 15));
    let normal = |t: usize, k: usize| mesh.normals[mesh.triangles[t][k] as usize].as_dvec3();
    let uv = |t: usize, k: usize| mesh.uvs[mesh.triangles[t][k] as usize].as_dvec2();
    for t in [1, 3] {
        assert_eq!(normal(t, 0), DVec3::Z);
        assert!((normal(t, 2) - DVec3::new(0.0, 0.5f64.sqrt(), 0.5f64.sqrt())).length() < 1e-6);
    }
    for t in [0, 2, 4] {
        assert_eq!([0, 1, 2].map(|k| normal(t, k)), [DVec3::ZERO; 3]);
    }
    for t in [2, 3] {
        assert_eq!([0, 1, 2].map(|k| uv(t, k)), [DVec2::new(0.25, 0.5), DVec2::ONE, DVec2::new(0.5, 0.0)]);
    }
    for t in [0, 1, 4] {
        assert_eq!([0, 1, 2].map(|k| uv(t, k)), [DVec2::ZERO; 3]);
    }
}

#[test]
fn far_from_the_origin_millimetres_survive() {
    let far = 1e6;
    let text = format!(
        "mtllib s.mtl\nusemtl lamp\nv {0} {0} {0}\nv {1} {0} {0}\nv {0} {2} {0}\nf 1 2 3\n",
        far,
        far + 0.001,
        far + 2.0
    );
    let files = Files::new(&[("s.obj", &text), ("s.mtl", LAMP)]);
    let mesh = files.load("s.obj", &[]).unwrap().mesh;
    let world = |i: u32| mesh.origin + mesh.positions[i as usize].as_dvec3();
    let [a, b, c] = mesh.triangles[0].map(world);
    assert!((b - a - DVec3::X * 0.001).length() < 1e-7, "{}", b - a);
    assert!((c - a - DVec3::Y * 2.0).length() < 1e-6);
    assert!((a - DVec3::splat(far)).length() < 1e-6);
}

#[test]
fn several_obj_files_make_one_mesh() {
    let files = toml_scene("obj = [\"s.obj\", \"sub/t.obj\"]\n");
    files.write("sub/t.obj", format!("mtllib my materials.mtl\n{TRIANGLE}usemtl a b\nf 1 2 3\n").as_bytes());
    files.write("sub/my materials.mtl", b"newmtl a b\nKd 0.25 0.5 0.75\n");
    let scene = files.load("s.toml", &[]).unwrap();
    assert_eq!((scene.mesh.triangles.len(), scene.mesh.materials.clone()), (2, vec![0, 1]));
    assert_eq!(scene.materials[1].name, "a b");
    assert_eq!(scene.warnings, [""; 0]);
}

// ---- MTL ----

fn diffuse(mtl: &str) -> DVec3 {
    match scattering(mtl) {
        Scattering::Diffuse { albedo, map: None } => albedo,
        other => panic!("{mtl}: {other:?}"),
    }
}

fn conductor(mtl: &str) -> (DVec3, f64, f64) {
    match scattering(mtl) {
        Scattering::Conductor { reflectance: Reflectance::Schlick { f0 }, alpha_x, alpha_y } => {
            (f0, alpha_x, alpha_y)
        }
        other => panic!("{mtl}: {other:?}"),
    }
}

fn dielectric(mtl: &str) -> (f64, f64, f64) {
    match scattering(mtl) {
        Scattering::Dielectric { ior, alpha_x, alpha_y } => (ior, alpha_x, alpha_y),
        other => panic!("{mtl}: {other:?}"),
    }
}

#[test]
fn mtl_diffuse() {
    assert_eq!(diffuse("newmtl m\nKd 0.1 0.2 0.3\nNs 10\nillum 1\nKs 1 1 1"), DVec3::new(0.1, 0.2, 0.3));
    assert_eq!(diffuse("newmtl m\nKd 0.4\nKs 0\nd 1\nTr 0"), DVec3::splat(0.4));
    assert_eq!(diffuse("newmtl m"), DVec3::ZERO);
    assert_eq!(diffuse("newmtl m\nKd 1 1 1\nPm 0\nPr 0.5"), DVec3::ONE);
    // The later of two values counts.
    assert_eq!(diffuse("newmtl m\nKd 1 1 1\nKd 0.5"), DVec3::splat(0.5));
}

#[test]
fn mtl_conductor_roughness() {
    let close = |a: (DVec3, f64, f64), b: (f64, f64, f64)| {
        let ok = (a.0 - DVec3::splat(b.0)).length() < 1e-12
            && (a.1 - b.1).abs() < 1e-12
            && (a.2 - b.2).abs() < 1e-12;
        assert!(ok, "{a:?} {b:?}");
    };
    // Ns: alpha = sqrt(2 / (Ns + 2)).
    close(conductor("newmtl m\nKs 0.9\nNs 198"), (0.9, 0.1, 0.1));
    close(conductor("newmtl m\nKs 0.9"), (0.9, 1.0, 1.0));
    // Pr is squared, and wins over Ns.
    close(conductor("newmtl m\nKs 0.9\nNs 198\nPr 0.01"), (0.9, 1e-4, 1e-4));
    // aniso 0.84: the aspect is sqrt(1 - 0.756).
    let aspect = (1.0f64 - 0.9 * 0.84).sqrt();
    close(conductor("newmtl m\nKd 0.8\nPm 1\nPr 0.5\naniso 0.84"), (0.8, 0.25 / aspect, 0.25 * aspect));
    // The exact keys are not squared, and win over Pr; one serves for both.
    close(conductor("newmtl m\nKs 0.9\nPr 0.7\nhrr_alpha_x 1e-4\nhrr_alpha_y 1e-2"), (0.9, 1e-4, 1e-2));
    close(conductor("newmtl m\nKs 0.9\nhrr_alpha_y 3e-4\nillum 3"), (0.9, 3e-4, 3e-4));
    // Keys are read in any case.
    close(conductor("NEWMTL m\nks 0.9\npr 0.1"), (0.9, 0.1 * 0.1, 0.1 * 0.1));
}

#[test]
fn mtl_mirrors() {
    for illum in [3, 5] {
        match scattering(&format!("newmtl m\nKs 0.9 0.8 0.7\nNs 10\nillum {illum}")) {
            Scattering::Mirror { reflectance } => assert_eq!(reflectance, DVec3::new(0.9, 0.8, 0.7)),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn mtl_glass() {
    assert_eq!(dielectric("newmtl m\nKs 1\nNi 1.33\nillum 7\nNs 100"), (1.33, 0.0, 0.0));
    assert_eq!(dielectric("newmtl m\nillum 6"), (1.5, 0.0, 0.0));
    assert_eq!(dielectric("newmtl m\nillum 7\nPr 0.1\nNi 1.4"), (1.4, 0.1 * 0.1, 0.1 * 0.1));
    // 4 and 9 are glass where something shines through; d wins over Tr.
    assert_eq!(dielectric("newmtl m\nillum 4\nd 0.1\nTr 0\nNi 1.5"), (1.5, 0.0, 0.0));
    assert_eq!(dielectric("newmtl m\nillum 9\nTr 0.9\nNi 1.5\nTf 1 1 1"), (1.5, 0.0, 0.0));
    assert_eq!(diffuse("newmtl m\nKd 0.5\nillum 4\nd 1\nTr 1\nNi 1.5"), DVec3::splat(0.5));
    let (_, scene) = with_mtl("newmtl m\nillum 7\n\nNi 0\n", "");
    assert!(
        scene
            .unwrap_err()
            .to_string()
            .ends_with("s.mtl:4: material 'm': Ni is 0; the index of refraction must be positive")
    );
}

#[test]
fn mtl_emission_and_rotation() {
    let (m, warnings) = material("newmtl m\nKd 0\nKe 1 2 3\nKs 1\nPr 0.1\nanisor 0.25\n");
    assert_eq!(warnings, [""; 0]);
    assert_eq!(m.emission, DVec3::new(1.0, 2.0, 3.0));
    assert!(!m.two_sided_emission);
    assert!((m.tangent_angle - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
}

#[test]
fn mtl_gaps_are_warnings() {
    for (mtl, warning) in [
        (
            "newmtl m\nKd 0.5\n\nKs 0.2",
            "s.mtl:4: material 'm' has Kd and Ks; a coat over a base is not supported yet: Kd is kept and Ks left out",
        ),
        (
            "newmtl m\nKd 0.1\nKs 0.5",
            "s.mtl:2: material 'm' has Kd and Ks; a coat over a base is not supported yet: Ks is kept and Kd left out",
        ),
        (
            "newmtl m\nKd 0.1\nPm 0.3",
            "s.mtl:3: material 'm' is part metal (Pm 0.3); it is taken as no metal at all",
        ),
        (
            "newmtl m\nKd 1.5 0 0",
            "s.mtl:2: material 'm': Kd [1.5, 0.0, 0.0] is cut to 1, all there is to reflect",
        ),
        (
            "newmtl m\nKd 0.5\nTr 0.25",
            "s.mtl:3: material 'm' is 25 % transparent (Tr), which is not supported yet: it is taken as opaque; illum 7 makes it glass",
        ),
        (
            "newmtl m\nillum 7\nTf 1 0 0",
            "s.mtl:3: material 'm': coloured glass (Tf) is not supported yet; it is taken as clear",
        ),
        ("newmtl m\nPs 0.5", "s.mtl:2: material 'm': Ps (sheen) is not supported yet"),
        ("newmtl m\nPc 0.5", "s.mtl:2: material 'm': Pc (clear coat) is not supported yet"),
        ("newmtl m\nnorm a.png", "s.mtl:2: material 'm': norm is not used yet"),
        ("newmtl m\nmap_Ke a.png", "s.mtl:2: material 'm': map_Ke is not used yet"),
        ("newmtl m\nbump -bm 2 a.png", "s.mtl:2: material 'm': bump is not used yet"),
        (
            "newmtl m\nKs 1\nhrr_alpha_x 2",
            "s.mtl:3: material 'm': roughness (2, 2) is cut to 1, the roughest",
        ),
        ("newmtl m\nKq 1", "s.mtl:2: 'Kq' is not a key of MTL; the line is left out"),
    ] {
        let (_, warnings) = material(mtl);
        assert_eq!(warnings.len(), 1, "{mtl}: {warnings:?}");
        assert!(warnings[0].starts_with(warning), "{warnings:?}\nfor {warning}");
    }
}

#[test]
fn many_warnings_of_a_kind_are_one() {
    let mtl: String = (0..5).map(|i| format!("newmtl m{i}\nKd 0.5\nKs 0.2\n")).collect();
    let (_, warnings) = material(&mtl);
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].starts_with("s.mtl:3: ") && warnings[0].ends_with("(and 4 more of this kind)"));
}

#[test]
fn broken_mtl_lines_are_errors() {
    let (files, scene) = with_mtl("newmtl m\nKd 0.5 0.5\n", "");
    let e = scene.unwrap_err();
    assert_eq!(files.message(&e), "s.mtl:2: Kd takes 1 or 3 numbers; this line has 2");
    assert_eq!(e.exit_code(), 3);
}

// ---- textures ----

/// A 2 x 2 picture: red, green / blue, white.
fn write_picture(path: &Path) {
    use glam::Vec3;
    let image = hrr::image::Image { width: 2, height: 2, pixels: vec![Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE] };
    hrr::image::write(path, &image, &Default::default()).unwrap();
}

#[test]
fn textures_are_found_beside_their_mtl_and_follow_their_options() {
    let files = toml_scene("obj = [\"sub/t.obj\"]\n");
    files.write("sub/t.obj", format!("mtllib t.mtl\n{TRIANGLE}usemtl a\nf 1 2 3\n").as_bytes());
    files.write(
        "sub/t.mtl",
        b"newmtl a\nKd 0.5\nmap_Kd -s 1 1 1 -o 0.5 0 pic/four.png\nnewmtl b\nmap_Kd pic\\four.png\n",
    );
    std::fs::create_dir(files.path("sub/pic")).unwrap();
    write_picture(&files.path("sub/pic/four.png"));
    let scene = files.load("s.toml", &[]).unwrap();
    let Scattering::Diffuse { albedo, map: Some(a) } = &scene.materials[0].scattering else { panic!() };
    assert_eq!(*albedo, DVec3::splat(0.5));
    // Shifted by half a picture: the left half shows the right one.
    assert!((a.lookup(DVec2::new(0.25, 0.75)) - DVec3::Y).length() < 1e-6);
    // Without a Kd, the picture counts as it is.
    let Scattering::Diffuse { albedo, map: Some(b) } = &scene.materials[1].scattering else { panic!() };
    assert_eq!(*albedo, DVec3::ONE);
    assert!((b.lookup(DVec2::new(0.25, 0.25)) - DVec3::Z).length() < 1e-6);
    assert_eq!(scene.warnings.len(), 1, "{:?}", scene.warnings); // nothing emits
}

#[test]
fn missing_textures_are_named_with_the_line_that_wants_them() {
    let (files, scene) = with_mtl("newmtl m\nKd 1\nmap_Kd -s 2 2 2 no.png\n", "");
    let e = scene.unwrap_err();
    assert!(files.message(&e).starts_with("s.mtl:3: texture 'no.png': "), "{e}");
    assert_eq!(e.exit_code(), 3);
    let (files, _) = with_mtl("newmtl m\nmap_Kd s.obj\n", "");
    let e = files.load("s.obj", &[]).unwrap_err();
    assert!(files.message(&e).starts_with("s.mtl:2: texture 's.obj': "), "{e}");
}

// ---- TOML ----

#[test]
fn every_key_arrives() {
    let files = toml_scene(
        "obj = [\"s.obj\"]\n[camera]\norigin = [0, 1.5, 4]\ntarget = [0, 0.5, 0]\nup = [0, 0, -1]\nfov_y = 30\n\
         aperture_radius = 0\nfocus_distance = 2.5\n[film]\nwidth = 32\nheight = 24\nfilter = \"gaussian\"\n\
         [render]\nintegrator = \"lvc+hrr\"\nmax_depth = 5\nseed = 0x10\ntime = 1.5\n\
         [material.lamp]\ntype = \"conductor\"\neta = [0.2, 0.3, 0.4]\nk = [3, 4, 5]\nalpha = [1e-4, 0.01]\n\
         emission = [1, 2, 3]\ntwo_sided_emission = true\n",
    );
    let scene = files.load("s.toml", &[]).unwrap();
    let c = &scene.camera;
    assert_eq!((c.origin, c.target), (DVec3::new(0.0, 1.5, 4.0), DVec3::new(0.0, 0.5, 0.0)));
    assert_eq!((c.up, c.fov_y, c.aperture_radius, c.focus_distance), (DVec3::NEG_Z, 30.0, 0.0, 2.5));
    assert_eq!((scene.film.width, scene.film.height, scene.film.filter), (32, 24, Filter::Gaussian));
    let s = &scene.settings;
    assert_eq!((s.integrator, s.max_depth, s.seed, s.time), (Integrator::LvcHrr, 5, 16, Some(1.5)));
    let m = &scene.materials[0];
    assert_eq!((m.emission, m.two_sided_emission), (DVec3::new(1.0, 2.0, 3.0), true));
    let Scattering::Conductor { reflectance: Reflectance::Complex { eta, k }, alpha_x, alpha_y } =
        m.scattering
    else {
        panic!("{m:?}")
    };
    assert_eq!((eta, k), (DVec3::new(0.2, 0.3, 0.4), DVec3::new(3.0, 4.0, 5.0)));
    assert_eq!((alpha_x, alpha_y), (1e-4, 0.01));
    assert_eq!((scene.path.clone(), scene.warnings.len()), (files.path("s.toml"), 0));
}

#[test]
fn every_material_type() {
    let load = |keys: &str| {
        let files = toml_scene(&format!("{OBJ_LINE}[material.lamp]\n{keys}\nemission = 2\n"));
        let scene = files.load("s.toml", &[]).unwrap();
        assert_eq!(scene.materials[0].emission, DVec3::splat(2.0));
        scene.materials[0].scattering.clone()
    };
    assert!(matches!(load("type = \"diffuse\"\nalbedo = [0.1, 0.2, 0.3]"),
        Scattering::Diffuse { albedo, map: None } if albedo == DVec3::new(0.1, 0.2, 0.3)));
    assert!(matches!(load("type = \"conductor\"\nreflectance = 0.9\nalpha = 0.2"),
        Scattering::Conductor { reflectance: Reflectance::Schlick { f0 }, alpha_x: 0.2, alpha_y: 0.2 }
            if f0 == DVec3::splat(0.9)));
    assert!(matches!(
        load("type = \"dielectric\"\nior = 1.4\nalpha = 0.1"),
        Scattering::Dielectric { ior: 1.4, alpha_x: 0.1, alpha_y: 0.1 }
    ));
    assert!(matches!(
        load("type = \"dielectric\""),
        Scattering::Dielectric { ior: 1.5, alpha_x: 0.0, alpha_y: 0.0 }
    ));
    assert!(
        matches!(load("type = \"mirror\""), Scattering::Mirror { reflectance } if reflectance == DVec3::ONE)
    );
    // Without a type the MTL's material stays, but for its emission.
    assert!(matches!(load(""), Scattering::Diffuse { albedo: DVec3::ZERO, map: None }));
    // With one it is replaced altogether.
    let files = toml_scene(&format!("{OBJ_LINE}material.lamp.type = \"mirror\"\n"));
    let scene = files.load("s.toml", &[]).unwrap();
    assert!(!scene.materials[0].emits());
    assert_eq!(files.warnings(&scene), ["s.toml: nothing emits light: the image will be black"]);
}

#[test]
fn wrong_keys_and_values_are_named() {
    for (toml, message) in [
        ("[camera]\nfovy = 3", "s.toml:3: unknown key 'fovy' in [camera]; did you mean 'fov_y'?"),
        ("[camra]\nfovy = 3", "s.toml:2: unknown key 'camra' in the scene; did you mean 'camera'?"),
        ("[film]\nfov_y = 3", "s.toml:3: unknown key 'fov_y' in [film]"),
        ("film = 3", "s.toml:2: expected a table for [film], found the integer 3"),
        ("[film]\nwidth = 0", "s.toml:3: film.width is 0; it must lie in 1..=65536"),
        ("[film]\nheight = 0", "s.toml:3: film.height is 0; it must lie in 1..=65536"),
        ("[film]\nheight = -4", "s.toml:3: film.height is -4; it must lie in 1..=65536"),
        ("[film]\nheight = 1.5", "s.toml:3: expected a whole number for film.height, found the number 1.5"),
        (
            "[film]\nfilter = \"mitchell\"",
            "s.toml:3: film.filter is \"mitchell\"; it must be box or gaussian",
        ),
        ("[camera]\nfov_y = 0", "s.toml:3: camera.fov_y is 0; it must lie between 0 and 180 degrees"),
        ("[camera]\nfov_y = 180.0", "s.toml:3: camera.fov_y is 180; it must lie between 0 and 180 degrees"),
        ("[camera]\nfov_y = nan", "s.toml:3: camera.fov_y is NaN; it must be finite"),
        (
            "[camera]\nfov_y = \"wide\"",
            "s.toml:3: expected a number for camera.fov_y, found the string \"wide\"",
        ),
        ("[camera]\nfocus_distance = 0", "s.toml:3: camera.focus_distance is 0; it must be positive"),
        ("[camera]\naperture_radius = -1", "s.toml:3: camera.aperture_radius is -1; it must not be negative"),
        (
            "[camera]\norigin = [1, 2, 3]\n\ntarget = [1, 2, 3]",
            "s.toml:5: camera.target is the same point as camera.origin",
        ),
        ("[camera]\norigin = [1, 2, 3]", "s.toml:3: camera.origin is given, but not camera.target"),
        ("[camera]\ntarget = [1, 2, 3]", "s.toml:3: camera.target is given, but not camera.origin"),
        (
            "[camera]\norigin = [0, 0, 3]\ntarget = [0, 0, 0]\nup = [0, 0, -2]",
            "s.toml:5: camera.up, [0.0, 0.0, -2.0], is zero or parallel to the view",
        ),
        (
            "[camera]\norigin = [0, 3, 0]\ntarget = [0, 0, 0]",
            "s.toml:4: camera.up, [0.0, 1.0, 0.0], is zero or parallel to the view",
        ),
        ("[camera]\nup = [0, 0, 0]", "s.toml:3: camera.up, [0.0, 0.0, 0.0], is zero or parallel to the view"),
        ("[camera]\nup = [0, 0]", "s.toml:3: expected 3 numbers for camera.up, found an array of 2"),
        ("[render]\nmaxdepth = 2", "s.toml:3: unknown setting 'maxdepth'; did you mean 'max_depth'?"),
        ("[render]\n\nmax_depth = 0", "s.toml:4: max_depth must be a whole number from 1 to 65535, not '0'"),
        ("[render]\nseed = [1]", "s.toml:3: render.seed takes a single value"),
        ("[material.lmp]\nemission = 1", "s.toml:2: no MTL file has a material 'lmp'; did you mean 'lamp'?"),
        (
            "[material.lamp]\nalbedo = 1",
            "s.toml:3: 'albedo' in [material.lamp] needs a type beside it: diffuse, conductor, dielectric, mirror",
        ),
        (
            "[material.lamp]\ntype = \"difuse\"",
            "s.toml:3: material.lamp.type is \"difuse\"; it must be one of diffuse, conductor, dielectric, mirror; did you mean 'diffuse'?",
        ),
        (
            "[material.lamp]\ntype = \"diffuse\"\nalbdo = 1",
            "s.toml:4: unknown key 'albdo' in [material.lamp]; did you mean 'albedo'?",
        ),
        ("[material.lamp]\ntype = \"diffuse\"", "s.toml:3: [material.lamp] needs the key albedo"),
        (
            "[material.lamp]\ntype = \"diffuse\"\nalbedo = 1.5",
            "s.toml:4: material.lamp.albedo is [1.5, 1.5, 1.5]; it must lie in 0..=1",
        ),
        (
            "[material.lamp]\ntype = \"conductor\"\nk = 1\nalpha = 1",
            "s.toml:3: [material.lamp] needs the key eta",
        ),
        (
            "[material.lamp]\ntype = \"conductor\"\nk = 1\neta = 1",
            "s.toml:3: [material.lamp] needs the key alpha",
        ),
        (
            "[material.lamp]\ntype = \"conductor\"\nk = 1\nreflectance = 1",
            "s.toml:4: k and reflectance exclude each other",
        ),
        (
            "[material.lamp]\ntype = \"conductor\"\nreflectance = 1\nalpha = [1, 2]",
            "s.toml:5: material.lamp.alpha is [1.0, 2.0]; roughness lies in 0..=1",
        ),
        (
            "[material.lamp]\ntype = \"conductor\"\nreflectance = 1\nalpha = \"x\"",
            "s.toml:5: expected 2 numbers for material.lamp.alpha, found the string \"x\"",
        ),
        (
            "[material.lamp]\ntype = \"dielectric\"\nior = 0",
            "s.toml:4: material.lamp.ior is 0; it must be positive",
        ),
        (
            "[material.lamp]\nemission = -1",
            "s.toml:3: material.lamp.emission is [-1.0, -1.0, -1.0]; it must not be negative",
        ),
        (
            "[material.lamp]\ntwo_sided_emission = 1",
            "s.toml:3: expected true or false for material.lamp.two_sided_emission, found the integer 1",
        ),
        (
            "[[light]]\nposition = [0, 2, 0]",
            "s.toml:2: [[light]] needs a type: point, spot, directional, environment",
        ),
        (
            "[[light]]\ntype = \"sport\"",
            "s.toml:3: light.type is \"sport\"; it must be one of point, spot, directional, environment; did you mean 'spot'?",
        ),
        ("camera = { fov_y = 0 }", "s.toml:2: camera.fov_y is 0; it must lie between 0 and 180 degrees"),
    ] {
        let (text, code) = toml_error(&format!("{OBJ_LINE}{toml}\n"));
        assert_eq!((text.as_str(), code), (message, 3), "for\n{toml}");
    }
    let (text, code) = toml_error("obj = [\"s.obj\"\n[camera]\n");
    assert!(text.starts_with("s.toml:") && code == 3, "{text}");
}

#[test]
fn what_is_to_come_is_unsupported() {
    for (toml, start) in [
        ("[camera]\naperture_radius = 0.1", "s.toml:3: not supported: camera.aperture_radius above 0"),
        ("[[light]]\ntype = \"point\"", "s.toml:3: not supported: point lights"),
        (
            "[[light]]\ncolor = [1, 1, 1]\ntype = \"environment\"",
            "s.toml:4: not supported: environment lights",
        ),
        ("[render]\nintegrator = \"pcvcm+hrr\"", "s.toml:3: not supported: integrator 'pcvcm+hrr'"),
    ] {
        let (text, code) = toml_error(&format!("{OBJ_LINE}{toml}\n"));
        assert!(text.starts_with(start) && code == 5, "{text} {code}");
    }
    let files = Files::new(&[("s.obj", &format!("{TRIANGLE}f 1 2 3\n"))]);
    let e = files.load("s.obj", &[]).unwrap_err();
    assert!(files.message(&e).starts_with("s.obj: not supported: a uniform environment"), "{e}");
    assert_eq!(e.exit_code(), 5);
}

#[test]
fn flags_win_over_the_file() {
    let files = toml_scene(&format!(
        "{OBJ_LINE}[camera]\nfov_y = 20\n[render]\niterations = 3\ntime = 2.0\n[material.lamp]\ntype = \"mirror\"\nemission = 1\n"
    ));
    let flags = [
        ("camera.fov_y", "30"),
        ("film.width", "100"),
        ("render.integrator", "lvc+hrr"),
        ("render.iterations", "7"),
        ("material.lamp.reflectance", "[0.5, 0.25, 1]"),
    ];
    let scene = files.load("s.toml", &flags).unwrap();
    assert_eq!((scene.camera.fov_y, scene.film.width, scene.film.height), (30.0, 100, 480));
    // Of iterations and time, the one given last counts.
    assert_eq!((scene.settings.iterations, scene.settings.time), (7, None));
    assert_eq!(scene.settings.integrator, Integrator::LvcHrr);
    assert!(matches!(scene.materials[0].scattering,
        Scattering::Mirror { reflectance } if reflectance == DVec3::new(0.5, 0.25, 1.0)));
    // A bare OBJ file takes them, too.
    let scene = files.load("s.obj", &[("film.height", "20")]).unwrap();
    assert_eq!(scene.film.height, 20);
}

#[test]
fn wrong_flags_are_usage_errors() {
    let files = toml_scene(OBJ_LINE);
    for (flag, message) in [
        (("camera.fovy", "30"), "-D camera.fovy=30: unknown key 'fovy' in [camera]; did you mean 'fov_y'?"),
        (("film.width", "0"), "-D film.width=0: film.width is 0; it must lie in 1..=65536"),
        (
            ("film.width", "wide"),
            "-D film.width=wide: expected a whole number for film.width, found the string \"wide\"",
        ),
        (
            ("material.lam.emission", "1"),
            "-D material.lam.emission=1: no MTL file has a material 'lam'; did you mean 'lamp'?",
        ),
        (("a b", "1"), "-D a b=1: not a dotted key and a value, such as camera.fov_y=30"),
        (("", "1"), "-D =1: not a dotted key and a value, such as camera.fov_y=30"),
        (("obj", "no.obj"), "-D obj=no.obj: there is no file 'no.obj'"),
    ] {
        let e = files.load("s.toml", &[flag]).unwrap_err();
        assert_eq!((files.message(&e).as_str(), e.exit_code()), (message, 2));
    }
    let e = files.load("s.toml", &[("camera.aperture_radius", "1")]).unwrap_err();
    assert_eq!(e.exit_code(), 5);
}

#[test]
fn without_a_camera_everything_is_in_view() {
    for (width, height) in [("400", "100"), ("100", "400")] {
        let files = toml_scene(OBJ_LINE);
        files.write("s.obj", b"mtllib s.mtl\nusemtl lamp\nv -10 0 2\nv 30 0 3\nv 0 50 -7\nf 1 2 3\n");
        let flags = [("film.width", width), ("film.height", height), ("camera.fov_y", "25")];
        let scene = files.load("s.toml", &flags).unwrap();
        let camera =
            hrr::camera::Camera::new(&scene.camera, (scene.film.width, scene.film.height), scene.mesh.origin)
                .unwrap();
        let mut seen = f64::INFINITY;
        for p in &scene.mesh.positions {
            let raster = camera.raster(p.as_dvec3() - camera.position).expect("in view");
            seen = seen.min(raster.x.min(raster.y));
        }
        // And not as a speck: the sphere around it touches two borders.
        assert!(seen < 100.0, "{seen}");
    }
}

#[test]
fn the_hash_follows_every_input() {
    let files = toml_scene(OBJ_LINE);
    let base = files.load("s.toml", &[]).unwrap().hash;
    assert_eq!(files.load("s.toml", &[]).unwrap().hash, base);
    // Where the files lie does not matter.
    assert_eq!(toml_scene(OBJ_LINE).load("s.toml", &[]).unwrap().hash, base);
    let flagged = files.load("s.toml", &[("film.width", "7")]).unwrap().hash;
    files.write("s.mtl", b"newmtl lamp\nKe 1 1 2\n");
    let changed = files.load("s.toml", &[]).unwrap().hash;
    assert!(flagged != base && changed != base && changed != flagged);
    // Stable over versions: a changed fingerprint would disown every image made before.
    assert_eq!(base, 0xb1b8_9336_f2cb_fb43, "{base:#x}");
}

// ---- the scenes of the project ----

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
    for (name, triangles) in
        [("cornell", 36), ("caustic_mirror", 5530), ("caustic_mirror_aniso", 5530), ("glass_caustic", 20214)]
    {
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
    ] {
        for file in ["scene.toml", "scene.obj"] {
            let scene = Scene::load(&folder.join(name).join(file), &[]).unwrap();
            let index = scene.materials.iter().position(|m| m.name == "mirror").unwrap();
            let Scattering::Conductor { alpha_x, alpha_y, .. } = scene.materials[index].scattering else {
                panic!("{name}")
            };
            assert_eq!([alpha_x, alpha_y], alpha, "{name}/{file}");
            // Its u direction, which alpha_x belongs to, is horizontal.
            let t = scene.mesh.materials.iter().position(|&m| m as usize == index).unwrap() as u32;
            let point = hrr::geometry::SurfacePoint::at_barycentric(&scene.mesh, t, 0.2, 0.3);
            assert!((point.frame.x - DVec3::X).length() < 1e-5, "{name}: {:?}", point.frame);
            assert!(point.frame.z.z > 0.9);
        }
    }
}
