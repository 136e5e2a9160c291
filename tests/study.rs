//! `hrr cost` and `hrr predict`: what they write, and whether predictions come true.

use crate::support::program::Place;
use crate::support::scenes;
use hrr::report::curve::curves;
use hrr::report::results::Results;
use hrr::report::study::{self, Contender};
use hrr::settings::{Backend, Integrator, Settings};
use std::fs;
use std::path::PathBuf;
use std::process::Command;

#[test]
fn cost_writes_a_report_that_can_be_drawn_again() {
    let place = Place::new();
    let (code, out, err) = place.run("cost scene.toml -o study --quick --runs 4 --seconds 3 --size 24x16");
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("The fastest to a given error is"), "{out}");
    let results = Results::read(&place.path("study/results.csv")).unwrap();
    let names = results.settings();
    assert_eq!(names, ["pt", "bpt", "lvc", "lvc+hrr", "pcbpt+hrr"]);
    for name in names {
        let rows: Vec<_> = results.rows.iter().filter(|r| r.setting == name).collect();
        assert!(rows.len() == 20 && rows.iter().filter(|r| r.rung == 2).count() == 4, "{name}");
        assert!(rows.iter().all(|r| r.seconds > r.setup && r.iterations > 0), "{name}");
    }
    let html = fs::read_to_string(place.path("study/report.html")).unwrap();
    assert!(!html.contains("http://") && !html.contains("https://"), "nothing comes from a network");
    let (code, again, err) = place.run("cost --replot study/results.csv -o study");
    assert_eq!((code, &again), (0, &out), "{err}");
    assert_eq!(fs::read_to_string(place.path("study/report.html")).unwrap(), html);
    let markdown = fs::read_to_string(place.path("study/report.md")).unwrap();
    assert!(
        markdown.contains("| lvc+hrr | 4 | ") && markdown.contains("![lvc+hrr](lvc+hrr.png)"),
        "{markdown}"
    );
    for name in ["curves", "pareto", "stages"] {
        let svg = fs::read_to_string(place.path(&format!("study/{name}.svg"))).unwrap();
        assert!(
            svg.starts_with("<svg xmlns=")
                && svg.contains("<style>")
                && markdown.contains(&format!("({name}.svg)"))
        );
    }

    let (code, _, err) = place.run("cost --replot scene.toml -o study");
    assert!(code == 3 && err.contains("scene.toml:2"), "{code} {err}");
    assert_eq!(place.run("cost -o study").0, 2);
}

/// Moves the slider and picks another setting, in a real browser.
#[test]
#[ignore = "needs Chromium, which scripts/test.sh brings"]
fn reports_work_in_a_browser() {
    let place = Place::new();
    let (code, _, err) = place.run("cost scene.toml -o study --quick --runs 4 --seconds 3 --size 24x16");
    assert_eq!(code, 0, "{err}");
    let html = fs::read_to_string(place.path("study/report.html")).unwrap();
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let found: Option<PathBuf> =
        std::env::split_paths(&paths).flat_map(|p| names.map(|n| p.join(n))).find(|p| p.is_file());
    let browser = found.expect("chromium, chromium-browser or google-chrome in PATH");
    let before = "<script>window.faults=[];addEventListener('error',e=>faults.push(e.message));\
                  console.error=m=>faults.push(String(m));</script>";
    let after = "<script>addEventListener('load',()=>{\
                 const g=id=>document.getElementById(id),clip=()=>getComputedStyle(g('front')).clipPath;\
                 const first=clip();g('knob').value=80;g('knob').dispatchEvent(new Event('input'));\
                 const src=g('front').src;g('pick').selectedIndex=1;g('pick').dispatchEvent(new Event('change'));\
                 document.body.dataset.seen=[faults.length,document.querySelectorAll('#curves .curve').length,\
                 document.querySelectorAll('#stages rect').length>5,first!==clip(),clip(),src!==g('front').src,\
                 document.querySelector('#slider img').naturalWidth,g('curves').getBoundingClientRect().width>100].join('|');\
                 });</script>";
    let page =
        html.replace("</head>", &format!("{before}</head>")).replace("</body>", &format!("{after}</body>"));
    fs::write(place.path("seen.html"), page).unwrap();
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"])
        .args(["--disable-background-networking", "--disable-component-update", "--disable-sync"])
        .args(["--virtual-time-budget=5000", "--dump-dom"])
        .arg(format!("--user-data-dir={}", place.path("profile").display()))
        .arg(format!("file://{}", place.path("seen.html").display()))
        .output()
        .unwrap();
    let dom = String::from_utf8_lossy(&output.stdout);
    let seen = dom.split("data-seen=\"").nth(1).and_then(|s| s.split('"').next());
    let seen = seen.unwrap_or_else(|| panic!("no answer: {}", String::from_utf8_lossy(&output.stderr)));
    assert_eq!(seen, "0|5|true|true|inset(0px 20% 0px 0px)|true|24|true");
}

#[test]
fn cost_compares_the_values_it_is_told() {
    let place = Place::new();
    let line = "cost scene.toml -o study --quick --runs 4 --seconds 2 --size 12x8 --integrator lvc+hrr \
                --sweep range=spheroid,sphere --sweep minimum=pregenerated";
    let (code, _, err) = place.run(line);
    assert_eq!(code, 0, "{err}");
    let results = Results::read(&place.path("study/results.csv")).unwrap();
    let names = results.settings();
    assert_eq!(names[0], "lvc+hrr");
    assert_eq!(names[names.len() - 3..], ["range=spheroid", "range=sphere", "minimum=pregenerated"]);
    assert!(results.rows.iter().all(|r| (0.0..=1.0).contains(&r.flip)));
    if cfg!(unix) {
        assert!(results.rows.iter().all(|r| r.cpu.is_some_and(|s| s > 0.0)));
    }
    let (code, _, err) = place.run("cost scene.toml -o study --sweep range=cube");
    assert!(code == 2 && err.contains("one of ellipsoid, spheroid, sphere"), "{code} {err}");
}

#[test]
fn predict_tells_time_or_refuses() {
    let place = Place::new();
    let (code, out, err) =
        place.run("predict scene.toml --error 0.01 --runs 6 --seconds 2 --size 24x16 --integrator lvc");
    assert!(code == 0 || (code == 1 && err.contains("no promise")), "{code} {err}");
    assert!(out.contains("held out: ") && out.contains("an error of 1.0 % takes "), "{out}");
    for (line, wanted) in [("", "--error"), ("--error 0.01 --integrator vcm", "blurs")] {
        let (code, _, err) = place.run(&format!("predict scene.toml {line}"));
        assert!(code == 2 && err.contains(wanted), "{line}: {err}");
    }
}

/// Over scenes and integrators the longest rung lies where the others predict it, and the time to its error as well.
#[test]
#[ignore = "times renders for a minute; see docs/cost.md"]
fn predictions_come_true() {
    let box_below = [
        ("camera.target", "[0, 0.7, 0]"),
        ("camera.fov_y", "22"),
        ("film.width", "16"),
        ("film.height", "16"),
    ];
    let all = [
        ("cornell", scenes::load("cornell", &[("film.width", "16"), ("film.height", "16")])),
        ("below", scenes::load("cornell", &box_below)),
        ("everything", scenes::box_of_everything()),
    ];
    let (mut cases, mut inside, mut factors) = (0, 0, Vec::new());
    for (name, scene) in &all {
        let list = [Integrator::Pt, Integrator::Bpt, Integrator::Lvc, Integrator::LvcHrr];
        let contenders = list.map(|integrator| Contender {
            name: integrator.name().into(),
            settings: Settings {
                integrator,
                visibility: Backend::BEST,
                samples: 1,
                light_subpaths: 512,
                max_depth: 5,
                ..scenes::settings()
            },
            biased: false,
        });
        let study = study::run(scene, &contenders, 16, 8.0, None, 0.0, &|_| true).unwrap();
        for curve in curves(&Results { about: Vec::new(), rows: study.rows }) {
            let p = curve.prediction.unwrap();
            cases += 1;
            inside += u32::from(p.error.holds(p.measured));
            factors.push((p.seconds / p.measured_seconds).ln().abs().exp());
            println!("{name} {}: {p:?}", curve.name);
        }
    }
    factors.sort_by(f64::total_cmp);
    println!("{inside} of {cases} inside; factors of time {factors:?}");
    assert!(inside * 10 >= cases * 8, "{inside} of {cases} predictions hold the truth");
    assert!(factors[factors.len() * 9 / 10] < 1.5, "{factors:?}");
}
