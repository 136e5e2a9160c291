//! What accuracy costs: the sub-commands that measure it, from outside.

use crate::support::program::Place;
use glam::Vec3;
use hrr::image::{self, Attributes, Image};

fn write(place: &Place, name: &str, value: impl Fn(u32) -> Vec3) {
    let image = Image { width: 20, height: 20, pixels: (0..400).map(value).collect() };
    image::write(&place.path(name), &image, &Attributes::new()).unwrap();
}

#[test]
fn compare_prints_metrics_and_judges_them() {
    let place = Place::new();
    write(&place, "r.exr", |_| Vec3::ONE);
    write(&place, "a.exr", |i| if i == 0 { Vec3::splat(3.0) } else { Vec3::ONE });
    write(&place, "v.exr", |_| Vec3::splat(0.02));
    let (code, out, err) = place.run("compare a.exr r.exr");
    assert_eq!((code, err.as_str()), (0, ""));
    assert!(out.contains("mse            1.000000e-2\n") && !out.contains("tile_z"), "{out}");

    let (code, out, _) = place.run("compare a.exr r.exr --max mse=0.01 --max flip=1");
    assert!(code == 0 && out.contains("<= 1e-2"), "{out}");
    let (code, out, _) = place.run("compare a.exr r.exr --max mse=0.0099 --max flip=1");
    assert!(code == 1 && out.contains("OVER 9.9e-3"), "{out}");

    let variances = "--variance v.exr --reference-variance v.exr";
    let (code, out, _) =
        place.run(&format!("compare a.exr r.exr {variances} --max tile_z=0.7 --max mse=1 --format json"));
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!((code, &json["failed"], &json["over"][1]), (0, &false.into(), &serde_json::Value::Null));
    // 2 / sqrt(0.04 * 256)
    assert!((json["tile_z"].as_f64().unwrap() - 0.625).abs() < 1e-4, "{out}");
    let (code, out, _) =
        place.run(&format!("compare a.exr r.exr {variances} --max tile_z=0.6 --format json"));
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!((code, &json["failed"], &json["over"][0]), (1, &true.into(), &"tile_z".into()));
}

#[test]
fn compare_lets_no_nan_pass() {
    let place = Place::new();
    write(&place, "r.exr", |_| Vec3::ONE);
    write(&place, "a.exr", |i| if i == 7 { Vec3::NAN } else { Vec3::ONE });
    let (code, out, _) = place.run("compare a.exr r.exr");
    assert!(code == 0 && out.contains("1 pixels are not finite"), "{out}");
    assert_eq!(place.run("compare a.exr r.exr --max mse=1").0, 1);
}

#[test]
fn compare_refuses_what_makes_no_sense() {
    let place = Place::new();
    write(&place, "r.exr", |_| Vec3::ONE);
    let small = Image { width: 1, height: 1, pixels: vec![Vec3::ONE] };
    image::write(&place.path("small.exr"), &small, &Attributes::new()).unwrap();
    for (line, code, wanted) in [
        ("compare r.exr", 2, "required"),
        ("compare r.exr none.exr", 3, "none.exr"),
        ("compare r.exr small.exr", 3, "20x20 and 1x1"),
        ("compare r.exr scene.toml", 3, "scene.toml"),
        ("compare r.exr r.exr --max flop=1", 2, "did you mean 'flip'?"),
        ("compare r.exr r.exr --max flip=x", 2, "number"),
        ("compare r.exr r.exr --max tile_z=3", 2, "--variance"),
        ("compare r.exr r.exr --variance r.exr", 2, "--reference-variance"),
    ] {
        let (found, out, err) = place.run(line);
        assert_eq!((found, out.as_str()), (code, ""), "{line}: {err}");
        assert!(err.starts_with("hrr: ") && err.contains(wanted), "{line}: {err}");
    }
}
