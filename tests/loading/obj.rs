//! OBJ files: broken lines, odd forms, what is left out, and what arrives.

use super::*;
use glam::{DVec2, DVec3};
use hrr::material::Scattering;

/// The text of the error, of exit code 3, that an OBJ file gives.
fn obj_error(text: &str) -> String {
    let files = Files::new(&[("s.obj", text)]);
    let e = files.load("s.obj", &[]).unwrap_err();
    assert!(matches!(e, Error::Scene { .. }) && e.exit_code() == 3, "{e:?}");
    files.message(&e)
}

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
        matches!(*grey.scattering(), Scattering::Diffuse { albedo, map: None } if albedo == DVec3::splat(0.5))
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
