//! Does a sampler draw what its density says?

use super::chart::Chart;
use super::quadrature::{Rectangle, integrate};
use super::stats::chi2_p;
use glam::DVec2;

/// A chi^2 test of a sampler against its density. The charts must share the points among them, each point being on the
/// first that locates it; together with "drew nothing" their cells are the bins.
pub struct Distribution<'a, P> {
    /// Charts that cover what is sampled.
    pub atlas: &'a [&'a dyn Chart<P>],
    /// Each chart has `cells` x `cells` bins.
    pub cells: usize,
    /// How many points to draw.
    pub draws: usize,
}

/// What a test saw.
#[derive(Debug)]
pub struct Outcome {
    /// p-value of the counts.
    pub p: f64,
    /// Integral of the density.
    pub total: f64,
    /// Share of the draws that gave a point.
    pub drawn: f64,
    /// Number of draws that gave a point without density: any makes p = 0.
    pub outside: usize,
}

/// Absolute error allowed to the probability of a bin: far below the noise of 1e5 draws.
const TOLERANCE: f64 = 3e-6;

impl<P> Distribution<'_, P> {
    /// Compares `draw` with `pdf`. Panics when a point has no place on the charts.
    #[track_caller]
    pub fn test(&self, pdf: impl Fn(&P) -> f64, mut draw: impl FnMut() -> Option<P>) -> Outcome {
        let n = self.cells;
        let draws = self.draws as f64;
        let mut expected = Vec::with_capacity(self.atlas.len() * n * n + 1);
        for chart in self.atlas {
            let density = |s: DVec2| chart.point(s).map_or(0.0, |(p, measure)| pdf(&p) * measure);
            for i in 0..n * n {
                let cell = Rectangle::UNIT.cell(i % n, i / n, n);
                expected.push(draws * integrate(&density, cell, TOLERANCE));
            }
        }
        let total = expected.iter().sum::<f64>() / draws;
        let mut outside = 0;
        let mut observed = vec![0.0; expected.len() + 1];
        for _ in 0..self.draws {
            let bin = draw().map_or(expected.len(), |p| {
                let density = pdf(&p);
                outside += usize::from(!(density > 0.0 && density.is_finite()));
                self.bin(&p).expect("drew a point that is on no chart")
            });
            observed[bin] += 1.0;
        }
        let drawn = 1.0 - observed[expected.len()] / draws;
        // A density that integrates to more than 1 is wrong whatever the counts; to less means misses.
        let allowed = TOLERANCE * expected.len() as f64;
        let missed = if total > 1.0 + allowed { f64::NAN } else { (draws * (1.0 - total)).max(0.0) };
        expected.push(missed);
        let p = if outside > 0 { 0.0 } else { chi2_p(&observed, &expected) };
        Outcome { p, total, drawn, outside }
    }

    fn bin(&self, p: &P) -> Option<usize> {
        let n = self.cells;
        self.atlas.iter().enumerate().find_map(|(c, chart)| {
            let s = chart.locate(p)?;
            let [x, y] = [s.x, s.y].map(|v| ((v * n as f64) as usize).min(n - 1));
            Some(c * n * n + y * n + x)
        })
    }
}
