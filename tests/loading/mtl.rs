//! MTL files: every rule, every gap, and textures.

use super::*;
use glam::{DVec2, DVec3};
use hrr::bsdf::Reflectance;
use hrr::material::Scattering;
use std::path::Path;

/// The first material of an MTL text, with the warnings that it gives.
fn material(mtl: &str) -> (hrr::material::Material, Vec<String>) {
    let (files, scene) = with_mtl(mtl, "");
    let scene = scene.unwrap_or_else(|e| panic!("{mtl}: {e}"));
    (scene.materials[0].clone(), files.warnings(&scene))
}

fn scattering(mtl: &str) -> Scattering {
    let (m, warnings) = material(mtl);
    assert_eq!(warnings, [""; 0], "{mtl}");
    m.scattering().clone()
}

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
fn mtl_coats() {
    let coated = |mtl: &str| match scattering(mtl) {
        Scattering::Coated { albedo, map: None, f0, alpha_x, alpha_y } if alpha_x == alpha_y => {
            (albedo, f0, alpha_x)
        }
        other => panic!("{mtl}: {other:?}"),
    };
    let same = |a: (DVec3, DVec3, f64), b: (f64, f64, f64)| {
        assert!((a.0 - b.0).length() + (a.1 - b.1).length() + (a.2 - b.2).abs() < 1e-12, "{a:?} {b:?}");
    };
    same(coated("newmtl m\nKd 0.5\nKs 0.2\nPr 0.1"), (0.5, 0.2, 0.01));
    same(coated("newmtl m\nKd 0.1\nKs 0.5\nNs 198"), (0.1, 0.5, 0.1));
    same(coated("newmtl m\nKd 0.1\nKs 0.5\nillum 3"), (0.1, 0.5, 0.0));
    same(coated("newmtl m\nKd 0.8\nPm 0.25\nPr 0.5"), (0.6, 0.04 * 0.75 + 0.8 * 0.25, 0.25));
    same(coated("newmtl m\nKd 0.5\nPc 0.5\nPcr 0.2"), (0.5, 0.02, 0.04));
}

#[test]
fn mtl_opacity() {
    assert_eq!(material("newmtl m\nKd 0.5\nTr 0.25").0.opacity, 0.75);
    assert_eq!(material("newmtl m\nKd 0.5\nd 0.5\nTr 0.25").0.opacity, 0.5);
    // Glass lets light through by itself.
    assert_eq!(material("newmtl m\nillum 9\nd 0.5").0.opacity, 1.0);
}

#[test]
fn mtl_gaps_are_warnings() {
    for (mtl, warning) in [
        (
            "newmtl m\nKd 1.5 0 0",
            "s.mtl:2: material 'm': Kd [1.5, 0.0, 0.0] is cut to 1, all there is to reflect",
        ),
        (
            "newmtl m\nKd 0.5\nTr 1",
            "s.mtl:3: material 'm' is fully transparent (Tr): nothing of it will be seen",
        ),
        (
            "newmtl m\nillum 7\nTf 1 0 0",
            "s.mtl:3: material 'm': coloured glass (Tf) is not supported yet; it is taken as clear",
        ),
        ("newmtl m\nPs 0.5", "s.mtl:2: material 'm': Ps (sheen) is not supported yet"),
        ("newmtl m\nd -halo 0.5", "s.mtl:2: material 'm': d -halo is taken as d"),
        (
            "newmtl m\nKs 0.5\nPc 0.5",
            "s.mtl:3: material 'm': Pc (clear coat) over Ks or a metal is not supported yet; it is left out",
        ),
        ("newmtl m\nmap_Ks a.png", "s.mtl:2: material 'm': map_Ks is not used yet"),
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
    let mtl: String = (0..5).map(|i| format!("newmtl m{i}\nKd 0.5\nPs 0.2\n")).collect();
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
    let Scattering::Diffuse { albedo, map: Some(a) } = scene.materials[0].scattering() else { panic!() };
    assert_eq!(*albedo, DVec3::splat(0.5));
    // Shifted by half a picture: the left half shows the right one.
    assert!((a.lookup(DVec2::new(0.25, 0.75)) - DVec3::Y).length() < 1e-6);
    // Without a Kd, the picture counts as it is.
    let Scattering::Diffuse { albedo, map: Some(b) } = scene.materials[1].scattering() else { panic!() };
    assert_eq!(*albedo, DVec3::ONE);
    assert!((b.lookup(DVec2::new(0.25, 0.25)) - DVec3::Z).length() < 1e-6);
    assert_eq!(scene.warnings.len(), 1, "{:?}", scene.warnings); // nothing emits
}

#[test]
fn every_map_arrives() {
    let mtl = b"newmtl a\nKd 0.5\nKs 0.5\nmap_Pr -s 2 2 2 four.png\nnorm four.png\nmap_Ke four.png\nmap_d four.png\n\
                newmtl b\nKs 1\nPr 0.5\nmap_Pr four.png\nKe 2\nmap_Ke four.png\n";
    let files = Files::new(&[("s.obj", &format!("mtllib s.mtl\n{TRIANGLE}usemtl a\nf 1 2 3\n"))]);
    files.write("s.mtl", mtl);
    write_picture(&files.path("four.png"));
    let scene = files.load("s.obj", &[]).unwrap();
    assert_eq!(files.warnings(&scene), [""; 0]);
    let (a, b) = (&scene.materials[0], &scene.materials[1]);
    // Pixels are red, green / blue, white: of data the red channel counts.
    let (red, green, white) = (DVec2::new(0.25, 0.75), DVec2::splat(0.75), DVec2::new(0.75, 0.25));
    let alpha = |m: &hrr::material::Material, uv: DVec2| m.bsdf(uv).glossy().map_or(0.0, |g| g.alpha_x);
    assert!((alpha(a, red * 0.5) - 1.0).abs() < 1e-6 && alpha(a, green * 0.5) == 0.0);
    assert!((alpha(b, red) - 0.25).abs() < 1e-6 && b.bsdf(green).is_delta());
    assert!((a.emission_at(green) - DVec3::Y).length() < 1e-6);
    assert!((b.emission_at(white) - DVec3::splat(2.0)).length() < 1e-6);
    assert!((a.opacity_at(red), a.opacity_at(green)) == (1.0, 0.0) && !a.is_opaque() && b.is_opaque());
    assert!(a.bends_frame() && !b.bends_frame() && !a.is_constant());
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
