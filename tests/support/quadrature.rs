//! Integrals over rectangles, to a tolerance.

use glam::DVec2;

/// A rectangle of the plane.
#[derive(Debug, Clone, Copy)]
pub struct Rectangle {
    /// Lower corner.
    pub min: DVec2,
    /// Upper corner.
    pub max: DVec2,
}

impl Rectangle {
    /// The unit square.
    pub const UNIT: Self = Self { min: DVec2::ZERO, max: DVec2::ONE };

    /// Cell (i, j) of n x n.
    pub fn cell(&self, i: usize, j: usize, n: usize) -> Self {
        let size = (self.max - self.min) / n as f64;
        let min = self.min + size * DVec2::new(i as f64, j as f64);
        Self { min, max: min + size }
    }
}

/// Nodes and weights of Gauss and Legendre on [0,1].
const NODES: [f64; 4] =
    [0.069_431_844_202_973_71, 0.330_009_478_207_571_9, 0.669_990_521_792_428_1, 0.930_568_155_797_026_3];
const WEIGHTS: [f64; 4] =
    [0.173_927_422_568_726_93, 0.326_072_577_431_273_07, 0.326_072_577_431_273_07, 0.173_927_422_568_726_93];

/// Halvings a kink or a jump is followed for, when it is not lost in the tolerance before.
const DEPTH: u32 = 6;

/// Halvings that are always made. A jump that only cuts a corner off a part slips between the nodes; this far down,
/// such corners are about 1e-4 of the rectangle.
const LEAST: u32 = 2;

/// Values of `f` at the nodes of a rectangle, times its area.
type Values = [[f64; 4]; 4];

fn evaluate(f: &impl Fn(DVec2) -> f64, r: Rectangle) -> Values {
    let size = r.max - r.min;
    NODES.map(|x| NODES.map(|y| f(r.min + size * DVec2::new(x, y)) * size.x * size.y))
}

fn sum(values: &Values, wx: &[f64; 4], wy: &[f64; 4]) -> f64 {
    values.iter().zip(wx).map(|(row, wx)| wx * row.iter().zip(wy).map(|(v, wy)| v * wy).sum::<f64>()).sum()
}

/// Weights that integrate the cubic through the nodes over the lower and the upper half of [0,1].
fn half_weights() -> [[f64; 4]; 2] {
    let basis = |i: usize, x: f64| -> f64 {
        (0..4).filter(|&k| k != i).map(|k| (x - NODES[k]) / (NODES[i] - NODES[k])).product()
    };
    let lower = [0, 1, 2, 3].map(|i| (0..4).map(|k| 0.5 * WEIGHTS[k] * basis(i, 0.5 * NODES[k])).sum());
    [lower, [0, 1, 2, 3].map(|i| WEIGHTS[i] - lower[i])]
}

/// Integral of `f`, halving the rectangle until what is seen of each quarter is what its parent foretold, up to the
/// absolute error `tolerance` altogether, for smooth functions. Jumps leave an error of less than 1e-3 of their height
/// times the rectangle's area.
pub fn integrate(f: &impl Fn(DVec2) -> f64, r: Rectangle, tolerance: f64) -> f64 {
    refine(f, r, &evaluate(f, r), &half_weights(), tolerance, DEPTH)
}

fn refine(
    f: &impl Fn(DVec2) -> f64,
    r: Rectangle,
    values: &Values,
    halves: &[[f64; 4]; 2],
    tolerance: f64,
    depth: u32,
) -> f64 {
    let (mut total, mut error) = (0.0, 0.0);
    let parts = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| {
        let part = r.cell(i, j, 2);
        let seen = evaluate(f, part);
        let integral = sum(&seen, &WEIGHTS, &WEIGHTS);
        total += integral;
        error += (integral - sum(values, &halves[i], &halves[j])).abs();
        (part, seen)
    });
    if depth == 0 || (error <= tolerance && depth <= DEPTH - LEAST) {
        return total;
    }
    // Errors of the parts mostly add like random signs: half the tolerance for a quarter of the area.
    parts.iter().map(|(part, seen)| refine(f, *part, seen, halves, 0.5 * tolerance, depth - 1)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{E, PI};

    #[test]
    fn smooth_and_broken_functions_are_integrated() {
        let smooth = integrate(&|p| (p.x + p.y).exp(), Rectangle::UNIT, 1e-9);
        assert!((smooth - (E - 1.0).powi(2)).abs() < 1e-9);
        let (center, radius) = (DVec2::new(0.45, 0.52), 0.37);
        let disc = integrate(&|p| f64::from(p.distance(center) < radius), Rectangle::UNIT, 1e-7);
        assert!((disc - PI * radius * radius).abs() < 5e-4, "{}", disc - PI * radius * radius);
        let root = integrate(&|p| p.x.sqrt() * p.y, Rectangle::UNIT, 1e-9);
        assert!((root - 1.0 / 3.0).abs() < 1e-6, "{}", root - 1.0 / 3.0);
    }

    #[test]
    fn cells_tile_their_rectangle() {
        let r = Rectangle { min: DVec2::new(-1.0, 2.0), max: DVec2::new(3.0, 5.0) };
        assert_eq!(r.cell(0, 0, 4).min, r.min);
        assert_eq!(r.cell(3, 3, 4).max, r.max);
        assert_eq!(r.cell(1, 2, 4).max, r.cell(2, 3, 4).min);
    }
}
