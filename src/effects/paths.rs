//! Kinds of paths, and which technique finds which.

use super::Effect;
use std::fmt;

/// A vertex of a path, as techniques see it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Vertex {
    /// Diffuse.
    D,
    /// Glossy.
    G,
    /// A delta lobe.
    S,
}

/// A kind of path from a light (L) over surfaces to the eye (E), written from the light: L S D E is a caustic on a
/// diffuse surface.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PathClass {
    /// Whether the light has no size, so that no eye subpath meets it by chance.
    pub delta_light: bool,
    /// Surfaces, from the light's side.
    pub surfaces: Vec<Vertex>,
    /// The effect that it makes.
    pub effect: Effect,
}

/// Ways to find paths, as the switches of an algorithm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Coverage {
    /// Eye subpaths go on and meet lights by chance.
    pub eye_hits: bool,
    /// Next-event estimation.
    pub next_event: bool,
    /// Light vertices seen by the camera.
    pub light_image: bool,
    /// Connections of surface vertices.
    pub connections: bool,
    /// Light vertices near an eye vertex count as if they were it.
    pub merging: bool,
    /// The same of caustics, where perfectly smooth surfaces show them to the camera.
    pub merging_shown: bool,
}

impl Coverage {
    /// Whether any of the techniques finds paths of a class.
    pub fn finds(&self, class: &PathClass) -> bool {
        let open = |v: &Vertex| *v != Vertex::S;
        let surfaces = &class.surfaces;
        // A light seen directly is seen by all.
        surfaces.is_empty()
            || self.eye_hits && !class.delta_light
            || self.next_event && surfaces.first().is_some_and(open)
            || self.light_image && surfaces.last().is_some_and(open)
            || self.connections && surfaces.windows(2).any(|pair| pair.iter().all(open))
            || self.merging && surfaces.iter().any(open)
            || self.merging_shown
                && surfaces.iter().rposition(open).is_some_and(|first| {
                    first + 1 < surfaces.len() && first > 0 && surfaces[first - 1] != Vertex::D
                })
    }
}

impl fmt::Display for PathClass {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("L ")?;
        self.surfaces.iter().try_for_each(|vertex| write!(f, "{vertex:?} "))?;
        f.write_str("E")?;
        if self.delta_light { f.write_str(" (from a light without size)") } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Vertex::{D, G, S};

    fn class(delta_light: bool, surfaces: &[Vertex]) -> PathClass {
        PathClass { delta_light, surfaces: surfaces.to_vec(), effect: Effect::Direct }
    }

    #[test]
    fn each_technique_finds_its_own() {
        let only = |name: &str| Coverage {
            eye_hits: name == "eye",
            next_event: name == "next",
            light_image: name == "image",
            connections: name == "connect",
            merging: name == "merge",
            merging_shown: name == "shown",
        };
        let found = |class: &PathClass| {
            ["eye", "next", "image", "connect", "merge", "shown"]
                .into_iter()
                .filter(|name| only(name).finds(class))
                .collect::<Vec<_>>()
                .join(" ")
        };
        assert_eq!(found(&class(false, &[D])), "eye next image merge");
        assert_eq!(found(&class(false, &[S, D])), "eye image merge");
        assert_eq!(found(&class(true, &[S, D])), "image merge");
        assert_eq!(found(&class(true, &[S, D, G])), "image connect merge");
        assert_eq!(found(&class(true, &[S, D, S])), "merge shown");
        assert_eq!(found(&class(true, &[S, D, D, S])), "connect merge");
        assert_eq!(found(&class(false, &[S, D, S])), "eye merge shown");
        assert_eq!(found(&class(true, &[S])), "");
        assert_eq!(class(true, &[S, D, S]).to_string(), "L S D S E (from a light without size)");
    }
}
