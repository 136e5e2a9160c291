//! What a loader remarks on while it goes on, and the suggestion for a misspelt name.

use crate::error::Place;
use crate::material::Unsupported;
use crate::settings::nearest;

/// Warnings in the order in which their kinds first appeared. A kind is said once, with its first place and how often
/// it came, so that a scene of a thousand materials does not fill the screen.
#[derive(Debug, Default)]
pub(super) struct Notes {
    notes: Vec<Note>,
    /// Of the material that is being read.
    unsupported: Vec<Unsupported>,
}

#[derive(Debug)]
struct Note {
    kind: &'static str,
    first: String,
    more: usize,
}

impl Notes {
    /// Remarks on something of a `kind` (any label) at a place.
    pub(super) fn add(&mut self, kind: &'static str, place: &Place, message: impl AsRef<str>) {
        if let Some(note) = self.notes.iter_mut().find(|note| note.kind == kind) {
            note.more += 1;
        } else {
            let first = format!("{place}: {}", message.as_ref());
            self.notes.push(Note { kind, first, more: 0 });
        }
    }

    /// Remarks on what the material `name` asks for by `key` and hrr has not got.
    pub(super) fn add_unsupported(&mut self, name: &str, key: &'static str, place: Place, what: String) {
        self.add(key, &place, format!("material '{name}': {what}"));
        self.unsupported.push(Unsupported { key, what, place });
    }

    /// What was remarked on as unsupported since this was asked last.
    pub(super) fn take_unsupported(&mut self) -> Vec<Unsupported> {
        std::mem::take(&mut self.unsupported)
    }

    /// One sentence for each kind.
    pub(super) fn into_warnings(self) -> Vec<String> {
        let say = |n: Note| match n.more {
            0 => n.first,
            more => format!("{} (and {more} more of this kind)", n.first),
        };
        self.notes.into_iter().map(say).collect()
    }
}

/// "; did you mean 'x'?" or nothing.
pub(super) fn suggestion<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> String {
    nearest(name, candidates).map_or_else(String::new, |c| format!("; did you mean '{c}'?"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeated_kinds_are_counted_once() {
        let mut notes = Notes::default();
        for line in 1..=3 {
            notes.add("a", &Place::line("x.obj", line), "odd");
        }
        notes.add("b", &Place::file("y.obj"), "even");
        assert_eq!(notes.into_warnings(), ["x.obj:1: odd (and 2 more of this kind)", "y.obj: even"]);
    }

    #[test]
    fn suggestions_are_near_or_absent() {
        let keys = ["origin", "target", "fov_y"];
        assert_eq!(suggestion("tarket", keys), "; did you mean 'target'?");
        assert_eq!(suggestion("zzzz", keys), "");
    }
}
