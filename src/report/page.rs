//! A study as one HTML page that needs nothing else: sentences on top, then table, charts and images.

use super::bootstrap::Interval;
use super::chart::{self, Line, number};
use super::curve::Curve;
use super::results::{Results, STAGES};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::fmt::Write;

/// The pictures of a page, as PNG files.
#[derive(Debug, Clone)]
pub struct Pictures {
    /// The reference.
    pub reference: Vec<u8>,
    /// Name, image and deviation map of each setting.
    pub settings: Vec<(String, Vec<u8>, Vec<u8>)>,
}

const STYLE: &str = "\
body{font:16px/1.5 system-ui,sans-serif;max-width:1080px;margin:2em auto;padding:0 1em;color:#1c1c1c;background:#fff}\
h1{font-size:1.6em}h2{font-size:1.2em;margin-top:2em}table{border-collapse:collapse;font-size:.82em}\
td,th{padding:.25em .6em;white-space:nowrap;border-bottom:1px solid #ddd;text-align:right}td:first-child,th:first-child{text-align:left}\
svg{width:100%;height:auto}.lead li{margin:.4em 0}.wide{overflow-x:auto}small{color:#666}\
#slider{position:relative;width:100%;max-width:720px;line-height:0}#slider img{width:100%;image-rendering:pixelated}\
#front{position:absolute;inset:0;clip-path:inset(0 50% 0 0)}#map{width:100%;max-width:720px;image-rendering:pixelated}\
input[type=range]{width:100%;max-width:720px}.about{font-size:.85em;color:#444;overflow-wrap:anywhere}.about td{white-space:normal}";

const SCRIPT: &str = "\
const get=id=>document.getElementById(id),knob=get('knob'),pick=get('pick');\
function move(){get('front').style.clipPath='inset(0 '+(100-knob.value)+'% 0 0)';}\
function choose(){const o=pick.options[pick.selectedIndex];get('front').src=o.dataset.image;get('map').src=o.dataset.map;}\
if(knob){knob.addEventListener('input',move);pick.addEventListener('change',choose);choose();move();}";

/// The page.
pub fn page(results: &Results, curves: &[Curve], pictures: Option<&Pictures>) -> String {
    let about = |name: &str| results.about.iter().find(|(n, _)| n == name).map_or("", |(_, v)| v.as_str());
    let title = format!("What accuracy costs: {}", escape(about("scene")));
    let mut s = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" \
         content=\"width=device-width\"><title>{title}</title><style>{STYLE}{}</style></head><body>\n<h1>{title}</h1>\n<ul \
         class=\"lead\">\n",
        chart::STYLE
    );
    for sentence in sentences(curves) {
        let _ = writeln!(s, "<li>{}</li>", escape(&sentence));
    }
    let _ = writeln!(s, "</ul>\n<p>{EXPLANATION}</p>");
    s += "<h2>Settings</h2>\n";
    s += &table(curves);
    for figure in figures(curves) {
        let _ = writeln!(s, "<h2>{}</h2>\n<p>{}</p>\n{}", figure.title, figure.text, figure.svg);
    }
    if let Some(pictures) = pictures {
        s += &slider(pictures);
    }
    s += "<h2>How this was made</h2>\n<table class=\"about\">\n";
    for (name, value) in &results.about {
        let _ = writeln!(
            s,
            "<tr><td>{}</td><td style=\"text-align:left\">{}</td></tr>",
            escape(name),
            escape(value)
        );
    }
    let _ = writeln!(
        s,
        "</table>\n<p class=\"about\">All numbers are in results.csv; <code>hrr cost --replot results.csv -o \
          DIR</code> draws this page again.</p>\n<script>{SCRIPT}</script></body></html>"
    );
    s
}

/// What the numbers are.
pub(super) const EXPLANATION: &str = "Error: the root of the mean square difference from the reference, each pixel's \
    relative to the brightness of the 16 x 16 pixels around it, the worst thousandth of the pixels left out; beside it, with all \
    pixels. Speed: how many times as fast as the first setting to an equal error. What a setting finds rarely, in few bright \
    pixels, counts in the second only. Intervals hold the truth with 90 % confidence.";

/// A chart with what is said about it.
#[derive(Debug, Clone)]
pub struct Figure {
    /// Name, as of a file.
    pub name: &'static str,
    /// Heading.
    pub title: &'static str,
    /// How to read it.
    pub text: &'static str,
    /// The chart, for a page of HTML; [`chart::file`] makes a file of it.
    pub svg: String,
}

/// The charts of a study.
pub fn figures(curves: &[Curve]) -> Vec<Figure> {
    // More lines than colours are a thicket: what is not told apart from the first says nothing there.
    let drawn = |c: &&Curve| {
        curves.len() <= chart::COLOURS.len()
            || c.name == curves[0].name
            || told_apart(c.speedup)
            || told_apart(c.whole.speedup)
    };
    let lines: Vec<Line> = curves.iter().filter(drawn).map(line).collect();
    let points: Vec<Line> = curves.iter().map(point).collect();
    let stages: Vec<(String, Vec<f64>)> =
        curves.iter().map(|c| (escape(&c.name), c.stages.to_vec())).collect();
    vec![
        Figure {
            name: "curves",
            title: "Error against time",
            text: "Lower is better. With iterations of one size noise halves in four times the time: a slope of -1/2. A \
                   cross is what the shorter runs predicted for the longest. Of more than ten settings those are drawn that are \
                   told apart from the first.",
            svg: chart::log_log("curves", &lines, ["seconds", "error"], true),
        },
        Figure {
            name: "pareto",
            title: "Usual error against that of all pixels",
            text: "Lower left is better, after the longest runs. Far up are settings that find some light rarely, and \
                   then brightly.",
            svg: chart::log_log("pareto", &points, ["error", "error, all pixels"], false),
        },
        Figure {
            name: "stages",
            title: "Where the time goes",
            text: "Each bar is the time of one setting, all threads together.",
            svg: chart::bars("stages", &STAGES, &stages),
        },
    ]
}

/// What the study says, in words.
pub fn sentences(curves: &[Curve]) -> Vec<String> {
    let mut said = Vec::new();
    let to_one_percent = |unit: Interval| {
        let [value, low, high] = [unit.value, unit.low, unit.high].map(|u| seconds(u * 1e4));
        format!("an error of 1 % takes about {value} ({low} to {high})")
    };
    if let Some(best) = fastest(curves, |c| (c.whole.unit, c.whole.speedup)) {
        said.push(format!(
            "The fastest to a given error is {}, all pixels counted: {}.",
            best.name,
            to_one_percent(best.whole.unit)
        ));
        if let [first, .., last] = &best.rungs[..] {
            let slope = (last.error.value / first.error.value).ln() / (last.seconds / first.seconds).ln();
            said.push(format!(
                "With {}, halving the error costs {:.1} times the time; iterations of one size would cost 4.",
                best.name,
                0.5f64.powf(1.0 / slope)
            ));
        }
    }
    if let Some(best) = fastest(curves, |c| (c.unit, c.speedup)) {
        said.push(format!(
            "Without the worst thousandth of the pixels the fastest is {}: {}.",
            best.name,
            to_one_percent(best.unit)
        ));
    }
    if let Some(first) = curves.first() {
        let mut open = Vec::new();
        for c in &curves[1..] {
            let s = c.speedup;
            if s.value.is_finite() && c.is_unresolved() {
                open.push(format!("{} ({} to {})", c.name, number(s.low), number(s.high)));
                continue;
            }
            said.push(if !s.value.is_finite() {
                format!(
                    "Between {} and {} nothing can be said: an error was too small to measure.",
                    c.name, first.name
                )
            } else if s.value > 1.0 {
                format!(
                    "{} reaches the error of {} in {} of its time: {} times as fast ({} to {}).",
                    c.name,
                    first.name,
                    percent(1.0 / s.value),
                    number(s.value),
                    number(s.low),
                    number(s.high)
                )
            } else {
                format!(
                    "{} takes {} times as long as {} to the same error ({} to {}).",
                    c.name,
                    number(1.0 / s.value),
                    first.name,
                    number(1.0 / s.high),
                    number(1.0 / s.low)
                )
            });
        }
        if !open.is_empty() {
            said.push(format!(
                "Not told apart from {}, with the speeds that are possible: {}.",
                first.name,
                open.join(", ")
            ));
        }
        said.extend(with_all_pixels(first, &curves[1..]));
    }
    let predictions: Vec<_> = curves.iter().filter_map(|c| c.prediction.as_ref()).collect();
    if !predictions.is_empty() {
        let inside = predictions.iter().filter(|p| p.error.holds(p.measured)).count();
        said.push(format!(
            "Of {} settings the shorter runs predicted the longest one's error {} times within the interval of 90 %.",
            predictions.len(),
            inside
        ));
    }
    let rare: Vec<&str> = curves.iter().filter(|c| c.rare).map(|c| c.name.as_str()).collect();
    if !rare.is_empty() {
        said.push(format!(
            "Rare bright samples make the error of {}: shorter runs say nothing of longer ones there.",
            rare.join(", ")
        ));
    }
    if curves.iter().any(|c| c.biased) {
        said.push("Settings with vertex merging blur: their error holds blur as well as noise.".into());
        said.extend(curves.iter().filter_map(|c| Some((c, c.blur?))).map(|(c, blur)| {
            let square = |part: f64| percent(part.sqrt());
            if blur.blur == 0.0 {
                return format!("Of {}'s error no blur is seen beside the noise.", c.name);
            }
            if blur.is_like_noise() {
                return format!("Of {}'s error blur is not told from noise: all of it falls as noise does.", c.name);
            }
            format!(
                "{}: noise of {} and blur of {} in the first iteration; the blur's square falls as n^-{:.2}, and outweighs \
                 the noise from {} iterations on.",
                c.name,
                square(blur.noise),
                square(blur.blur),
                blur.exponent,
                number(blur.overtakes().max(1.0))
            )
        }));
    }
    said
}

/// The setting, of those that do not blur, with the least time to an error of 1; the first, where that is not told apart
/// from it. `times`: that time, and the speed over the first.
fn fastest(curves: &[Curve], times: impl Fn(&Curve) -> (Interval, Interval)) -> Option<&Curve> {
    let time = |c: &Curve| times(c).0.value;
    let resolved = |c: &&Curve| !c.biased && time(c) > 0.0 && time(c).is_finite();
    let best = curves.iter().filter(resolved).min_by(|a, b| time(a).total_cmp(&time(b)))?;
    curves.first().filter(resolved).filter(|_| times(best).1.holds(1.0)).or(Some(best))
}

/// Whether a speed over that of the first setting says which of the two is faster.
fn told_apart(speed: Interval) -> bool {
    speed.value.is_finite() && !speed.holds(1.0)
}

/// Speeds with all pixels counted; `None` where no others are told apart from the first.
fn with_all_pixels(first: &Curve, others: &[Curve]) -> Option<String> {
    let resolved = |c: &&Curve| told_apart(c.whole.speedup);
    let speed = |c: &Curve| {
        let s = c.whole.speedup;
        format!("{} {} ({} to {})", c.name, number(s.value), number(s.low), number(s.high))
    };
    let speeds: Vec<String> = others.iter().filter(resolved).map(speed).collect();
    (!speeds.is_empty()).then(|| {
        format!(
            "With all pixels counted, those as well where light is found rarely, speeds over that of {} are: {}.",
            first.name,
            speeds.join(", ")
        )
    })
}

/// Heads of the columns of [`cells`].
pub(super) const COLUMNS: [&str; 12] = [
    "setting",
    "runs",
    "seconds",
    "processor",
    "error",
    "seconds to 1 %",
    "speed",
    "error, all pixels",
    "speed, all pixels",
    "predicted",
    "FLIP",
    "fireflies",
];

/// The table: a line for each setting.
pub(super) fn cells(curves: &[Curve]) -> Vec<[String; COLUMNS.len()]> {
    let spread = |value: f64, low: f64, high: f64, text: &dyn Fn(f64) -> String| {
        format!("{} ({} to {})", text(value), text(low), text(high))
    };
    let mut lines = Vec::new();
    for c in curves {
        let Some(last) = c.rungs.last() else { continue };
        let (e, u, s, whole) = (last.error, c.unit, c.speedup, c.whole.error);
        let speed = |s: Interval| match c.name == curves[0].name {
            true => "1".to_owned(),
            false if !told_apart(s) => "not resolved".to_owned(),
            false => format!("x {}", spread(s.value, s.low, s.high, &number)),
        };
        lines.push([
            c.name.clone(),
            c.runs.to_string(),
            number(last.seconds),
            c.cpu.map_or("-".to_owned(), number),
            spread(e.value, e.low, e.high, &percent),
            if c.biased { "-".to_owned() } else { spread(u.value * 1e4, u.low * 1e4, u.high * 1e4, &number) },
            speed(s),
            spread(whole.value, whole.low, whole.high, &percent),
            speed(c.whole.speedup),
            c.prediction
                .as_ref()
                .map_or("-".to_owned(), |p| spread(p.error.value, p.error.low, p.error.high, &percent)),
            number(c.flip),
            number(c.fireflies),
        ]);
    }
    lines
}

fn table(curves: &[Curve]) -> String {
    let row = |tag: &str, cells: &[String]| {
        // An interval stands below its number.
        let text = |c: &String| escape(c).replacen(" (", "<br><small>(", 1);
        let end = |c: &String| if c.contains(" (") { "</small>" } else { "" };
        let cells: String = cells.iter().map(|c| format!("<{tag}>{}{}</{tag}>", text(c), end(c))).collect();
        format!("<tr>{cells}</tr>\n")
    };
    let body: String = cells(curves).iter().map(|line| row("td", line)).collect();
    format!(
        "<div class=\"wide\"><table id=\"settings\">{}{body}</table></div>\n",
        row("th", &COLUMNS.map(String::from))
    )
}

fn line(c: &Curve) -> Line {
    Line {
        name: escape(&c.name),
        points: c.rungs.iter().map(|r| [r.seconds, r.error.value, r.error.low, r.error.high]).collect(),
        marks: c.prediction.iter().map(|p| [p.measured_seconds, p.error.value]).collect(),
    }
}

fn point(c: &Curve) -> Line {
    let last = c.rungs.last();
    let points = last.map(|r| [r.error.value, c.whole.error.value, c.whole.error.low, c.whole.error.high]);
    Line { name: escape(&c.name), points: points.into_iter().collect(), marks: Vec::new() }
}

fn slider(pictures: &Pictures) -> String {
    let data = |png: &[u8]| format!("data:image/png;base64,{}", STANDARD.encode(png));
    let mut s = "<h2>Images</h2>\n<p>Left of the slider: a setting's first run. Right: the reference. Below: where a person would see a \
                 difference (FLIP), from black (none) to white.</p>\n<select id=\"pick\">"
        .to_owned();
    for (name, image, map) in &pictures.settings {
        let _ = write!(
            s,
            "<option data-image=\"{}\" data-map=\"{}\">{}</option>",
            data(image),
            data(map),
            escape(name)
        );
    }
    let _ = writeln!(
        s,
        "</select>\n<div id=\"slider\"><img alt=\"reference\" src=\"{}\"><img id=\"front\" alt=\"setting\"></div>\n<input \
         id=\"knob\" type=\"range\" min=\"0\" max=\"100\" value=\"50\" aria-label=\"slider\">\n<img id=\"map\" alt=\"deviation map\">",
        data(&pictures.reference)
    );
    s
}

fn percent(share: f64) -> String {
    format!("{} %", chart::digits(100.0 * share, 3))
}

fn seconds(s: f64) -> String {
    match s {
        s if s < 120.0 => format!("{} s", number(s)),
        s if s < 7200.0 => format!("{} min", number(s / 60.0)),
        s if s < 172_800.0 => format!("{} h", number(s / 3600.0)),
        s => format!("{} days", number(s / 86400.0)),
    }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
