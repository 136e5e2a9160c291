//! The first look at an OBJ file: every line is checked, so that errors name it, and written out again in the plain
//! form that the parser behind it takes at its word.
//!
//! What is ironed out: continued lines, trailing comments, vertex colours, optional components, `l` and `p` elements
//! (they have no area), several libraries on one line and libraries named after their use. Faces with normals (or
//! texture coordinates) and faces without are put into different groups, because a parser with a single index can
//! only have one or the other for a whole group.

use super::notes::Notes;
use crate::error::{Error, Place, Result};
use std::fmt::Write;
use std::path::Path;

/// Beyond this, squared distances no longer fit into single precision, and Embree ignores the triangle.
const MAX_COORDINATE: f64 = 1.844e18;

/// Keywords of the format that mean nothing to a renderer of triangles.
const IGNORED: [&str; 16] = [
    "o",
    "g",
    "s",
    "mg",
    "vp",
    "lod",
    "usemap",
    "maplib",
    "shadow_obj",
    "trace_obj",
    "c_interp",
    "d_interp",
    "bevel",
    "ctech",
    "stech",
    "call",
];
/// Keywords of curves and surfaces, which are not rendered.
const FREE_FORM: [&str; 14] = [
    "cstype", "deg", "bmat", "step", "curv", "curv2", "surf", "parm", "trim", "hole", "scrv", "sp", "con",
    "end",
];

/// An `f` line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Face {
    /// Its line in the file, 1-based.
    pub(super) line: u32,
    /// Its number of corners, at least 3.
    pub(super) corners: u32,
}

/// What the file holds.
#[derive(Debug, Default)]
pub(super) struct Scan {
    /// The file in its plain form, without `mtllib` lines.
    pub(super) plain: String,
    /// All faces in order.
    pub(super) faces: Vec<Face>,
    /// The rest of each `mtllib` line, with its line number.
    pub(super) libraries: Vec<(String, usize)>,
    /// Each material that faces use, with the line that first names it.
    pub(super) materials: Vec<(String, usize)>,
    /// The first face that comes before any `usemtl`.
    pub(super) bare_face: Option<usize>,
}

/// Which indices the corners of a face carry.
type Form = (bool, bool);

struct Scanner<'a> {
    file: &'a Path,
    line: usize,
    /// Numbers of `v`, `vt` and `vn` so far.
    counts: [usize; 3],
    form: Option<Form>,
    /// The latest `usemtl`, until a face uses it.
    material: Option<String>,
    out: Scan,
}

/// Checks the text of an OBJ file.
pub(super) fn scan(file: &Path, text: &str, notes: &mut Notes) -> Result<Scan> {
    let mut scanner =
        Scanner { file, line: 0, counts: [0; 3], form: None, material: None, out: Scan::default() };
    scanner.out.plain.reserve(text.len());
    let mut lines = text.lines().enumerate();
    while let Some((index, first)) = lines.next() {
        scanner.line = index + 1;
        let Some(mut rest) = first.strip_suffix('\\') else {
            scanner.statement(first, notes)?;
            continue;
        };
        let mut joined = String::new();
        loop {
            joined.push_str(rest);
            joined.push(' ');
            let Some((_, next)) = lines.next() else { break };
            match next.strip_suffix('\\') {
                Some(part) => rest = part,
                None => {
                    joined.push_str(next);
                    break;
                }
            }
        }
        scanner.statement(&joined, notes)?;
    }
    Ok(scanner.out)
}

impl Scanner<'_> {
    fn place(&self) -> Place {
        Place::line(self.file, self.line)
    }

    fn fail<T>(&self, message: impl Into<String>) -> Result<T> {
        Err(Error::scene(self.place(), message))
    }

    fn statement(&mut self, line: &str, notes: &mut Notes) -> Result<()> {
        let line = line.trim();
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        match keyword {
            "" => {}
            k if k.starts_with('#') => {}
            "v" => self.vertex(rest)?,
            "vt" => self.floats(1, "vt", rest, 1..=3)?,
            "vn" => self.floats(2, "vn", rest, 3..=3)?,
            "f" => self.face(rest)?,
            "usemtl" if rest.is_empty() => return self.fail("usemtl without the name of a material"),
            "usemtl" => {
                self.material = Some(rest.to_owned());
                writeln!(self.out.plain, "usemtl {rest}").ok();
            }
            "mtllib" if rest.is_empty() => return self.fail("mtllib without the name of a file"),
            "mtllib" => self.out.libraries.push((rest.to_owned(), self.line)),
            "l" | "p" => {
                notes.add("elements", &self.place(), "lines and points have no area and are left out")
            }
            k if FREE_FORM.contains(&k) => {
                let message = "curves and free-form surfaces are not rendered; export them as polygons";
                notes.add("free form", &self.place(), message);
            }
            k if IGNORED.contains(&k) => {}
            k => {
                let message =
                    format!("'{}' is not a statement of OBJ; the line is left out", k.escape_debug());
                notes.add("keyword", &self.place(), message);
            }
        }
        Ok(())
    }

    fn number(&self, keyword: &str, word: &str) -> Result<f64> {
        match word.parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(x),
            Ok(x) => self.fail(format!("{keyword} holds {x}; coordinates must be finite")),
            Err(_) => self.fail(format!("'{}' in {keyword} is not a number", word.escape_debug())),
        }
    }

    fn vertex(&mut self, rest: &str) -> Result<()> {
        let words: Vec<&str> = words(rest).collect();
        // x y z, and then nothing, w, r g b, or w r g b (also written r g b a).
        if !matches!(words.len(), 3 | 4 | 6 | 7) {
            return self.fail(format!("a vertex has 3 coordinates; this line has {}", words.len()));
        }
        for word in &words {
            let x = self.number("v", word)?;
            if x.abs() > MAX_COORDINATE {
                return self.fail(format!("coordinate {word} is out of range (at most {MAX_COORDINATE:e})"));
            }
        }
        self.counts[0] += 1;
        writeln!(self.out.plain, "v {} {} {}", words[0], words[1], words[2]).ok();
        Ok(())
    }

    fn floats(
        &mut self,
        kind: usize,
        keyword: &str,
        rest: &str,
        wanted: std::ops::RangeInclusive<usize>,
    ) -> Result<()> {
        let mut count = 0;
        self.out.plain.push_str(keyword);
        for word in words(rest) {
            self.number(keyword, word)?;
            self.out.plain.push(' ');
            self.out.plain.push_str(word);
            count += 1;
        }
        if !wanted.contains(&count) {
            let (low, high) = (wanted.start(), wanted.end());
            let many = if low == high { format!("{low}") } else { format!("{low} to {high}") };
            return self.fail(format!("{keyword} takes {many} numbers; this line has {count}"));
        }
        // A one-dimensional texture coordinate lies on v = 0.
        self.out.plain.push_str(if keyword == "vt" && count == 1 { " 0\n" } else { "\n" });
        self.counts[kind] += 1;
        Ok(())
    }

    fn face(&mut self, rest: &str) -> Result<()> {
        let mut corners = 0;
        let mut form = None;
        for corner in words(rest) {
            let this = self.corner(corner)?;
            if *form.get_or_insert(this) != this {
                return self.fail(format!("corner '{corner}' has other indices than the corners before it"));
            }
            corners += 1;
        }
        if corners < 3 {
            return self.fail(format!("a face has at least 3 corners; this line has {corners}"));
        }
        if self.form != form {
            self.form = form;
            self.out.plain.push_str("g\n");
        }
        match self.material.take() {
            Some(name) if !self.out.materials.iter().any(|(known, _)| *known == name) => {
                self.out.materials.push((name, self.line));
            }
            Some(_) => {}
            None if self.out.materials.is_empty() => {
                self.out.bare_face.get_or_insert(self.line);
            }
            None => {}
        }
        let Ok(line) = u32::try_from(self.line) else { return self.fail("the file has too many lines") };
        self.out.faces.push(Face { line, corners });
        self.out.plain.push('f');
        for corner in words(rest) {
            self.out.plain.push(' ');
            self.out.plain.push_str(corner);
        }
        self.out.plain.push('\n');
        Ok(())
    }

    /// Checks one corner, `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn corner(&self, corner: &str) -> Result<Form> {
        let mut present = [false; 3];
        for (i, index) in corner.split('/').enumerate() {
            if i > 2 || (i == 0 && index.is_empty()) {
                return self.fail(format!("'{}' is not a corner of a face", corner.escape_debug()));
            }
            if index.is_empty() {
                continue;
            }
            let Ok(n) = index.parse::<i64>() else {
                return self.fail(format!("'{}' is not an index", index.escape_debug()));
            };
            // 1 is the first; -1 is the latest.
            if n == 0 || n.unsigned_abs() > self.counts[i] as u64 {
                let what = ["vertex", "texture coordinate", "normal"][i];
                return self.fail(format!(
                    "there is no {what} {n}: {} of them come before this line",
                    self.counts[i]
                ));
            }
            present[i] = true;
        }
        Ok((present[1], present[2]))
    }
}

/// The words before a trailing comment.
fn words(rest: &str) -> impl Iterator<Item = &str> {
    rest.split_whitespace().take_while(|word| !word.starts_with('#'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_plain_form_says_the_same_in_fewer_ways() {
        let text = "mtllib a.mtl b.mtl\nv 1 2 3 0.1 0.2 0.3\nv 1 \\\n 2 3 # a\nv 0 0 0 1\nvt 0.5\n\
                    usemtl wood #7\nf 1 2 3\nf 1/1 2/1 3/1\nl 1 2\nusemtl tin\nusemtl wood #7\n\tf  -1 -2 -3\n";
        let mut notes = Notes::default();
        let scan = scan(Path::new("a.obj"), text, &mut notes).unwrap();
        assert_eq!(
            scan.plain,
            "v 1 2 3\nv 1 2 3\nv 0 0 0\nvt 0.5 0\nusemtl wood #7\ng\nf 1 2 3\ng\nf 1/1 2/1 3/1\n\
             usemtl tin\nusemtl wood #7\ng\nf -1 -2 -3\n"
        );
        assert_eq!(
            scan.faces.iter().map(|f| (f.line, f.corners)).collect::<Vec<_>>(),
            [(8, 3), (9, 3), (13, 3)]
        );
        assert_eq!(scan.libraries, [("a.mtl b.mtl".to_owned(), 1)]);
        // Not tin, which no face uses.
        assert_eq!(scan.materials, [("wood #7".to_owned(), 8)]);
        assert_eq!(scan.bare_face, None);
        assert_eq!(notes.into_warnings().len(), 1);
    }
}
