//! A study as one HTML page that needs nothing else: sentences on top, then table, charts and images.

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
body{font:16px/1.5 system-ui,sans-serif;max-width:860px;margin:2em auto;padding:0 1em;color:#1c1c1c;background:#fff}\
h1{font-size:1.6em}h2{font-size:1.2em;margin-top:2em}table{border-collapse:collapse;font-size:.9em}\
td,th{padding:.3em .7em;border-bottom:1px solid #ddd;text-align:right}td:first-child,th:first-child{text-align:left}\
svg{width:100%;height:auto}svg text{font-size:12px;fill:#333}.grid{stroke:#e4e4e4}.band{opacity:.16}\
.curve{fill:none;stroke-width:2}.mark{fill:none;stroke-width:2}.lead li{margin:.4em 0}\
#slider{position:relative;width:100%;max-width:720px;line-height:0}#slider img{width:100%;image-rendering:pixelated}\
#front{position:absolute;inset:0;clip-path:inset(0 50% 0 0)}#map{width:100%;max-width:720px;image-rendering:pixelated}\
input[type=range]{width:100%;max-width:720px}.about{font-size:.85em;color:#444;overflow-wrap:anywhere}";

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
         content=\"width=device-width\"><title>{title}</title><style>{STYLE}</style></head><body>\n<h1>{title}</h1>\n<ul \
         class=\"lead\">\n"
    );
    for sentence in sentences(curves) {
        let _ = writeln!(s, "<li>{}</li>", escape(&sentence));
    }
    s += "</ul>\n<p>Error: the root of the mean square difference from the reference, each pixel's relative to the brightness \
          of the 16 x 16 pixels around it, the worst thousandth of the pixels left out. Intervals hold the truth with 90 % \
          confidence.</p>\n";
    s += "<h2>Settings</h2>\n";
    s += &table(curves);
    s += "<h2>Error against time</h2>\n<p>Lower is better. Noise halves in four times the time: a slope of -1/2. A cross is what \
          the shorter runs predicted for the longest.</p>\n";
    let lines: Vec<Line> = curves.iter().map(line).collect();
    s += &chart::log_log("curves", &lines, ["seconds", "error"], true);
    s += "<h2>Time of an iteration against its noise</h2>\n<p>Lower left is better. Settings along a falling diagonal are \
          equally efficient.</p>\n";
    let points: Vec<Line> = curves.iter().map(point).collect();
    s += &chart::log_log("pareto", &points, ["seconds per iteration", "error after one iteration"], false);
    s += "<h2>Where the time goes</h2>\n";
    let stages: Vec<(String, Vec<f64>)> =
        curves.iter().map(|c| (escape(&c.name), c.stages.to_vec())).collect();
    s += &chart::bars("stages", &STAGES, &stages);
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

/// What the study says, in words.
pub fn sentences(curves: &[Curve]) -> Vec<String> {
    let mut said = Vec::new();
    let resolved = |c: &&Curve| c.unit.value > 0.0 && c.unit.value.is_finite();
    if let Some(best) = curves
        .iter()
        .filter(resolved)
        .filter(|c| !c.biased)
        .min_by(|a, b| a.unit.value.total_cmp(&b.unit.value))
    {
        let u = best.unit;
        said.push(format!(
            "The fastest to a given error is {}: an error of 1 % takes about {} ({} to {}).",
            best.name,
            seconds(u.value * 1e4),
            seconds(u.low * 1e4),
            seconds(u.high * 1e4)
        ));
        if let (Some(first), Some(last)) = (best.rungs.first(), best.rungs.last())
            && best.rungs.len() > 1
        {
            let slope = (last.error.value / first.error.value).ln()
                / (last.iterations as f64 / first.iterations as f64).ln();
            said.push(format!(
                "With {}, halving the error costs {:.1} times the iterations; noise alone would be 4.",
                best.name,
                0.5f64.powf(1.0 / slope)
            ));
        }
    }
    if let Some(first) = curves.first() {
        for c in &curves[1..] {
            let s = c.speedup;
            said.push(if !s.value.is_finite() {
                format!("Between {} and {} nothing can be said: an error was too small to measure.", c.name, first.name)
            } else if c.is_unresolved() {
                format!("{} and {} are not told apart: their times to equal error differ by a factor of {} to {}.", c.name, first.name, number(s.low), number(s.high))
            } else if s.value > 1.0 {
                format!("{} reaches the error of {} in {} of its time: {} times as fast ({} to {}).", c.name, first.name, percent(1.0 / s.value), number(s.value), number(s.low), number(s.high))
            } else {
                format!("{} takes {} times as long as {} to the same error ({} to {}).", c.name, number(1.0 / s.value), first.name, number(1.0 / s.high), number(1.0 / s.low))
            });
        }
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
    if curves.iter().any(|c| c.biased) {
        said.push("Settings with vertex merging blur: their error holds blur as well as noise, and is not extrapolated.".into());
    }
    said
}

fn table(curves: &[Curve]) -> String {
    let mut s = "<table id=\"settings\"><tr><th>setting</th><th>runs x iterations</th><th>seconds</th><th>error</th><th>seconds \
                 to 1 %</th><th>speed</th><th>predicted</th><th>fireflies</th></tr>\n"
        .to_owned();
    for c in curves {
        let Some(last) = c.rungs.last() else { continue };
        let e = last.error;
        let predicted = c.prediction.as_ref().map_or("-".to_owned(), |p| {
            format!("{} ({} to {})", percent(p.error.value), percent(p.error.low), percent(p.error.high))
        });
        let unit = if c.biased {
            "-".to_owned()
        } else {
            format!(
                "{} ({} to {})",
                number(c.unit.value * 1e4),
                number(c.unit.low * 1e4),
                number(c.unit.high * 1e4)
            )
        };
        let speed = if c.name == curves[0].name {
            "1".to_owned()
        } else if c.is_unresolved() {
            "not resolved".to_owned()
        } else {
            format!("x {} ({} to {})", number(c.speedup.value), number(c.speedup.low), number(c.speedup.high))
        };
        let _ = writeln!(
            s,
            "<tr><td>{}</td><td>{} x {}</td><td>{}</td><td>{} ({} to {})</td><td>{unit}</td><td>{speed}</td><td>{predicted}</td><td>{}</td></tr>",
            escape(&c.name),
            c.runs,
            last.iterations,
            number(last.seconds),
            percent(e.value),
            percent(e.low),
            percent(e.high),
            number(c.fireflies)
        );
    }
    s + "</table>\n"
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
    let points = last.map(|r| {
        let (n, root) = (r.iterations as f64, (r.iterations as f64).sqrt());
        [r.seconds / n, r.error.value * root, r.error.low * root, r.error.high * root]
    });
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
