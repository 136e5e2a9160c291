//! Writing OBJ files: boxes, balls and curved sheets, in metres, y up, counter-clockwise seen from outside.

use glam::{DAffine3, DVec2, DVec3};
use std::f64::consts::{PI, TAU};
use std::fmt::Write;

/// An OBJ file under construction.
pub struct Obj {
    text: String,
    vertices: usize,
    uvs: usize,
    normals: usize,
}

impl Obj {
    /// A file that starts with a comment and takes its materials from `scene.mtl`.
    pub fn new(comment: &str) -> Self {
        let text = format!("# {comment}\n# Made by `cargo run --example make_scenes`.\nmtllib scene.mtl\n");
        Self { text, vertices: 0, uvs: 0, normals: 0 }
    }

    /// The finished file.
    pub fn into_text(self) -> String {
        self.text
    }

    /// Starts a part of one material.
    pub fn part(&mut self, name: &str, material: &str) {
        writeln!(self.text, "o {name}\nusemtl {material}").unwrap();
    }

    /// A flat quadrilateral, its corners counter-clockwise seen from its front.
    pub fn quad(&mut self, corners: [DVec3; 4]) {
        let first = self.vertices + 1;
        for p in corners {
            self.vertex(p);
        }
        writeln!(self.text, "f {} {} {} {}", first, first + 1, first + 2, first + 3).unwrap();
    }

    /// A quadrilateral with texture coordinates (0, 0), (1, 0), (1, 1), (0, 1) at its corners.
    pub fn quad_with_uv(&mut self, corners: [DVec3; 4]) {
        let (v, vt) = (self.vertices + 1, self.uvs + 1);
        for (p, uv) in corners.into_iter().zip([DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y]) {
            self.vertex(p);
            self.uv(uv);
        }
        let corner = |i: usize| format!("{}/{}", v + i, vt + i);
        writeln!(self.text, "f {} {} {} {}", corner(0), corner(1), corner(2), corner(3)).unwrap();
    }

    /// A box around the local origin, `half` its half sides.
    pub fn cuboid(&mut self, place: DAffine3, half: DVec3) {
        let first = self.vertices + 1;
        for i in 0..8 {
            let sign = |bit: usize| if i & bit == 0 { -1.0 } else { 1.0 };
            self.vertex(place.transform_point3(half * DVec3::new(sign(1), sign(2), sign(4))));
        }
        for [a, b, c, d] in
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
        {
            writeln!(self.text, "f {} {} {} {}", first + a, first + b, first + c, first + d).unwrap();
        }
    }

    /// A ball with smooth normals; `rows` from pole to pole, `columns` around.
    pub fn ball(&mut self, center: DVec3, radius: f64, rows: usize, columns: usize) {
        let (v, vn) = (self.vertices + 1, self.normals + 1);
        for row in 0..=rows {
            let theta = PI * row as f64 / rows as f64;
            // One vertex at each pole.
            for column in 0..if row == 0 || row == rows { 1 } else { columns } {
                let phi = TAU * column as f64 / columns as f64;
                let n = DVec3::new(theta.sin() * phi.sin(), theta.cos(), theta.sin() * phi.cos());
                self.vertex(center + n * radius);
                self.normal(n);
            }
        }
        let corner = |row: usize, column: usize| {
            let i = match row {
                0 => 0,
                row if row == rows => 1 + (rows - 1) * columns,
                row => 1 + (row - 1) * columns + column % columns,
            };
            format!("{}//{}", v + i, vn + i)
        };
        for row in 0..rows {
            for column in 0..columns {
                let (a, b) = (corner(row, column), corner(row + 1, column));
                let (c, d) = (corner(row + 1, column + 1), corner(row, column + 1));
                match row {
                    0 => writeln!(self.text, "f {a} {b} {c}"),
                    row if row + 1 == rows => writeln!(self.text, "f {a} {b} {d}"),
                    _ => writeln!(self.text, "f {a} {b} {c} {d}"),
                }
                .unwrap();
            }
        }
    }

    /// A sheet swept along `0..=segments`: `edges` gives its two edges and its normal at each step. Seen against the
    /// normal, the first edge is below and steps go to the right.
    pub fn sheet(&mut self, segments: usize, edges: impl Fn(usize) -> (DVec3, DVec3, DVec3)) {
        self.sweep(segments, false, edges);
    }

    /// The same with texture coordinates: u from 0 to 1 along the steps, v from the first edge to the second.
    pub fn sheet_with_uv(&mut self, segments: usize, edges: impl Fn(usize) -> (DVec3, DVec3, DVec3)) {
        self.sweep(segments, true, edges);
    }

    fn sweep(&mut self, segments: usize, uv: bool, edges: impl Fn(usize) -> (DVec3, DVec3, DVec3)) {
        let (v, vt, vn) = (self.vertices + 1, self.uvs + 1, self.normals + 1);
        for step in 0..=segments {
            let (low, high, normal) = edges(step);
            self.vertex(low);
            self.vertex(high);
            self.normal(normal);
            if uv {
                let u = step as f64 / segments as f64;
                self.uv(DVec2::new(u, 0.0));
                self.uv(DVec2::new(u, 1.0));
            }
        }
        for s in 0..segments {
            let corner = |step: usize, side: usize| {
                let at = 2 * step + side;
                let texture = if uv { (vt + at).to_string() } else { String::new() };
                format!("{}/{texture}/{}", v + at, vn + step)
            };
            let quad = [corner(s, 0), corner(s + 1, 0), corner(s + 1, 1), corner(s, 1)];
            writeln!(self.text, "f {}", quad.join(" ")).unwrap();
        }
    }

    fn vertex(&mut self, p: DVec3) {
        self.vertices += 1;
        writeln!(self.text, "v {} {} {}", number(p.x), number(p.y), number(p.z)).unwrap();
    }

    fn uv(&mut self, uv: DVec2) {
        self.uvs += 1;
        writeln!(self.text, "vt {} {}", number(uv.x), number(uv.y)).unwrap();
    }

    fn normal(&mut self, n: DVec3) {
        self.normals += 1;
        writeln!(self.text, "vn {} {} {}", number(n.x), number(n.y), number(n.z)).unwrap();
    }
}

/// Six decimals: a micrometre. Coarser than what the mathematics of one machine may differ from another's.
fn number(x: f64) -> String {
    let text = format!("{x:.6}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}
