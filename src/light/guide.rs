//! Guided emission: light subpaths start where earlier ones have proved useful.
//!
//! A guide is a histogram over the unit square that [`LightPoint::emit`] turns into rays, one for all emitting triangles
//! of the same material and orientation, and for each other light. It bends the square before that, so that it knows
//! nothing of how rays are made, and multiplies their density by one number. A share of the directions stays unguided: nothing
//! is lost, however wrong the histogram is.

use super::distant::Surroundings;
use super::{LightPoint, Lights};
use crate::math::Discrete;
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;

/// Cells along each side of the square.
const SIDE: usize = 32;
const CELLS: usize = SIDE * SIDE;
/// Share of directions that follow the histogram. The caustics that it is for are as quiet with 0.7, all else is noisier; with
/// less than 0.2 they suffer (benches/record/integrators.md).
const GUIDED: f64 = 0.35;
/// Kinds of emitters beyond which there is too little to learn for each.
const MOST_KINDS: usize = 1024;

/// Where light goes from each kind of emitter.
#[derive(Debug)]
pub struct EmissionGuide {
    surroundings: Surroundings,
    /// Kind of each light.
    kinds: Vec<u32>,
    /// Probabilities of the square's cells, for each kind.
    cells: Vec<Discrete>,
}

impl EmissionGuide {
    /// Learns from the points of the unit square that light left by, each with a score of at least 0 for how useful that
    /// was. `None` when nothing was useful, or lights are too different to learn from each other.
    pub fn learn(
        lights: &Lights,
        observations: impl Iterator<Item = (LightPoint, DVec2, f64)>,
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
        for (light, u, score) in observations {
            scores[kinds[light.number() as usize] as usize][cell(u)] += score;
        }
        if scores.iter().flatten().all(|&s| s == 0.0) {
            return None;
        }
        let cells = scores.iter().map(|scores| Discrete::new(shares(scores))).collect::<Option<_>>()?;
        Some(Self { surroundings: *lights.surroundings(), kinds, cells })
    }

    /// A point of the unit square to give to [`LightPoint::emit`]; `u` is uniform in it.
    pub fn warp(&self, light: &LightPoint, u: DVec2) -> DVec2 {
        let (cell, rest) = self.cells_of(light).sample_and_rest(u.x);
        let corner = DVec2::new((cell % SIDE) as f64, (cell / SIDE) as f64);
        (corner + DVec2::new(rest, u.y)) / SIDE as f64
    }

    /// Density of the subpath from a light in a direction to a position: that of [`LightPoint::emission_pdf`] as the
    /// guide changes it.
    pub fn pdf(&self, light: &LightPoint, direction: DVec3, position: DVec3) -> f64 {
        let unguided = light.emission_pdf(&self.surroundings, direction);
        if unguided == 0.0 {
            return 0.0;
        }
        let u = light.square_of(&self.surroundings, direction, position);
        unguided * self.cells_of(light).probability(cell(u)) * CELLS as f64
    }

    fn cells_of(&self, light: &LightPoint) -> &Discrete {
        &self.cells[self.kinds[light.number() as usize] as usize]
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
