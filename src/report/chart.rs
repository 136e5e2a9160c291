//! Charts as SVG, of the kinds that a study needs.

use std::fmt::Write;

/// Colours that differ in lightness as well.
pub const COLOURS: [&str; 10] = [
    "#1b6ca8", "#c8553d", "#3b8f4e", "#8a4fa3", "#b8860b", "#2a9d9d", "#d1477a", "#5c5c5c", "#7a9e1e",
    "#4053c4",
];

/// A line with its band.
pub struct Line {
    /// What it is.
    pub name: String,
    /// x, y and the band's ends; all positive.
    pub points: Vec<[f64; 4]>,
    /// Further marks, drawn as crosses: x, y.
    pub marks: Vec<[f64; 2]>,
}

const WIDTH: f64 = 760.0;
/// At least; more where the legend needs it.
const HEIGHT: f64 = 430.0;
/// Of a line of the legend.
const LEGEND: f64 = 18.0;
/// Left, right, top, bottom.
const MARGIN: [f64; 4] = [70.0, 205.0, 14.0, 48.0];

/// Logarithmic axes; `joined` draws lines, else only dots with their bars.
pub fn log_log(id: &str, lines: &[Line], labels: [&str; 2], joined: bool) -> String {
    let all = || lines.iter().flat_map(|l| &l.points);
    let range = |values: &mut dyn Iterator<Item = f64>| {
        let (low, high) = values
            .filter(|v| *v > 0.0 && v.is_finite())
            .fold((f64::INFINITY, 0.0f64), |(low, high), v| (low.min(v), high.max(v)));
        if low <= high { (low / 1.25, high * 1.25) } else { (0.1, 10.0) }
    };
    let (x, y) = (range(&mut all().map(|p| p[0])), range(&mut all().flat_map(|p| [p[1], p[3]])));
    let height = HEIGHT.max(MARGIN[2] + LEGEND * lines.len() as f64 + 12.0);
    let share =
        |v: f64, (low, high): (f64, f64)| ((v.max(low) / low).ln() / (high / low).ln()).clamp(0.0, 1.0);
    let at_x = |v: f64| MARGIN[0] + (WIDTH - MARGIN[0] - MARGIN[1]) * share(v, x);
    let at_y = |v: f64| height - MARGIN[3] - (height - MARGIN[2] - MARGIN[3]) * share(v, y);
    let mut s = format!("<svg id=\"{id}\" viewBox=\"0 0 {WIDTH} {height}\" role=\"img\">\n");
    let (bottom, right) = (height - MARGIN[3], WIDTH - MARGIN[1]);
    for (ticks, horizontal) in [(ticks(x), true), (ticks(y), false)] {
        for (value, text) in ticks {
            let _ = if horizontal {
                let at = at_x(value);
                writeln!(
                    s,
                    "<line class=\"grid\" x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{}\" y2=\"{bottom}\"/><text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{text}</text>",
                    MARGIN[2],
                    bottom + 17.0
                )
            } else {
                let at = at_y(value);
                writeln!(
                    s,
                    "<line class=\"grid\" x1=\"{}\" x2=\"{right}\" y1=\"{at:.1}\" y2=\"{at:.1}\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{text}</text>",
                    MARGIN[0],
                    MARGIN[0] - 7.0,
                    at + 4.0
                )
            };
        }
    }
    let _ = writeln!(
        s,
        "<text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"middle\">{}</text><text transform=\"translate(16 {:.0}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
        (MARGIN[0] + right) / 2.0,
        height - 9.0,
        labels[0],
        (MARGIN[2] + bottom) / 2.0,
        labels[1]
    );
    for (i, line) in lines.iter().enumerate() {
        let (colour, round) = (COLOURS[i % COLOURS.len()], i / COLOURS.len());
        let dashes = ["", " stroke-dasharray=\"7 4\"", " stroke-dasharray=\"2 3\""][round.min(2)];
        // Later rounds of the colours have hollow marks.
        let fill = if round == 0 { colour } else { "#fff" };
        let points: Vec<[f64; 4]> =
            line.points.iter().copied().filter(|p| p[0] > 0.0 && p[1] > 0.0).collect();
        let pair = |x: f64, y: f64| format!("{:.1},{:.1}", at_x(x), at_y(y));
        if joined {
            let upper = points.iter().map(|p| pair(p[0], p[3]));
            let lower = points.iter().rev().map(|p| pair(p[0], p[2]));
            let band: Vec<String> = upper.chain(lower).collect();
            let path: Vec<String> = points.iter().map(|p| pair(p[0], p[1])).collect();
            let _ = writeln!(s, "<polygon class=\"band\" fill=\"{colour}\" points=\"{}\"/>", band.join(" "));
            let _ = writeln!(
                s,
                "<polyline class=\"curve\" data-name=\"{}\" stroke=\"{colour}\"{dashes} points=\"{}\"/>",
                line.name,
                path.join(" ")
            );
        }
        for p in &points {
            let (cx, cy) = (at_x(p[0]), at_y(p[1]));
            let _ = writeln!(
                s,
                "<line stroke=\"{colour}\" x1=\"{cx:.1}\" x2=\"{cx:.1}\" y1=\"{:.1}\" y2=\"{:.1}\"/><circle fill=\"{fill}\" stroke=\"{colour}\" cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"3.2\"/>",
                at_y(p[2]),
                at_y(p[3])
            );
        }
        for [mx, my] in &line.marks {
            let (cx, cy) = (at_x(*mx), at_y(*my));
            let _ = writeln!(
                s,
                "<path class=\"mark\" stroke=\"{colour}\" d=\"M{:.1} {:.1}l10 10m0 -10l-10 10\"/>",
                cx - 5.0,
                cy - 5.0
            );
        }
        let y = MARGIN[2] + 12.0 + LEGEND * i as f64;
        let _ = writeln!(
            s,
            "<rect fill=\"{fill}\" stroke=\"{colour}\" x=\"{}\" y=\"{:.0}\" width=\"11\" height=\"11\"/><text x=\"{}\" y=\"{:.0}\">{}</text>",
            right + 14.0,
            y - 10.0,
            right + 31.0,
            y,
            line.name
        );
    }
    s + "</svg>\n"
}

/// How a chart's parts look.
pub const STYLE: &str = "svg text{font-size:12px;fill:#333}.grid{stroke:#e4e4e4}.band{opacity:.16}\
.curve{fill:none;stroke-width:2}.mark{fill:none;stroke-width:2}";

/// A chart as a file of its own.
pub fn file(svg: &str) -> String {
    let head =
        "<svg xmlns=\"http://www.w3.org/2000/svg\" font-family=\"sans-serif\" style=\"background:#fff\" ";
    let svg = svg.replacen("<svg ", head, 1);
    svg.replacen(">\n", &format!("><style>{STYLE}</style>\n"), 1)
}

/// Powers of ten, and where these are few, twice and five times them.
fn ticks((low, high): (f64, f64)) -> Vec<(f64, String)> {
    let steps: &[f64] = if (high / low).log10() < 2.5 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let mut ticks = Vec::new();
    for exponent in low.log10().floor() as i32..=high.log10().ceil() as i32 {
        for step in steps {
            let value = step * 10f64.powi(exponent);
            if (low..=high).contains(&value) {
                ticks.push((value, number(value)));
            }
        }
    }
    ticks
}

/// A number as one reads it: two digits that count.
pub fn number(x: f64) -> String {
    digits(x, 2)
}

/// A number with as many digits that count.
pub fn digits(x: f64, digits: i32) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    let exponent = x.abs().log10().floor() as i32;
    if !(-4..6).contains(&exponent) {
        return format!("{x:.1e}");
    }
    let decimals = (digits - 1 - exponent).max(0) as usize;
    let text = format!("{x:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Bars whose parts are stacked; each bar fills the width.
pub fn bars(id: &str, parts: &[&str], bars: &[(String, Vec<f64>)]) -> String {
    let height = 26.0 * bars.len() as f64 + 40.0;
    let (left, width) = (185.0, WIDTH - 205.0);
    let mut s = format!("<svg id=\"{id}\" viewBox=\"0 0 {WIDTH} {height}\" role=\"img\">\n");
    for (i, part) in parts.iter().enumerate() {
        let x = left + 115.0 * i as f64;
        let _ = writeln!(
            s,
            "<rect fill=\"{}\" x=\"{x}\" y=\"4\" width=\"12\" height=\"12\"/><text x=\"{}\" y=\"14\">{part}</text>",
            COLOURS[i],
            x + 17.0
        );
    }
    for (row, (name, values)) in bars.iter().enumerate() {
        let y = 30.0 + 26.0 * row as f64;
        let total: f64 = values.iter().sum::<f64>().max(1e-30);
        let _ =
            writeln!(s, "<text x=\"{}\" y=\"{}\" text-anchor=\"end\">{name}</text>", left - 8.0, y + 13.0);
        let mut x = left;
        for (i, value) in values.iter().enumerate() {
            let w = width * value / total;
            let _ = writeln!(
                s,
                "<rect fill=\"{}\" x=\"{x:.1}\" y=\"{y}\" width=\"{w:.1}\" height=\"18\"><title>{}: {:.0} %</title></rect>",
                COLOURS[i],
                parts[i],
                100.0 * value / total
            );
            x += w;
        }
    }
    s + "</svg>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let all = [0.0, 1.0, 0.05, 0.123, 12.34, 1234.0, 1e-7, 2e9].map(number);
        assert_eq!(all, ["0", "1", "0.05", "0.12", "12", "1234", "1.0e-7", "2.0e9"]);
        assert_eq!([0.1234, 12.34, 5.0].map(|x| digits(x, 3)), ["0.123", "12.3", "5"]);
    }

    #[test]
    fn what_is_not_positive_does_not_break_a_chart() {
        let line = Line {
            name: "a".into(),
            points: vec![[1.0, 0.0, 0.0, 0.0], [2.0, 0.5, 0.0, 1.0]],
            marks: vec![[2.0, 0.5]],
        };
        let svg = log_log("c", &[line], ["x", "y"], true);
        assert!(svg.contains("data-name=\"a\"") && !svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        assert!(!log_log("c", &[], ["x", "y"], true).contains("NaN"));
    }
}
