//! A TOML document in which every key and value knows where it was written: a line of a file, or a `-D` flag that
//! overrides it.

use super::notes::suggestion;
use crate::error::{Error, Place, Result};
use glam::DVec3;
use std::path::Path;
use toml::de::{DeTable, DeValue};

/// Where a key or value was written.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum At {
    /// A line of a file.
    Line(Place),
    /// `-D key=value` on the command line.
    Flag(String),
}

impl At {
    /// An error here: the scene's, or the command line's.
    pub(super) fn error(&self, message: impl Into<String>) -> Error {
        match self {
            Self::Line(place) => Error::scene(place.clone(), message),
            Self::Flag(flag) => Error::Usage(format!("-D {flag}: {}", message.into())),
        }
    }

    /// The same for something that is understood but missing from hrr.
    pub(super) fn unsupported(&self, message: impl Into<String>) -> Error {
        let place = match self {
            Self::Line(place) => place.clone(),
            Self::Flag(flag) => Place::file(format!("-D {flag}")),
        };
        Error::Unsupported { place, message: message.into() }
    }
}

/// A value and where it stands.
#[derive(Debug, Clone)]
pub(super) struct Node {
    pub(super) at: At,
    pub(super) value: Value,
}

/// A TOML value.
#[derive(Debug, Clone)]
pub(super) enum Value {
    String(String),
    Integer(i128),
    Float(f64),
    Boolean(bool),
    Array(Vec<Node>),
    Table(Table),
    /// Dates and times, which no key of a scene takes.
    Other,
}

/// Entries in the order in which they were written.
#[derive(Debug, Clone, Default)]
pub(super) struct Table(Vec<Entry>);

/// One key with its value.
#[derive(Debug, Clone)]
pub(super) struct Entry {
    pub(super) key: String,
    pub(super) at: At,
    pub(super) node: Node,
}

impl Table {
    /// Reads a TOML file's text.
    pub(super) fn parse(file: &Path, text: &str) -> Result<Self> {
        let line_of = |offset: usize| 1 + text.as_bytes()[..offset].iter().filter(|&&b| b == b'\n').count();
        let at = |offset: usize| At::Line(Place::line(file, line_of(offset)));
        match DeTable::parse(text) {
            Ok(table) => convert_table(table.into_inner(), &at),
            Err(e) => {
                Err(at(e.span().map_or(0, |s| s.start.min(text.len())))
                    .error(e.message().replace('\n', ", ")))
            }
        }
    }

    /// Reads a `-D` override: a dotted key, and a TOML value or else a bare string.
    pub(super) fn parse_flag(key: &str, value: &str) -> Result<Self> {
        let at = At::Flag(format!("{key}={value}"));
        let toml = format!("{key} = {value}");
        let quoted = format!("{key} = {}", toml::Value::String(value.to_owned()));
        let Ok(table) = DeTable::parse(&toml).or_else(|_| DeTable::parse(&quoted)) else {
            return Err(at.error("not a dotted key and a value, such as camera.fov_y=30"));
        };
        convert_table(table.into_inner(), &|_| at.clone())
    }

    /// Puts `other`'s values over this table's and behind them: tables are merged, everything else is replaced.
    pub(super) fn merge(&mut self, other: Self) {
        for mut entry in other.0 {
            if let Some(i) = self.0.iter().position(|mine| mine.key == entry.key) {
                let mut mine = self.0.remove(i);
                if let (Value::Table(a), Value::Table(b)) = (&mut mine.node.value, &mut entry.node.value) {
                    a.merge(std::mem::take(b));
                    entry = mine;
                }
            }
            self.0.push(entry);
        }
    }

    pub(super) fn entries(&self) -> &[Entry] {
        &self.0
    }

    pub(super) fn get(&self, key: &str) -> Option<&Node> {
        self.0.iter().find(|e| e.key == key).map(|e| &e.node)
    }

    /// Refuses keys that are not among `known`; `what` names the table in the message.
    pub(super) fn only(&self, what: &str, known: &[&str]) -> Result<()> {
        match self.0.iter().find(|e| !known.contains(&e.key.as_str())) {
            None => Ok(()),
            Some(e) => {
                let hint = suggestion(&e.key, known.iter().copied());
                Err(e.at.error(format!("unknown key '{}' in {what}{hint}", e.key)))
            }
        }
    }
}

impl Node {
    fn expected(&self, what: &str) -> Error {
        let found = match &self.value {
            Value::String(s) => format!("the string \"{s}\""),
            Value::Integer(i) => format!("the integer {i}"),
            Value::Float(x) => format!("the number {x}"),
            Value::Boolean(b) => format!("{b}"),
            Value::Array(a) => format!("an array of {}", a.len()),
            Value::Table(_) => "a table".into(),
            Value::Other => "a date or time".into(),
        };
        self.at.error(format!("expected {what}, found {found}"))
    }

    pub(super) fn table(&self, what: &str) -> Result<&Table> {
        if let Value::Table(t) = &self.value {
            Ok(t)
        } else {
            Err(self.expected(&format!("a table for {what}")))
        }
    }

    pub(super) fn array(&self, what: &str) -> Result<&[Node]> {
        if let Value::Array(a) = &self.value {
            Ok(a)
        } else {
            Err(self.expected(&format!("an array for {what}")))
        }
    }

    pub(super) fn string(&self, what: &str) -> Result<&str> {
        if let Value::String(s) = &self.value {
            Ok(s)
        } else {
            Err(self.expected(&format!("a string for {what}")))
        }
    }

    pub(super) fn boolean(&self, what: &str) -> Result<bool> {
        if let Value::Boolean(b) = self.value {
            Ok(b)
        } else {
            Err(self.expected(&format!("true or false for {what}")))
        }
    }

    /// A finite number; integers count.
    pub(super) fn number(&self, what: &str) -> Result<f64> {
        let x = match self.value {
            Value::Integer(i) => i as f64,
            Value::Float(x) => x,
            _ => return Err(self.expected(&format!("a number for {what}"))),
        };
        if x.is_finite() { Ok(x) } else { Err(self.at.error(format!("{what} is {x}; it must be finite"))) }
    }

    /// A whole number in a range.
    pub(super) fn integer(&self, what: &str, range: std::ops::RangeInclusive<u32>) -> Result<u32> {
        let Value::Integer(i) = self.value else {
            return Err(self.expected(&format!("a whole number for {what}")));
        };
        u32::try_from(i).ok().filter(|i| range.contains(i)).ok_or_else(|| {
            self.at.error(format!("{what} is {i}; it must lie in {}..={}", range.start(), range.end()))
        })
    }

    /// An array of `N` finite numbers.
    pub(super) fn numbers<const N: usize>(&self, what: &str) -> Result<[f64; N]> {
        match &self.value {
            Value::Array(a) if a.len() == N => {
                let mut out = [0.0; N];
                for (x, node) in out.iter_mut().zip(a) {
                    *x = node.number(what)?;
                }
                Ok(out)
            }
            _ => Err(self.expected(&format!("{N} numbers for {what}"))),
        }
    }

    /// Three numbers.
    pub(super) fn vector(&self, what: &str) -> Result<DVec3> {
        self.numbers::<3>(what).map(DVec3::from)
    }

    /// Three numbers in `0..=max`, or one for all channels.
    pub(super) fn color(&self, what: &str, max: f64) -> Result<DVec3> {
        let c = match self.value {
            Value::Integer(_) | Value::Float(_) => DVec3::splat(self.number(what)?),
            _ => self.vector(what)?,
        };
        if c.cmplt(DVec3::ZERO).any() || c.cmpgt(DVec3::splat(max)).any() {
            let range = if max.is_finite() { format!("lie in 0..={max}") } else { "not be negative".into() };
            return Err(self.at.error(format!("{what} is {:?}; it must {range}", c.to_array())));
        }
        Ok(c)
    }

    /// The value as a settings table takes it; `None` for tables, arrays and dates.
    pub(super) fn plain(&self) -> Option<String> {
        match &self.value {
            Value::String(s) => Some(s.clone()),
            Value::Integer(i) => Some(i.to_string()),
            Value::Float(x) => Some(x.to_string()),
            Value::Boolean(b) => Some(b.to_string()),
            Value::Array(_) | Value::Table(_) | Value::Other => None,
        }
    }
}

fn convert_table(table: DeTable<'_>, at: &dyn Fn(usize) -> At) -> Result<Table> {
    let mut entries: Vec<_> = table.into_iter().collect();
    entries.sort_by_key(|(key, _)| key.span().start);
    let mut out = Vec::with_capacity(entries.len());
    for (key, value) in entries {
        let here = at(key.span().start);
        // A table made by a [header] spans only its header; one made by dotted keys may span nothing of its own.
        let start = value.span().start.max(key.span().start);
        let node = convert(value.into_inner(), start, at)?;
        out.push(Entry { key: key.into_inner().into_owned(), at: here, node });
    }
    Ok(Table(out))
}

fn convert(value: DeValue<'_>, offset: usize, at: &dyn Fn(usize) -> At) -> Result<Node> {
    let here = at(offset);
    let value = match value {
        DeValue::String(s) => Value::String(s.into_owned()),
        DeValue::Integer(i) => match i128::from_str_radix(i.as_str(), i.radix()) {
            Ok(i) => Value::Integer(i),
            Err(e) => return Err(here.error(format!("'{}' is not an integer: {e}", i.as_str()))),
        },
        DeValue::Float(x) => match x.as_str().parse() {
            Ok(x) => Value::Float(x),
            Err(e) => return Err(here.error(format!("'{}' is not a number: {e}", x.as_str()))),
        },
        DeValue::Boolean(b) => Value::Boolean(b),
        DeValue::Datetime(_) => Value::Other,
        DeValue::Array(a) => {
            let item = |v: toml::Spanned<DeValue<'_>>| {
                let start = v.span().start;
                convert(v.into_inner(), start, at)
            };
            Value::Array(a.into_iter().map(item).collect::<Result<_>>()?)
        }
        DeValue::Table(t) => Value::Table(convert_table(t, at)?),
    };
    Ok(Node { at: here, value })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(node: &Node) -> usize {
        match &node.at {
            At::Line(p) => p.line.unwrap(),
            At::Flag(_) => 0,
        }
    }

    #[test]
    fn values_know_their_lines() {
        let text = "a = 1\n[b]\nc = [\n 1.5,\n 2]\nd.e = \"x\"\n[[l]]\nf = 0x10\n[[l]]\nf = true\n";
        let t = Table::parse(Path::new("s.toml"), text).unwrap();
        assert_eq!(line(t.get("a").unwrap()), 1);
        let b = t.get("b").unwrap().table("b").unwrap();
        assert_eq!(b.entries()[0].at, At::Line(Place::line("s.toml", 3)));
        assert_eq!(b.get("c").unwrap().numbers::<2>("c").unwrap(), [1.5, 2.0]);
        assert_eq!(line(&b.get("c").unwrap().array("c").unwrap()[1]), 5);
        let d = b.get("d").unwrap().table("d").unwrap();
        assert_eq!((line(d.get("e").unwrap()), d.get("e").unwrap().string("e").unwrap()), (6, "x"));
        let l = t.get("l").unwrap().array("l").unwrap();
        assert_eq!((line(&l[0]), line(&l[1])), (7, 9));
        assert_eq!(l[0].table("l").unwrap().get("f").unwrap().integer("f", 0..=16).unwrap(), 16);
        assert!(l[0].table("l").unwrap().get("f").unwrap().integer("f", 0..=15).is_err());
    }

    #[test]
    fn flags_override_and_say_so() {
        let mut t = Table::parse(Path::new("s.toml"), "[a]\nx = 1\ny = 2\n").unwrap();
        t.merge(Table::parse_flag("a.x", "[1, 2]").unwrap());
        t.merge(Table::parse_flag("a.z", "pcvcm+hrr").unwrap());
        let a = t.get("a").unwrap().table("a").unwrap();
        assert_eq!(a.get("x").unwrap().numbers::<2>("x").unwrap(), [1.0, 2.0]);
        assert_eq!(a.get("y").unwrap().number("y").unwrap(), 2.0);
        assert_eq!(a.get("z").unwrap().string("z").unwrap(), "pcvcm+hrr");
        let e = a.get("z").unwrap().number("a.z").unwrap_err();
        assert!(matches!(e, Error::Usage(_)), "{e:?}");
        assert_eq!(
            e.to_string(),
            "-D a.z=pcvcm+hrr: expected a number for a.z, found the string \"pcvcm+hrr\""
        );
        assert!(matches!(Table::parse_flag("a b", "1"), Err(Error::Usage(_))));
    }

    #[test]
    fn broken_toml_names_the_line() {
        let e = Table::parse(Path::new("s.toml"), "a = 1\nb = = 2\n").unwrap_err().to_string();
        assert!(e.starts_with("s.toml:2: "), "{e}");
    }
}
