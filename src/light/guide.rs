//! Guided emission: light subpaths start where earlier ones have proved useful.
//!
//! A guide is a histogram over the unit square that [`EmitterPoint::sample_direction`] turns into directions, one for
//! all emitters of the same material and orientation. It bends the square before that, so that it knows nothing of how
//! directions are made, and multiplies their density by one number. A share of the directions stays unguided: nothing
//! is lost, however wrong the histogram is.

use super::{EmitterPoint, Lights};
use crate::math::Discrete;
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;

/// Cells along each side of the square.
const SIDE: usize = 32;
const CELLS: usize = SIDE * SIDE;
/// Share of directions that follow the histogram.
const GUIDED: f64 = 0.7;
/// Kinds of emitters beyond which there is too little to learn for each.
const MOST_KINDS: usize = 1024;

/// Where light goes from each kind of emitter.
#[derive(Debug)]
pub struct EmissionGuide {
    /// Kind of each emitter.
    kinds: Vec<u32>,
    /// Probabilities of the square's cells, for each kind.
    cells: Vec<Discrete>,
}

impl EmissionGuide {
    /// Learns from directions in which light left, each with a score of at least 0 for how useful that was. `None` when
    /// nothing was useful, or emitters are too different to learn from each other.
    pub fn learn(
        lights: &Lights,
        observations: impl Iterator<Item = (EmitterPoint, DVec3, f64)>,
    ) -> Option<Self> {
        let mut numbers = BTreeMap::new();
        let kinds: Vec<u32> = lights
            .kinds()
            .map(|kind| {
                let next = numbers.len() as u32;
                *numbers.entry(kind).or_insert(next)
            })
            .collect();
        if numbers.is_empty() || numbers.len() > MOST_KINDS {
            return None;
        }
        let mut scores = vec![[0.0; CELLS]; numbers.len()];
        for (emitter, direction, score) in observations {
            scores[kinds[emitter.emitter as usize] as usize][cell(emitter.square_of(direction))] += score;
        }
        if scores.iter().flatten().all(|&s| s == 0.0) {
            return None;
        }
        let cells = scores.iter().map(|scores| Discrete::new(shares(scores))).collect::<Option<_>>()?;
        Some(Self { kinds, cells })
    }

    /// A point of the unit square to give to [`EmitterPoint::sample_direction`]; `u` is uniform in it.
    pub fn warp(&self, emitter: &EmitterPoint, u: DVec2) -> DVec2 {
        let (cell, rest) = self.cells_of(emitter).sample_and_rest(u.x);
        let corner = DVec2::new((cell % SIDE) as f64, (cell / SIDE) as f64);
        (corner + DVec2::new(rest, u.y)) / SIDE as f64
    }

    /// Density of directions from an emitter, 1/sr: that of [`EmitterPoint::pdf_w`] as the guide changes it.
    pub fn pdf_w(&self, emitter: &EmitterPoint, direction: DVec3) -> f64 {
        let unguided = emitter.pdf_w(direction);
        if unguided == 0.0 {
            return 0.0;
        }
        unguided * self.cells_of(emitter).probability(cell(emitter.square_of(direction))) * CELLS as f64
    }

    fn cells_of(&self, emitter: &EmitterPoint) -> &Discrete {
        &self.cells[self.kinds[emitter.emitter as usize] as usize]
    }
}

/// The cell that a point of the unit square lies in.
fn cell(u: DVec2) -> usize {
    let index = |x: f64| ((x * SIDE as f64) as usize).min(SIDE - 1);
    index(u.y) * SIDE + index(u.x)
}

/// The cells' probabilities: scores, each spread over its neighbours, and the unguided share.
fn shares(scores: &[f64; CELLS]) -> Vec<f64> {
    let at = |x: usize, y: usize| scores[y.min(SIDE - 1) * SIDE + x.min(SIDE - 1)];
    let blurred: Vec<f64> = (0..CELLS)
        .map(|i| {
            let (x, y) = (i % SIDE, i / SIDE);
            let row = |y: usize| at(x.saturating_sub(1), y) + 2.0 * at(x, y) + at(x + 1, y);
            row(y.saturating_sub(1)) + 2.0 * row(y) + row(y + 1)
        })
        .collect();
    let total: f64 = blurred.iter().sum();
    let guided = if total > 0.0 { GUIDED } else { 0.0 };
    blurred
        .iter()
        .map(|b| (1.0 - guided) / CELLS as f64 + if guided > 0.0 { guided * b / total } else { 0.0 })
        .collect()
}
