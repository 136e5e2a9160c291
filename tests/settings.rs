//! The settings table, the struct behind it and its TOML are one thing.

use hrr::settings::{
    AutoSwitch, Backend, EmbreeBuild, Heuristic, Integrator, Kind, LightChoice, LobePrecision, MinimumRule,
    Range, Setting, Settings, Switch, TABLE,
};

/// A value of each setting that is not its default. A new setting has no entry here yet: the tests say so.
fn other_value(name: &str) -> &'static str {
    match name {
        "integrator" => "lvc+hrr",
        "with" => "sds",
        "without" => "caustics,lens",
        "max_depth" => "7",
        "samples" => "2",
        "light_subpaths" => "1234",
        "connections" => "3",
        "expected" => "0.25",
        "axis_probability" => "2.5",
        "emitters" => "on",
        "range" => "spheroid",
        "minimum" => "exact",
        "lobe_precision" => "f32",
        "lobe_widening" => "2.0",
        "lobe_floor" => "0.125",
        "node_padding" => "8.0",
        "embree_robust" => "off",
        "embree_build" => "low",
        "storing" => "0.5",
        "light_choice" => "place",
        "guiding" => "off",
        "mis" => "power",
        "reused_subpaths" => "50",
        "record_spacing" => "4",
        "merge_radius" => "0.5",
        "merge_pixels" => "5.0",
        "merge_shrink" => "1.0",
        "hrr_alpha" => "0.125",
        "iterations" => "9",
        "memory" => "3.5",
        "adaptive" => "off",
        "outlier_rejection" => "on",
        "time" => "30.5",
        "error" => "0.25",
        "first_iteration" => "64",
        "seed" => "9223372036854775807",
        "visibility" => "brute",
        "threads" => "2",
        _ => panic!("give '{name}' a value to test with"),
    }
}

fn all_changed() -> Settings {
    let mut settings = Settings::default();
    for setting in TABLE {
        settings.set(setting.name, other_value(setting.name)).unwrap();
    }
    settings
}

#[test]
fn every_field_has_its_row() {
    // A pattern without `..`: a field that is added to the struct must be added here, and to the table.
    let Settings {
        integrator,
        with,
        without,
        max_depth,
        visibility,
        iterations,
        first_iteration,
        time,
        error,
        memory,
        seed,
        threads,
        samples,
        light_subpaths,
        connections,
        expected,
        axis_probability,
        hrr_alpha,
        range,
        minimum,
        lobe_precision,
        lobe_widening,
        lobe_floor,
        node_padding,
        embree_robust,
        embree_build,
        storing,
        emitters,
        light_choice,
        guiding,
        adaptive,
        outlier_rejection,
        mis,
        reused_subpaths,
        record_spacing,
        merge_radius,
        merge_pixels,
        merge_shrink,
    } = all_changed();
    assert_eq!((integrator, visibility), (Integrator::LvcHrr, Backend::Brute));
    assert_eq!((max_depth, samples, light_subpaths, connections), (7, 2, 1234, 3));
    assert_eq!((iterations, first_iteration, time, seed), (9, 64, Some(30.5), i64::MAX as u64));
    assert_eq!(error, Some(0.25));
    assert_eq!((threads, memory, expected, hrr_alpha, mis), (2, 3.5, 0.25, 0.125, Heuristic::Power));
    assert_eq!((range, minimum), (Range::Spheroid, MinimumRule::Exact));
    assert_eq!((lobe_precision, lobe_widening, lobe_floor), (LobePrecision::F32, 2.0, 0.125));
    assert_eq!((node_padding, embree_robust, embree_build), (8.0, Switch::Off, EmbreeBuild::Low));
    assert_eq!((merge_radius, merge_pixels, merge_shrink), (0.5, 5.0, 1.0));
    assert_eq!((reused_subpaths, record_spacing), (50, 4));
    assert_eq!((light_choice, TABLE.len()), (LightChoice::Place, 38));
    assert_eq!((storing, guiding, adaptive), (0.5, AutoSwitch::Off, Switch::Off));
    assert_eq!(outlier_rejection, Switch::On);
    assert_eq!((axis_probability, emitters), (Some(2.5), AutoSwitch::On));
    assert_eq!((with.to_string(), without.to_string()), ("sds".into(), "caustics,lens".into()));
}

#[test]
fn each_row_changes_only_its_own_field() {
    for changed in TABLE {
        let mut settings = Settings::default();
        settings.set(changed.name, other_value(changed.name)).unwrap();
        for setting in TABLE {
            let now = setting.get(&settings).unwrap_or_default();
            if setting.name == changed.name {
                assert_eq!(now, other_value(setting.name));
                assert_ne!(now, setting.default, "{}: not a value to test with", setting.name);
            } else {
                assert_eq!(now, setting.default, "{} changed {}", changed.name, setting.name);
            }
        }
    }
}

#[test]
fn toml_tells_everything() {
    for settings in [Settings::default(), all_changed()] {
        let text = settings.to_toml();
        let table: toml::Table = text.parse().unwrap();
        let mut read = Settings::default();
        // In the order of the text: a toml::Table is sorted.
        for line in text.lines() {
            let name = line.split(" = ").next().unwrap();
            let value = match &table[name] {
                toml::Value::String(text) => text.clone(),
                number => number.to_string(),
            };
            read.set(name, &value).unwrap();
        }
        assert_eq!(read, settings);
    }
    assert!(!Settings::default().to_toml().contains("time"));
}

#[test]
fn names_are_words_with_underscores_and_helps_are_one_line() {
    for s in TABLE {
        assert!(s.name.chars().all(|c| c.is_ascii_lowercase() || c == '_'), "{}", s.name);
        assert!(!s.help.is_empty() && !s.help.ends_with('.') && !s.help.contains('\n'), "{}", s.name);
        assert_eq!(Setting::find(&s.name.replace('_', "-")).map(|found| found.name), Some(s.name));
        if let Kind::Choice { names, planned, .. } = s.kind {
            assert!(names.iter().all(|n| !planned.contains(n)));
        }
    }
}
