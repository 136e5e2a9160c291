//! TOML scenes and the flags that override them.

use super::*;
use glam::{DVec3, Vec3};
use hrr::bsdf::Reflectance;
use hrr::film::Filter;
use hrr::image::Image;
use hrr::light::LightSource;
use hrr::material::Scattering;
use hrr::settings::Integrator;

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
        *m.scattering()
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
        scene.materials[0].scattering().clone()
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
            "s.toml:3: 'albedo' in [material.lamp] needs a type beside it: diffuse, conductor, dielectric, mirror, coated",
        ),
        (
            "[material.lamp]\ntype = \"difuse\"",
            "s.toml:3: material.lamp.type is \"difuse\"; it must be one of diffuse, conductor, dielectric, mirror, coated; did you mean 'diffuse'?",
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
        ("[material.lamp]\nopacity = 1.5", "s.toml:3: material.lamp.opacity is 1.5; it must lie in 0..=1"),
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
    let (text, code) = toml_error(&format!("{OBJ_LINE}[render]\nintegrator = \"bpt+hrr\"\n"));
    assert!(text.starts_with("s.toml:3: not supported: integrator 'bpt+hrr'") && code == 5, "{text} {code}");
}

#[test]
fn a_bare_obj_without_emitters_gets_a_white_sky() {
    let files = Files::new(&[("s.obj", &format!("{TRIANGLE}f 1 2 3\n"))]);
    let scene = files.load("s.obj", &[]).unwrap();
    assert!(
        scene.warnings.iter().any(|w| w.ends_with("it is lit by a uniform white sky")),
        "{:?}",
        scene.warnings
    );
    let [LightSource::Environment { color, image: None }] = &scene.lights[..] else {
        panic!("{:?}", scene.lights)
    };
    assert_eq!(*color, DVec3::ONE);
}

#[test]
fn every_light_arrives() {
    let files = toml_scene(&format!(
        "{OBJ_LINE}[camera]\naperture_radius = 0.1\nfocus_distance = 3\n\
         [[light]]\ntype = \"point\"\nposition = [0, 2, 0]\nintensity = 10\n\
         [[light]]\ntype = \"spot\"\nposition = [0, 2, 0]\ntarget = [0, 0, 0]\nintensity = [1, 2, 3]\nouter_angle = 60\ninner_angle = 30\n\
         [[light]]\ntype = \"directional\"\ndirection = [0, -2, 0]\nirradiance = 5\n\
         [[light]]\ntype = \"environment\"\nfile = \"sky.png\"\ncolor = [1, 2, 3]\n"
    ));
    hrr::image::write(
        &files.path("sky.png"),
        &Image { width: 2, height: 1, pixels: vec![Vec3::ONE, Vec3::ZERO] },
        &Default::default(),
    )
    .unwrap();
    let scene = files.load("s.toml", &[]).unwrap();
    assert_eq!((scene.camera.aperture_radius, scene.camera.focus_distance), (0.1, 3.0));
    let [point, spot, sun, sky] = &scene.lights[..] else { panic!("{:?}", scene.lights) };
    assert!(matches!(point, LightSource::Point { position, intensity }
        if *position == DVec3::Y * 2.0 && *intensity == DVec3::splat(10.0)));
    assert!(matches!(spot, LightSource::Spot { direction, inner, outer, .. }
        if *direction == -DVec3::Y && (inner.to_degrees() - 30.0).abs() < 1e-9 && (outer.to_degrees() - 60.0).abs() < 1e-9));
    assert!(matches!(sun, LightSource::Directional { direction, irradiance }
        if *direction == -DVec3::Y && *irradiance == DVec3::splat(5.0)));
    assert!(matches!(sky, LightSource::Environment { color, image: Some(image) }
        if *color == DVec3::new(1.0, 2.0, 3.0) && image.pixels[0] == Vec3::ONE));
}

#[test]
fn wrong_lights_are_named() {
    for (light, message) in [
        ("type = \"point\"\nposition = [0, 1, 2]", "s.toml:3: a point light needs the key intensity"),
        (
            "type = \"point\"\nposition = [0, 1]",
            "s.toml:4: expected 3 numbers for light.position, found an array of 2",
        ),
        (
            "type = \"sun\"",
            "s.toml:3: light.type is \"sun\"; it must be one of point, spot, directional, environment",
        ),
        ("type = \"environment\"", "s.toml:3: an environment light needs the key color or file"),
        ("type = \"environment\"\nfile = \"no.exr\"", "s.toml:4: environment 'no.exr': "),
        (
            "type = \"environment\"\ncolour = 1",
            "s.toml:4: unknown key 'colour' in the environment light; did you mean 'color'?",
        ),
        (
            "type = \"directional\"\ndirection = [0, 0, 0]\nirradiance = 1",
            "s.toml:4: light.direction is zero",
        ),
        (
            "type = \"spot\"\nposition = [0, 0, 0]\ntarget = [0, 0, 0]\nintensity = 1",
            "s.toml:5: light.target lies on light.position",
        ),
        (
            "type = \"spot\"\nposition = [0, 0, 0]\ndirection = [0, 0, 1]\nintensity = 1\nouter_angle = 20\ninner_angle = 20",
            "s.toml:8: light.inner_angle is 20; it must lie between 0 and outer_angle, 20",
        ),
        (
            "type = \"environment\"\ncolor = 1\n[[light]]\ntype = \"environment\"\ncolor = 1",
            "s.toml:5: a second environment light; there is room for one",
        ),
    ] {
        let (text, code) = toml_error(&format!("{OBJ_LINE}[[light]]\n{light}\n"));
        assert!(text.starts_with(message) && code == 3, "{text}\nfor\n{light}");
    }
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
    assert!(matches!(*scene.materials[0].scattering(),
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
    let e = files.load("s.toml", &[("camera.aperture_radius", "-1")]).unwrap_err();
    assert_eq!(e.exit_code(), 2);
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
