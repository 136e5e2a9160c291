//! The program, from outside: what it prints, writes and returns.

use crate::support::program::{Place, SCENE, finish};
use hrr::image::{self, Value};
use hrr::settings::{Kind, TABLE};
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::Stdio;

#[test]
fn help_teaches_every_setting() {
    let (code, out, err) = Place::new().run("render --help");
    assert_eq!((code, err.as_str()), (0, ""));
    // Lines are broken by the terminal's width.
    let out = out.split_whitespace().collect::<Vec<_>>().join(" ");
    for setting in TABLE {
        let flag = format!("--{} <{}>", setting.name.replace('_', "-"), setting.value_name);
        assert!(out.contains(&flag), "{flag}");
        assert!(out.contains(setting.help), "{}", setting.help);
        if let Kind::Choice { names, .. } = setting.kind {
            assert!(out.contains(&names.join(", ")), "{}", setting.name);
        }
    }
    for word in ["Examples:", "Exit codes:", "--size <WxH>", "--stats <FILE>", "-D, --define", "--exposure"] {
        assert!(out.contains(word), "{word}");
    }
    let (code, short, _) = Place::new().run("render -h");
    assert!(code == 0 && !short.contains("Examples:"), "the short help is short");
}

#[test]
fn without_a_command_help_is_an_error_and_with_version_it_is_data() {
    let place = Place::new();
    let (code, out, err) = place.run("");
    assert_eq!((code, out.as_str()), (2, ""));
    assert!(err.contains("render"), "{err}");
    let (code, out, _) = place.run("--version");
    assert_eq!(code, 0);
    assert!(out.starts_with(concat!("hrr ", env!("CARGO_PKG_VERSION"))), "{out}");
}

#[test]
fn a_wrong_command_line_is_exit_code_2_with_a_suggestion() {
    let place = Place::new();
    for (line, wanted) in [
        ("render scene.toml -o a.exr --max-dept 3", "--max-depth"),
        ("rendr scene.toml", "render"),
        ("render scene.toml", "--output <FILE>"),
        ("render scene.toml -o a.exr --size 0x10", "WIDTHxHEIGHT"),
        ("render scene.toml -o a.exr --size 10x0", "WIDTHxHEIGHT"),
        ("render scene.toml -o a.exr --max-depth 0", "from 1 to 65535"),
        ("render scene.toml -o a.exr --samples -1", "from 0 to 65535"),
        ("render scene.toml -o a.exr --integrator lvc-hrr", "did you mean 'lvc+hrr'?"),
        ("render scene.toml -o a.exr --iterations 3 --time 1", "cannot be used with"),
        ("render scene.toml -o a.exr -D camera.fov=30", "fov_y"),
        ("render scene.toml -o a.exr -D nonsense", "KEY=VALUE"),
    ] {
        let (code, out, err) = place.run(line);
        assert_eq!((code, out.as_str()), (2, ""), "{line}: {err}");
        assert!(err.starts_with("hrr: ") && err.contains(wanted), "{line}: {err}");
    }
    assert!(!place.path("a.exr").exists());
}

#[test]
fn a_missing_or_broken_scene_is_exit_code_3_and_named() {
    let place = Place::new();
    let (code, _, err) = place.run("render none.toml -o a.exr");
    assert_eq!(code, 3);
    assert!(err.starts_with("hrr: none.toml: "), "{err}");

    fs::write(place.path("broken.toml"), SCENE.replace("max_depth", "max_dept")).unwrap();
    let (code, _, err) = place.run("render broken.toml -o a.exr");
    assert_eq!(code, 3);
    assert!(err.starts_with("hrr: broken.toml:13: ") && err.contains("'max_depth'"), "{err}");
    assert!(!place.path("a.exr").exists());
}

#[test]
fn an_output_that_cannot_be_written_is_exit_code_4_before_anything_is_done() {
    let place = Place::new();
    for (flags, wanted) in [
        ("-o none/a.exr", "there is no directory 'none'"),
        ("-o a.bmp", ".exr or .png"),
        ("-o a", ".exr or .png"),
        ("-o a.exr -o scene.toml/a.png", "cannot be written"),
        ("-o a.exr --stats none/s.json", "there is no directory 'none'"),
        ("-o a.exr --stats .", "is a directory"),
    ] {
        // Even the scene is not looked at.
        let (code, _, err) = place.run(&format!("render not-there.toml {flags}"));
        assert_eq!(code, 4, "{flags}: {err}");
        assert!(err.starts_with("hrr: ") && err.contains(wanted), "{flags}: {err}");
    }
    assert_eq!(place.names(), ["box.mtl", "box.obj", "scene.toml"]);
}

#[test]
fn what_is_to_come_is_exit_code_5() {
    let place = Place::new();
    let (code, _, err) = place.run("render scene.toml -o a.exr --integrator bpt+hrr");
    assert_eq!(code, 5);
    assert!(err.starts_with("hrr: --integrator: not supported: "), "{err}");

    fs::write(place.path("pcvcm.toml"), SCENE.replace("\"pt\"", "\"bpt+hrr\"")).unwrap();
    let (code, _, err) = place.run("render pcvcm.toml -o a.exr");
    assert_eq!(code, 5);
    assert!(err.starts_with("hrr: pcvcm.toml:11: not supported: "), "{err}");
}

#[test]
fn effects_are_told_as_the_contract_says() {
    let place = Place::new();
    let (code, out, err) = place.run("effects scene.toml --format json -q");
    assert_eq!((code, err.as_str()), (0, ""), "{out}");
    let report: serde_json::Value = serde_json::from_str(&out).unwrap();
    let ids: Vec<_> =
        report["effects"].as_array().unwrap().iter().map(|e| e["id"].as_str().unwrap()).collect();
    assert_eq!(
        ids.join(" "),
        "direct interreflection light_subpaths caustics sdg sds specular refraction opacity textures \
         emission_textures normal_maps anisotropy environment lens two_sided_emission"
    );
    let direct = &report["effects"][0];
    assert_eq!((&direct["verdict"], &direct["machinery"][0]), (&"wanted".into(), &"next_event".into()));
    assert!(direct["cost_percent"].is_number() && !direct["why"].as_str().unwrap().is_empty());
    assert!(report["plan"]["integrator"].is_string() && report["plan"]["machinery"].is_array());

    let (code, out, _) = place.run("effects scene.toml --why direct");
    assert!(code == 0 && out.starts_with("direct: wanted: ") && out.contains("first triangle"), "{out}");
    let (code, out, _) = place.run("effects scene.toml");
    assert!(code == 0 && out.starts_with("effect ") && out.contains("\nplan: "), "{out}");
    let (code, _, err) = place.run("effects scene.toml --why caustic");
    assert!(code == 2 && err.contains("did you mean 'caustics'?"), "{err}");
    // What is left out is said in the image.
    let (code, _, err) = place.run("render scene.toml -o a.exr --without direct");
    assert!(code == 0 && err.contains("the image is biased"), "{err}");
    let attributes = image::read_attributes(&place.path("a.exr")).unwrap();
    assert_eq!(attributes.get("hrr:biased"), Some(&Value::Int(1)));
}

#[test]
fn images_and_statistics_are_written() {
    let place = Place::new();
    let (code, out, err) = place.run("render scene.toml -o a.exr -o b.png --stats s.json --exposure 1");
    assert_eq!((code, out.as_str()), (0, ""), "{err}");
    assert!(err.lines().last().unwrap().starts_with("hrr: a.exr, b.png: 2 iterations in "), "{err}");
    assert_eq!(place.names(), ["a.exr", "b.png", "box.mtl", "box.obj", "s.json", "scene.toml"]);

    let exr = image::read(&place.path("a.exr")).unwrap();
    assert_eq!((exr.width, exr.height), (12, 8));
    assert!(exr.pixels.iter().any(|p| p.x > 0.0), "the floor is lit");
    let png = image::read_data(&place.path("b.png")).unwrap();
    for (linear, display) in exr.pixels.iter().zip(&png.pixels) {
        let expected = image::tone::to_srgb8(*linear, 1.0).map(|v| f32::from(v) / 255.0);
        assert_eq!(display.to_array(), expected);
    }

    let attributes = image::read_attributes(&place.path("a.exr")).unwrap();
    let text = |name: &str| match attributes.get(name) {
        Some(Value::Text(text)) => text.clone(),
        other => panic!("{name}: {other:?}"),
    };
    assert_eq!(attributes.get("samplesPerPixel"), Some(&Value::Int(2)));
    assert!(matches!(attributes.get("renderTimeSeconds"), Some(Value::Float(s)) if *s > 0.0));
    assert_eq!(text("hrr:version"), env!("CARGO_PKG_VERSION"));
    assert_eq!(text("hrr:sceneHash").len(), 16);
    assert_eq!(text("hrr:integrator"), "pt");
    assert_eq!(text("hrr:visibility"), "obvhs");
    assert!(text("hrr:settings").contains("max_depth = 3\n"));
    for (name, number) in [("hrr:seed", 0), ("hrr:iterations", 2), ("hrr:biased", 0)] {
        assert_eq!(attributes.get(name), Some(&Value::Int(number)), "{name}");
    }
    assert!(matches!(attributes.get("hrr:threads"), Some(Value::Int(1..))));

    let stats: serde_json::Value = serde_json::from_slice(&fs::read(place.path("s.json")).unwrap()).unwrap();
    assert_eq!(stats["scene"], "scene.toml");
    assert_eq!((&stats["width"], &stats["height"], &stats["iterations"]), (&12.into(), &8.into(), &2.into()));
    assert_eq!(stats["counters"]["camera_rays"], 12 * 8 * 2);
    let total = stats["seconds"]["total"].as_f64().unwrap();
    assert!(
        total >= stats["seconds"]["render"].as_f64().unwrap() + stats["seconds"]["load"].as_f64().unwrap()
    );
    if cfg!(target_os = "linux") {
        assert!(stats["memory"]["peak_rss_bytes"].as_u64().unwrap() > 1 << 20);
    }
}

#[test]
fn an_image_without_outliers_is_marked_and_the_plain_one_stands_beside_it() {
    let place = Place::new();
    let (code, _, err) = place.run("render scene.toml -o a.exr --outlier-rejection on --stats s.json");
    assert_eq!(code, 0, "{err}");
    assert!(err.contains("outliers are rejected, which is biased; with them: a.plain.exr"), "{err}");
    let biased = |name: &str| image::read_attributes(&place.path(name)).unwrap().get("hrr:biased").cloned();
    assert_eq!((biased("a.exr"), biased("a.plain.exr")), (Some(Value::Int(1)), Some(Value::Int(0))));
    let stats: serde_json::Value = serde_json::from_slice(&fs::read(place.path("s.json")).unwrap()).unwrap();
    assert_eq!(stats["biased"], true);
    place.run("render scene.toml -o b.exr");
    let read = |name: &str| image::read(&place.path(name)).unwrap();
    assert_eq!(read("a.plain.exr"), read("b.exr"));

    fs::create_dir(place.path("c.plain.exr")).unwrap();
    let (code, _, err) = place.run("render scene.toml -o c.exr --outlier-rejection on");
    assert!(code == 4 && err.contains("c.plain.exr") && !place.path("c.exr").exists(), "{code}: {err}");
}

#[test]
fn statistics_on_stdout_have_the_contracts_names_and_no_others() {
    let place = Place::new();
    let (code, out, _) = place.run("render scene.toml -o a.exr --stats -");
    assert_eq!(code, 0);
    let stats: serde_json::Value = serde_json::from_str(&out).unwrap();
    let names = |value: &serde_json::Value| {
        let mut names: Vec<String> = value.as_object().unwrap().keys().cloned().collect();
        names.sort();
        names.join(" ")
    };
    assert_eq!(
        names(&stats),
        "biased counters effects height integrator iterations machinery memory scene seconds seed threads version \
         visibility width"
    );
    assert_eq!(
        names(&stats["seconds"]),
        "accel_build eye_trace film light_trace load render roulette total vertex_bvh_build visibility"
    );
    assert_eq!(
        names(&stats["counters"]),
        "accepted camera_rays connection_rays light_subpaths light_vertices nodes_visited queries \
         visible_connections"
    );
    assert_eq!(names(&stats["memory"]), "light_cache_bytes peak_rss_bytes vertex_bvh_bytes");
}

#[test]
fn a_flag_wins_over_the_file_which_wins_over_the_default() {
    let place = Place::new();
    let stats = |flags: &str| {
        let (code, out, err) = place.run(&format!("render scene.toml -o a.exr --stats - {flags}"));
        assert_eq!(code, 0, "{err}");
        serde_json::from_str::<serde_json::Value>(&out).unwrap()
    };
    let file = stats("");
    assert_eq!((&file["iterations"], &file["seed"]), (&2.into(), &0.into()));
    let flags = stats("--iterations 1 --seed 7 --size 5x4 --visibility brute --threads 1 --integrator lt");
    assert_eq!((&flags["iterations"], &flags["seed"]), (&1.into(), &7.into()));
    assert_eq!((&flags["width"], &flags["height"]), (&5.into(), &4.into()));
    assert_eq!((&flags["visibility"], &flags["integrator"]), (&"brute".into(), &"lt".into()));
    assert_eq!(flags["threads"], 1);
    let defined = stats("-D render.iterations=3 -D film.width=6");
    assert_eq!((&defined["iterations"], &defined["width"]), (&3.into(), &6.into()));
}

#[test]
fn quiet_is_silent_and_verbose_tells_more() {
    let place = Place::new();
    let (code, out, err) = place.run("render scene.toml -o a.exr --quiet");
    assert_eq!((code, out.as_str(), err.as_str()), (0, "", ""));
    let (_, _, err) = place.run("render none.toml -o a.exr --quiet");
    assert!(err.starts_with("hrr: none.toml"), "errors are never held back");
    let (_, _, normal) = place.run("render scene.toml -o a.exr");
    let (_, _, verbose) = place.run("render scene.toml -o a.exr -v");
    assert!(verbose.lines().count() > normal.lines().count() + 10, "{verbose}");
    assert!(verbose.contains("max_depth = 3") && verbose.contains("camera rays"), "{verbose}");
}

#[test]
fn nothing_but_plain_lines_goes_to_a_pipe() {
    let place = Place::new();
    for (name, value) in [("NO_COLOR", "1"), ("TERM", "xterm-256color")] {
        for line in ["render scene.toml -o a.exr", "render --help", "render scene.toml -o a.exr --max-dept 3"]
        {
            let output = place.command(line.split_whitespace()).env(name, value).output().unwrap();
            let (_, out, err) = finish(output);
            let plain = |text: &str| !text.contains(['\x1b', '\r']);
            assert!(plain(&out) && plain(&err), "{name} {line}: {out}{err}");
        }
    }
}

#[test]
fn time_is_a_budget_too() {
    let place = Place::new();
    let start = std::time::Instant::now();
    let (code, out, err) = place.run("render scene.toml -o a.exr --stats - --time 1");
    assert_eq!(code, 0, "{err}");
    let stats: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert!(stats["iterations"].as_u64().unwrap() > 2, "{out}");
    // The last hundredths of the time are not worth another iteration.
    assert!(stats["seconds"]["render"].as_f64().unwrap() >= 0.97 && start.elapsed().as_secs_f64() < 20.0);
}

/// Starts a render that takes very long and waits until it says that it renders.
#[cfg(unix)]
fn start(place: &Place, flags: &str) -> (std::process::Child, impl Iterator<Item = String> + use<>) {
    let line = format!("render scene.toml -o a.exr {flags}");
    let mut child =
        place.command(line.split(' ')).stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map(Result::unwrap);
    // The first line comes just before the signal is caught, a line of progress surely after it.
    lines.find(|line| line.contains("iteration ")).expect("a line of progress");
    (child, lines)
}

#[cfg(unix)]
fn interrupt(child: &std::process::Child) {
    use rustix::process::{Pid, Signal, kill_process};
    kill_process(Pid::from_child(child), Signal::INT).unwrap();
}

#[cfg(unix)]
#[test]
fn control_c_finishes_the_iteration_and_writes_the_image() {
    let place = Place::new();
    let (mut child, lines) = start(&place, "--time 1000");
    interrupt(&child);
    let rest: Vec<_> = lines.collect();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{rest:?}");
    assert!(rest.iter().any(|l| l.contains("finishing the iteration")), "{rest:?}");
    assert!(rest.last().unwrap().starts_with("hrr: stopped; a.exr: "), "{rest:?}");
    let picture = image::read(&place.path("a.exr")).unwrap();
    assert!(picture.pixels.iter().any(|p| p.x > 0.0));
    assert!(is_alone(&place.path("a.exr")));
}

#[cfg(unix)]
#[test]
fn a_second_control_c_stops_at_once() {
    let place = Place::new();
    // One iteration takes minutes.
    let (mut child, mut lines) = start(&place, "--size 8000x8000 --samples 1000 --iterations 1");
    interrupt(&child);
    lines.find(|l| l.contains("finishing the iteration")).unwrap();
    let asked = std::time::Instant::now();
    interrupt(&child);
    let status = loop {
        match child.try_wait().unwrap() {
            Some(status) => break status,
            None if asked.elapsed().as_secs() > 20 => {
                child.kill().unwrap();
                panic!("still running");
            }
            None => std::thread::sleep(std::time::Duration::from_millis(20)),
        }
    };
    assert_eq!(status.code(), Some(130));
    assert!(!place.path("a.exr").exists() && is_alone(&place.path("a.exr")));
}

/// Whether no unfinished file is left beside this one.
fn is_alone(path: &Path) -> bool {
    let entries = fs::read_dir(path.parent().unwrap()).unwrap();
    entries.into_iter().all(|e| !e.unwrap().file_name().to_string_lossy().ends_with(".tmp"))
}
