//! A line chart as an SVG file.

use std::fmt::Write;

/// A line, or dots where values are missing between them.
pub struct Line {
    pub name: &'static str,
    pub color: &'static str,
    pub dashed: bool,
    /// Values that are not finite are left out; those beyond the axes lie on the frame.
    pub points: Vec<(f64, f64)>,
}

/// Numbers along an axis.
#[derive(Clone, Copy)]
pub struct Axis {
    pub name: &'static str,
    pub from: f64,
    pub to: f64,
    /// `Some(base)`: marks at every `step`-th power of it.
    pub base: Option<f64>,
    pub step: f64,
}

impl Axis {
    /// 0..1 along the axis.
    fn place(&self, value: f64) -> f64 {
        let map = |x: f64| if self.base.is_some() { x.max(f64::MIN_POSITIVE).ln() } else { x };
        ((map(value) - map(self.from)) / (map(self.to) - map(self.from))).clamp(0.0, 1.0)
    }

    /// Values to mark, with their names.
    fn marks(&self) -> Vec<(f64, String)> {
        let (low, high) = (self.from.min(self.to), self.from.max(self.to));
        let Some(base) = self.base else {
            let n = ((high - low) / self.step).round() as i32;
            return (0..=n)
                .map(|i| {
                    let x = low + f64::from(i) * self.step;
                    (x, format!("{}", (x * 1e6).round() / 1e6))
                })
                .collect();
        };
        let (first, last) = (low.log(base).round() as i32, high.log(base).round() as i32);
        (first..=last)
            .step_by(self.step as usize)
            .map(|e| {
                let name = match e {
                    0 => "1".into(),
                    _ => format!("{base}{}", e.to_string().chars().map(raised).collect::<String>()),
                };
                (base.powi(e), name)
            })
            .collect()
    }
}

/// A digit or minus sign as an exponent.
fn raised(c: char) -> char {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    c.to_digit(10).map_or('⁻', |d| DIGITS[d as usize])
}

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 400.0;
const LEFT: f64 = 76.0;
const RIGHT: f64 = 24.0;
const TOP: f64 = 44.0;
const BOTTOM: f64 = 56.0;

/// Draws the lines; `legend` is the place of its upper left corner within the frame, in 0..1 from the upper left.
pub fn svg(title: &str, x: Axis, y: Axis, lines: &[Line], legend: (f64, f64)) -> String {
    let px = |v: f64| LEFT + x.place(v) * (WIDTH - LEFT - RIGHT);
    let py = |v: f64| HEIGHT - BOTTOM - y.place(v) * (HEIGHT - TOP - BOTTOM);
    let mut out = String::new();
    let mut put = |s: String| writeln!(out, "{s}").expect("a string takes all");
    put(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{HEIGHT}\" viewBox=\"0 0 {WIDTH} \
         {HEIGHT}\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"12\">"
    ));
    put("<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>".into());
    put(format!("<text x=\"{LEFT}\" y=\"24\" font-size=\"15\" fill=\"#111\">{title}</text>"));
    for (value, name) in x.marks() {
        let at = px(value);
        put(format!(
            "<path d=\"M{at:.1} {TOP}V{:.1}\" stroke=\"#e4e4e4\"/><text x=\"{at:.1}\" y=\"{:.1}\" \
             text-anchor=\"middle\" fill=\"#333\">{name}</text>",
            HEIGHT - BOTTOM,
            HEIGHT - BOTTOM + 19.0
        ));
    }
    for (value, name) in y.marks() {
        let at = py(value);
        put(format!(
            "<path d=\"M{LEFT} {at:.1}H{:.1}\" stroke=\"#e4e4e4\"/><text x=\"{:.1}\" y=\"{:.1}\" \
             text-anchor=\"end\" fill=\"#333\">{name}</text>",
            WIDTH - RIGHT,
            LEFT - 8.0,
            at + 4.0
        ));
    }
    put(format!(
        "<rect x=\"{LEFT}\" y=\"{TOP}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#888\"/>",
        WIDTH - LEFT - RIGHT,
        HEIGHT - TOP - BOTTOM
    ));
    put(format!(
        "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\" fill=\"#111\">{}</text>",
        0.5 * (LEFT + WIDTH - RIGHT),
        HEIGHT - 14.0,
        x.name
    ));
    put(format!(
        "<text transform=\"translate(18 {}) rotate(-90)\" text-anchor=\"middle\" fill=\"#111\">{}</text>",
        0.5 * (TOP + HEIGHT - BOTTOM),
        y.name
    ));
    let stroke = |l: &Line| {
        let dash = if l.dashed { " stroke-dasharray=\"6 4\"" } else { "" };
        format!("fill=\"none\" stroke=\"{}\" stroke-width=\"2\"{dash}", l.color)
    };
    for line in lines {
        let finite = line.points.iter().filter(|p| p.0.is_finite() && !p.1.is_nan());
        let points: Vec<_> = finite.map(|&(a, b)| format!("{:.1},{:.1}", px(a), py(b))).collect();
        put(format!("<polyline points=\"{}\" {}/>", points.join(" "), stroke(line)));
    }
    let corner = (LEFT + legend.0 * (WIDTH - LEFT - RIGHT), TOP + legend.1 * (HEIGHT - TOP - BOTTOM));
    for (i, line) in lines.iter().enumerate() {
        let (a, b) = (corner.0 + 10.0, corner.1 + 18.0 + 18.0 * i as f64);
        put(format!(
            "<path d=\"M{a:.1} {:.1}h30\" {}/><text x=\"{:.1}\" y=\"{b:.1}\" fill=\"#111\">{}</text>",
            b - 4.0,
            stroke(line),
            a + 38.0,
            line.name
        ));
    }
    put("</svg>".into());
    out
}
