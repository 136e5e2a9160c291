//! Kinds of paths that nothing finds are an error, and light that is left out on demand is told everywhere.

use super::*;
use crate::support::program::Place;
use hrr::effects::PathClass;
use hrr::effects::paths::Vertex;
use hrr::image::Value;
use hrr::render::{Silent, render};
use std::fs;

#[test]
fn paths_that_nothing_finds_are_an_error_that_names_them() {
    let scene = lit(with_cube(mirror()), lamp_without_size());
    for (integrator, path) in [
        (Integrator::Pt, "paths L S D E (from a light without size): pt"),
        (Integrator::Lvc, "paths L S D S E (from a light without size): lvc"),
        (Integrator::Lt, "paths L S E: lt"),
    ] {
        let named = Settings { integrator, ..settings() };
        let error = planned(&scene, &named).unwrap_err();
        assert!(error.to_string().contains(path) && error.exit_code() == 5, "{error}");
    }
    let without = |list: &str| Settings { without: list.parse().unwrap(), ..settings() };
    let plan = planned(&scene, &Settings { integrator: Integrator::Lvc, ..without("sds") }).unwrap();
    assert!(plan.is_biased() && plan.complaint().unwrap().contains("L S D S E"), "{plan:?}");
    // Light tracing without all that is smooth.
    let plan = planned(&scene, &Settings { integrator: Integrator::Lt, ..without("specular") }).unwrap();
    assert!(plan.is_biased() && plan.complaint().unwrap().contains("L D S E"), "{plan:?}");
    // Auto does without what it is told to.
    let plan = planned(&scene, &without("sds")).unwrap();
    assert_eq!((plan.integrator, plan.is_biased()), (Integrator::Lvc, true));
    let plan = planned(&scene, &without("light_subpaths")).unwrap();
    assert_eq!((plan.integrator, plan.is_biased()), (Integrator::Pt, true));
    // What is not there can be left out.
    assert!(!planned(&plain(), &without("sds,lens")).unwrap().is_biased());
    // Without merging, what meets the light by chance finds all.
    let plan = planned(&with_cube(mirror()), &without("sds")).unwrap();
    assert_eq!((plan.integrator, plan.is_biased()), (Integrator::Lvc, false));
    let error = render(&scene, &without("refraction"), &Silent).unwrap_err();
    assert!(error.to_string().contains("refraction cannot be left out"), "{error}");
}

/// By name or chosen: what each algorithm does not find, by what it is, and not by the table that plans are made from.
#[test]
fn every_algorithm_refuses_what_it_does_not_find() {
    let misses = |integrator: Integrator, class: &PathClass| {
        let open: Vec<bool> = class.surfaces.iter().map(|v| *v != Vertex::S).collect();
        let merges = matches!(
            integrator,
            Integrator::Vcm | Integrator::VcmHrr | Integrator::Pcvcm | Integrator::PcvcmHrr
        );
        let connected = open[0] || open[open.len() - 1] || open.windows(2).any(|w| w == [true; 2]);
        match integrator {
            // Auto merges where nothing else will do.
            Integrator::Auto => false,
            // Next-event estimation, or light with size met by chance.
            Integrator::Pt => class.delta_light && !open[0],
            // What the camera sees must be open to connections from light vertices.
            Integrator::Lt => !open[open.len() - 1],
            _ if merges => class.delta_light && !open.contains(&true),
            // Of caustics, what the camera sees in smooth surfaces.
            Integrator::LvcSds | Integrator::LvcHrrSds => {
                let first = open.iter().rposition(|open| *open);
                let caustic = first.is_some_and(|i| i > 0 && class.surfaces[i - 1] != Vertex::D);
                class.delta_light && !connected && !caustic
            }
            // Open at either end, or two in a row.
            _ => class.delta_light && !connected,
        }
    };
    let mut refused = 0;
    for scene in [
        plain(),
        with_cube(mirror()),
        with_cube(metal(1e-3, 1e-3)),
        lit(with_cube(mirror()), lamp_without_size()),
        lit(with_cube(metal(1e-3, 1e-3)), lamp_without_size()),
    ] {
        for integrator in Integrator::ALL {
            let named = Settings { integrator, ..settings() };
            let effects = analyze(&scene, &named);
            let missed = effects.classes.iter().find(|class| misses(integrator, class));
            match (planned(&scene, &named), missed) {
                (Ok(plan), None) => assert!(!plan.is_biased(), "{integrator}"),
                (Err(error), Some(class)) => {
                    let path = format!("paths {class}: {integrator} does not find them");
                    assert!(error.to_string().contains(&path), "{integrator}: {error}");
                    // Refused before anything is traced.
                    let error = render(&scene, &named, &Silent).unwrap_err();
                    assert!(error.to_string().contains(&path) && error.exit_code() == 5, "{error}");
                    refused += 1;
                    // Left out on demand, it is told.
                    let without = Effect::ALL
                        .into_iter()
                        .filter(|e| effects.classes.iter().any(|c| misses(integrator, c) && c.effect == *e));
                    let plan = planned(&scene, &Settings { without: without.collect(), ..named }).unwrap();
                    let complaint = plan.complaint().unwrap();
                    assert!(plan.is_biased() && complaint.contains(&class.to_string()), "{complaint}");
                }
                (plan, missed) => panic!("{integrator}: {plan:?}, though it misses {missed:?}"),
            }
        }
    }
    assert_eq!(refused, 8, "lt twice; pt, bpt, lvc and so on under the lamp");
}

/// A lamp without size over a diffuse floor, and a smooth mirror.
fn place_with_a_mirror() -> Place {
    let place = Place::new();
    let append = |name: &str, text: &str| {
        let old = fs::read_to_string(place.path(name)).unwrap();
        fs::write(place.path(name), old + text).unwrap();
    };
    append("scene.toml", "[[light]]\ntype = \"point\"\nposition = [0, 0.5, 0.5]\nintensity = [1, 1, 1]\n");
    append("box.obj", "v -1 0.5 -1\nv 1 0.5 -1\nusemtl mirror\nf 1 2 10 9\n");
    append("box.mtl", "newmtl mirror\nKs 0.9\nillum 3\n");
    place
}

#[test]
fn the_program_refuses_or_marks_the_image() {
    let place = place_with_a_mirror();
    let (code, _, err) = place.run("render scene.toml -o a.exr --integrator pt");
    assert_eq!(code, 5, "{err}");
    assert!(err.contains("paths L S D E (from a light without size): pt does not find them"), "{err}");
    assert!(!place.path("a.exr").exists());

    let flags = "--integrator auto --max-depth 6 --without sds --stats s.json";
    let (code, _, err) = place.run(&format!("render scene.toml -o a.exr {flags}"));
    assert_eq!(code, 0, "{err}");
    let complaint =
        "the image is biased; left out: sds; lvc does not find L S D S E (from a light without size)";
    assert!(err.contains(complaint), "{err}");
    let read = |name: &str| -> serde_json::Value {
        serde_json::from_slice(&fs::read(place.path(name)).unwrap()).unwrap()
    };
    let stats = read("s.json");
    assert_eq!((&stats["biased"], &stats["integrator"]), (&true.into(), &"lvc".into()));
    let machinery: Vec<_> =
        stats["machinery"].as_array().unwrap().iter().map(|m| m.as_str().unwrap()).collect();
    assert!(machinery.contains(&"light_image") && !machinery.contains(&"merging"), "{machinery:?}");
    let attributes = hrr::image::read_attributes(&place.path("a.exr")).unwrap();
    assert_eq!(attributes.get("hrr:biased"), Some(&Value::Int(1)));
    assert_eq!(attributes.get("hrr:machinery"), Some(&Value::Text(machinery.join(" "))));

    let (code, _, err) =
        place.run("render scene.toml -o b.exr --integrator auto --max-depth 6 --stats s.json");
    assert!(code == 0 && !err.contains("biased"), "{err}");
    assert_eq!(
        (&read("s.json")["biased"], &read("s.json")["integrator"]),
        (&false.into(), &"lvc+sds".into())
    );
    let attributes = hrr::image::read_attributes(&place.path("b.exr")).unwrap();
    assert_eq!(attributes.get("hrr:biased"), Some(&Value::Int(0)));
}

#[test]
fn what_hrr_has_not_got_is_a_row_with_its_witness() {
    let place = Place::new();
    let mtl = "newmtl floor\nKd 0.6\nPs 0.5\nmap_Ks a.png\nnewmtl lamp\nKd 0\nKe 5\nPs 1\nnewmtl unused\nbump b.png\n";
    fs::write(place.path("box.mtl"), mtl).unwrap();
    let (code, out, err) = place.run("effects scene.toml --format json");
    assert_eq!(code, 0, "{err}");
    assert!(
        err.contains("box.mtl:3: material 'floor': Ps (sheen) is not supported yet (and 1 more"),
        "{err}"
    );
    let report: serde_json::Value = serde_json::from_str(&out).unwrap();
    let rows = report["effects"].as_array().unwrap();
    let unsupported: Vec<_> = rows.iter().filter(|row| row["verdict"] == "unsupported").collect();
    let cell = |row: usize, key: &str| unsupported[row][key].to_string();
    assert_eq!(unsupported.len(), 2, "no triangle uses the third: {out}");
    assert_eq!((cell(0, "id"), cell(0, "materials")), ("\"Ps\"".into(), "[\"floor\",\"lamp\"]".into()));
    assert_eq!((cell(1, "id"), cell(1, "materials")), ("\"map_Ks\"".into(), "[\"floor\"]".into()));
    assert_eq!((cell(0, "machinery"), rows.len()), ("[]".into(), Effect::ALL.len() + 2));

    let (code, out, _) = place.run("effects scene.toml --why Ps");
    assert!(code == 0 && out.starts_with("Ps: unsupported: Ps (sheen) is not supported yet\n"), "{out}");
    assert!(out.contains("floor, first triangle 0: box.mtl:3\n") && out.contains("lamp"), "{out}");
    let (code, out, _) = place.run("effects scene.toml");
    let row = out.lines().find(|l| l.starts_with("map_Ks ")).unwrap();
    assert!(code == 0 && row.contains("unsupported") && row.contains("(floor)"), "{out}");
    // Said at the top of a render as well, and in its statistics.
    let (code, out, err) = place.run("render scene.toml -o a.exr --stats -");
    assert!(code == 0 && err.contains(&format!("{:<18} unsupported", "map_Ks")), "{err}");
    assert_eq!(serde_json::from_str::<serde_json::Value>(&out).unwrap()["effects"]["Ps"], "unsupported");
}
