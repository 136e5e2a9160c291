//! Reading MTL files: every line is checked and remembered, then the parser behind it fills in the values.

use super::notes::{Notes, suggestion};
use crate::error::{Error, Place, Result};
use glam::{DVec2, DVec3};
use std::collections::HashMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// What follows a key.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// One number, or three.
    Color,
    Number,
    /// A whole number, 0..=10.
    Model,
    /// Options and a file name.
    Map,
    /// Anything; not used.
    Ignored,
}

/// Every known key as the parser behind this file spells it.
const KEYS: [(&str, Kind); 44] = [
    ("Ka", Kind::Ignored),
    ("Kd", Kind::Color),
    ("Ks", Kind::Color),
    ("Ke", Kind::Color),
    ("Tf", Kind::Color),
    ("Ns", Kind::Number),
    ("Ni", Kind::Number),
    ("d", Kind::Number),
    ("Tr", Kind::Number),
    ("illum", Kind::Model),
    ("Pr", Kind::Number),
    ("Pm", Kind::Number),
    ("Ps", Kind::Number),
    ("Pc", Kind::Number),
    ("Pcr", Kind::Number),
    ("aniso", Kind::Number),
    ("anisor", Kind::Number),
    ("hrr_alpha_x", Kind::Number),
    ("hrr_alpha_y", Kind::Number),
    ("map_Kd", Kind::Map),
    ("map_Ka", Kind::Ignored),
    ("map_Ks", Kind::Map),
    ("map_Ke", Kind::Map),
    ("map_Ns", Kind::Map),
    ("map_Ni", Kind::Map),
    ("map_d", Kind::Map),
    ("map_Tr", Kind::Map),
    ("map_Tf", Kind::Map),
    ("map_Pr", Kind::Map),
    ("map_Pm", Kind::Map),
    ("map_Ps", Kind::Map),
    ("map_Pc", Kind::Map),
    ("map_Pcr", Kind::Map),
    ("map_aniso", Kind::Map),
    ("map_anisor", Kind::Map),
    ("map_bump", Kind::Map),
    ("bump", Kind::Map),
    ("norm", Kind::Map),
    ("disp", Kind::Map),
    ("decal", Kind::Map),
    ("refl", Kind::Map),
    ("map_refl", Kind::Map),
    ("sharpness", Kind::Ignored),
    ("map_aat", Kind::Ignored),
];

/// The option of `d` that makes a surface fade towards its silhouette, for which there is no physical reading.
const HALO: &str = "-halo";

/// An MTL file.
#[derive(Debug, Clone)]
pub(super) struct Library {
    /// The file.
    pub(super) file: PathBuf,
    /// Its materials in order.
    pub(super) materials: Vec<MtlMaterial>,
}

/// A material as the file gives it.
#[derive(Debug, Clone, Default)]
pub(super) struct MtlMaterial {
    /// The parser's view of it.
    pub(super) values: tobj::Material,
    /// Line of `newmtl`.
    pub(super) line: usize,
    /// Line of each key.
    lines: HashMap<&'static str, usize>,
    /// What follows each map key.
    maps: HashMap<&'static str, String>,
}

impl MtlMaterial {
    /// The line that gives a key, or else the one that names the material.
    pub(super) fn line_of(&self, key: &str) -> usize {
        self.lines.get(key).copied().unwrap_or(self.line)
    }

    /// Keys of maps that the file gives, in the order of their lines.
    pub(super) fn maps(&self) -> Vec<&'static str> {
        let is_map = |k: &&str| KEYS.iter().any(|(name, kind)| name == k && *kind == Kind::Map);
        let mut keys: Vec<_> = self.lines.keys().copied().filter(is_map).collect();
        keys.sort_by_key(|k| self.lines[k]);
        keys
    }

    /// Whether the surface is to fade towards its silhouette.
    pub(super) fn has_halo(&self) -> bool {
        self.lines.contains_key(HALO)
    }

    /// What follows a map key.
    pub(super) fn map(&self, key: &str) -> Option<&str> {
        self.maps.get(key).map(String::as_str)
    }

    /// A number that the parser leaves as text.
    pub(super) fn number(&self, key: &str) -> Option<f64> {
        self.values.unknown_param.get(key).and_then(|text| text.parse().ok())
    }

    /// A colour that the parser leaves as text.
    pub(super) fn color(&self, key: &str) -> Option<DVec3> {
        let mut numbers = self.values.unknown_param.get(key)?.split(' ').map(|w| w.parse().ok());
        Some(DVec3::new(numbers.next()??, numbers.next()??, numbers.next()??))
    }
}

impl Library {
    /// Checks and parses the text of an MTL file.
    pub(super) fn parse(file: &Path, text: &str, notes: &mut Notes) -> Result<Self> {
        let mut plain = String::with_capacity(text.len());
        let mut heads: Vec<MtlMaterial> = Vec::new();
        for (index, line) in text.lines().enumerate() {
            let place = Place::line(file, index + 1);
            let line = line.trim();
            let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
            let rest = rest.trim();
            if word.is_empty() || word.starts_with('#') {
                continue;
            }
            if word.eq_ignore_ascii_case("newmtl") {
                if rest.is_empty() {
                    return Err(Error::scene(place, "newmtl without a name"));
                }
                heads.push(MtlMaterial { line: index + 1, ..Default::default() });
                writeln!(plain, "newmtl {rest}").ok();
                continue;
            }
            let Some(&(key, kind)) = KEYS.iter().find(|(key, _)| key.eq_ignore_ascii_case(word)) else {
                let hint = suggestion(word, KEYS.map(|(key, _)| key));
                let message =
                    format!("'{}' is not a key of MTL; the line is left out{hint}", word.escape_debug());
                notes.add("mtl key", &place, message);
                continue;
            };
            let Some(head) = heads.last_mut() else {
                return Err(Error::scene(place, format!("{key} before any newmtl")));
            };
            if kind != Kind::Ignored {
                let value = check(kind, key, rest).map_err(|message| Error::scene(place, message))?;
                head.lines.insert(key, index + 1);
                if kind == Kind::Map {
                    head.maps.insert(key, value.clone());
                }
                if key == "d" && rest.starts_with(HALO) {
                    head.lines.insert(HALO, index + 1);
                }
                writeln!(plain, "{key} {value}").ok();
            }
        }
        let (materials, _) = tobj::load_mtl_buf(&mut plain.as_bytes())
            .map_err(|e| Error::scene(Place::file(file), format!("cannot be read: {e}")))?;
        for (head, values) in heads.iter_mut().zip(materials) {
            head.values = values;
        }
        Ok(Self { file: file.to_owned(), materials: heads })
    }

    /// The place of a key of a material.
    pub(super) fn place(&self, material: &MtlMaterial, key: &str) -> Place {
        Place::line(&self.file, material.line_of(key))
    }
}

/// The value in its plain form, or what is wrong with it.
fn check(kind: Kind, key: &str, rest: &str) -> std::result::Result<String, String> {
    if kind == Kind::Map {
        MapReference::parse(rest).map_err(|e| format!("{key}: {e}"))?;
        return Ok(rest.to_owned());
    }
    let words: Vec<&str> = rest.split_whitespace().take_while(|w| !w.starts_with('#')).collect();
    let words = if key == "d" && words.first() == Some(&HALO) { &words[1..] } else { &words[..] };
    if matches!(words.first(), Some(&("spectral" | "xyz"))) {
        return Err(format!("{key} {} is not understood; give linear red, green and blue", words[0]));
    }
    let mut numbers = Vec::with_capacity(3);
    for word in words {
        match word.parse::<f64>() {
            Ok(x) if x.is_finite() && x >= 0.0 => numbers.push(x),
            Ok(x) if x.is_finite() && key == "anisor" => numbers.push(x),
            Ok(x) => return Err(format!("{key} is {x}; it must be finite and not negative")),
            Err(_) => return Err(format!("'{}' in {key} is not a number", word.escape_debug())),
        }
    }
    match (kind, &numbers[..]) {
        (Kind::Color, &[grey]) => Ok(format!("{grey} {grey} {grey}")),
        (Kind::Color, &[r, g, b]) => Ok(format!("{r} {g} {b}")),
        (Kind::Color, other) => Err(format!("{key} takes 1 or 3 numbers; this line has {}", other.len())),
        (Kind::Model, &[x]) if x.fract() == 0.0 && x <= 10.0 => Ok(format!("{x}")),
        (Kind::Model, &[x]) => Err(format!("{key} {x} is not an illumination model (0 to 10)")),
        // Sheen is a colour in some writers; its mere presence is what counts.
        (_, &[x, ..]) if key == "Ps" => Ok(format!("{x}")),
        (_, &[x]) => Ok(format!("{x}")),
        (_, other) => Err(format!("{key} takes one number; this line has {}", other.len())),
    }
}

/// A texture as a map key gives it: options and a file name.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MapReference {
    /// The name as written, `\` read as `/`.
    pub(super) file: String,
    /// `-s`: texture coordinates are multiplied by this.
    pub(super) scale: DVec2,
    /// `-o`: and then this is added.
    pub(super) offset: DVec2,
    /// Options that are understood but not followed.
    pub(super) unused: Vec<String>,
}

impl MapReference {
    /// Reads what follows a map key.
    pub(super) fn parse(text: &str) -> std::result::Result<Self, String> {
        let mut map =
            Self { file: String::new(), scale: DVec2::ONE, offset: DVec2::ZERO, unused: Vec::new() };
        let mut rest = text.trim();
        while let Some(option) = rest.split_whitespace().next().filter(|w| w.starts_with('-') && w.len() > 1)
        {
            let mut after = rest[option.len()..].trim_start();
            // Numbers one to three, of which all but the first may be left out.
            let mut vector = |default: f64| {
                let mut v = DVec2::splat(default);
                for i in 0..3 {
                    let word = after.split_whitespace().next().unwrap_or("");
                    let Ok(x) = word.parse::<f64>() else {
                        return if i == 0 { Err(format!("{option} without a number")) } else { Ok(v) };
                    };
                    if !x.is_finite() {
                        return Err(format!("{option} {x} is not finite"));
                    }
                    if i < 2 {
                        v[i] = x;
                    }
                    after = after[word.len()..].trim_start();
                }
                Ok(v)
            };
            match option {
                "-s" => map.scale = vector(1.0)?,
                "-o" => map.offset = vector(0.0)?,
                "-t" => {
                    vector(0.0)?;
                    map.unused.push(option.to_owned());
                }
                "-blendu" | "-blendv" | "-boost" | "-texres" | "-clamp" | "-bm" | "-imfchan" | "-type"
                | "-cc" | "-mm" => {
                    for _ in 0..if option == "-mm" { 2 } else { 1 } {
                        let word = after.split_whitespace().next().unwrap_or("");
                        after = after[word.len()..].trim_start();
                    }
                    map.unused.push(option.to_owned());
                }
                _ => return Err(format!("unknown option {option}")),
            }
            rest = after;
        }
        if rest.is_empty() {
            return Err("no file name".into());
        }
        map.file = rest.replace('\\', "/");
        Ok(map)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texture_options_are_taken_off_the_file_name() {
        let m = MapReference::parse("-s 2 3 1 -o 0.5 -bm 0.2 -mm 0 1 my wood 2.png").unwrap();
        assert_eq!(m.file, "my wood 2.png");
        assert_eq!((m.scale, m.offset), (DVec2::new(2.0, 3.0), DVec2::new(0.5, 0.0)));
        assert_eq!(m.unused, ["-bm", "-mm"]);
        assert_eq!(MapReference::parse("-s 2 2.png").unwrap().scale, DVec2::new(2.0, 1.0));
        assert_eq!(MapReference::parse("a\\b.png").unwrap().file, "a/b.png");
        assert!(MapReference::parse("-s 1 1 1").is_err());
        assert!(MapReference::parse("-s wood.png").is_err());
        assert!(MapReference::parse("-scale 1 wood.png").unwrap_err().contains("-scale"));
    }

    #[test]
    fn lines_and_spellings() {
        let mut notes = Notes::default();
        let text = "# c\nnewmtl a b\nkd 0.5\nKS 1 0 0 # red\nPr 0.1\nKdd 1\n\nnewmtl c\nTf 0 1 0\nillum 7\n";
        let lib = Library::parse(Path::new("m.mtl"), text, &mut notes).unwrap();
        let [a, c] = &lib.materials[..] else { panic!("{lib:?}") };
        assert_eq!((a.values.name.as_str(), a.line, a.line_of("Ks"), a.line_of("Ke")), ("a b", 2, 4, 2));
        assert_eq!(a.values.diffuse, Some([0.5; 3]));
        assert_eq!((a.number("Pr"), c.color("Tf")), (Some(0.1), Some(DVec3::Y)));
        assert_eq!(c.values.illumination_model, Some(7));
        let warnings = notes.into_warnings();
        assert_eq!(
            warnings,
            ["m.mtl:6: 'Kdd' is not a key of MTL; the line is left out; did you mean 'Kd'?"]
        );
    }

    #[test]
    fn broken_lines_are_named() {
        for (text, message) in [
            ("newmtl a\nKd 1 2\n", "m.mtl:2: Kd takes 1 or 3 numbers; this line has 2"),
            ("newmtl a\nKd\n", "m.mtl:2: Kd takes 1 or 3 numbers; this line has 0"),
            ("newmtl a\nKe nan 0 0\n", "m.mtl:2: Ke is NaN; it must be finite and not negative"),
            ("newmtl a\nKd -1 0 0\n", "m.mtl:2: Kd is -1; it must be finite and not negative"),
            ("newmtl a\n\nNs x\n", "m.mtl:3: 'x' in Ns is not a number"),
            (
                "newmtl a\nKd spectral a.rfl\n",
                "m.mtl:2: Kd spectral is not understood; give linear red, green and blue",
            ),
            ("newmtl a\nillum 2.5\n", "m.mtl:2: illum 2.5 is not an illumination model (0 to 10)"),
            ("newmtl a\nmap_Kd -s 1 1 1\n", "m.mtl:2: map_Kd: no file name"),
            ("Kd 1 1 1\n", "m.mtl:1: Kd before any newmtl"),
            ("newmtl\n", "m.mtl:1: newmtl without a name"),
        ] {
            let e = Library::parse(Path::new("m.mtl"), text, &mut Notes::default()).unwrap_err();
            assert_eq!(e.to_string(), message);
        }
    }
}
