//! What a study's rows say: error against time with intervals, time to unit variance, and what could have been predicted.

use super::blur::Blur;
use super::bootstrap::Interval;
use super::fall::Fall;
use super::results::{Results, Row};
use crate::math::relative::median;
use std::collections::BTreeMap;

/// Rungs that the longest is predicted from.
const FITTED: usize = 4;
/// Squares of errors with all pixels, over those without the worst thousandth, from which on rare samples make them.
const RARE: f64 = 10.0;

/// A point of a setting's curve: all runs up to a rung.
#[derive(Debug, Clone)]
pub struct Rung {
    /// Iterations of the median run.
    pub iterations: f64,
    /// Median wall-clock seconds.
    pub seconds: f64,
    /// Error: the root of the mean of the runs' squares.
    pub error: Interval,
}

/// The longest rung as the shorter ones predict it.
#[derive(Debug, Clone)]
pub struct Prediction {
    /// Predicted error, with the interval that it was said to lie in.
    pub error: Interval,
    /// Predicted seconds to the error that the longest rung had.
    pub seconds: f64,
    /// What was measured.
    pub measured: f64,
    /// Seconds that it took.
    pub measured_seconds: f64,
}

/// What a setting comes to with all pixels counted, those as well where it finds light rarely.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Whole {
    /// Error at the longest rung.
    pub error: Interval,
    /// As [`Curve::unit`].
    pub unit: Interval,
    /// As [`Curve::speedup`].
    pub speedup: Interval,
}

/// A setting's results.
#[derive(Debug, Clone)]
pub struct Curve {
    /// The setting.
    pub name: String,
    /// Whether it blurs.
    pub biased: bool,
    /// Runs.
    pub runs: usize,
    /// Its rungs, the longest last.
    pub rungs: Vec<Rung>,
    /// Seconds to an error of 1 (100 %), which noise halves in four times the time: variance times seconds.
    pub unit: Interval,
    /// That of the first setting over it: how many times as fast this one is.
    pub speedup: Interval,
    /// The same with all pixels counted.
    pub whole: Whole,
    /// From the rungs below the longest; `None` when there are too few, two for noise, four for blur, or when it is
    /// [`Curve::rare`].
    pub prediction: Option<Prediction>,
    /// Whether the rungs below the longest have rare bright samples that make most of the error of all pixels: shorter runs
    /// do not tell what longer ones find.
    pub rare: bool,
    /// Noise and blur of a setting that blurs, from all rungs.
    pub blur: Option<Blur>,
    /// Median FLIP at the longest rung.
    pub flip: f64,
    /// Median processor seconds of the longest rung.
    pub cpu: Option<f64>,
    /// Mean seconds of each stage at the longest rung, summed over threads.
    pub stages: [f64; 5],
    /// Mean fireflies at the longest rung.
    pub fireflies: f64,
}

impl Curve {
    /// Whether the interval of the speed-up leaves open which one is faster.
    pub fn is_unresolved(&self) -> bool {
        self.speedup.holds(1.0)
    }
}

/// The rows of a setting, by rung and run.
struct Table<'a> {
    rungs: Vec<Vec<&'a Row>>,
    runs: usize,
}

impl<'a> Table<'a> {
    fn new(results: &'a Results, name: &str) -> Self {
        let mut rungs: BTreeMap<u32, Vec<&Row>> = BTreeMap::new();
        for row in results.rows.iter().filter(|r| r.setting == name) {
            rungs.entry(row.rung).or_default().push(row);
        }
        let rungs: Vec<Vec<&Row>> = rungs.into_values().collect();
        let runs = rungs.iter().map(Vec::len).min().unwrap_or(0);
        Self { rungs, runs }
    }

    fn mean(&self, rung: usize, runs: &[usize], value: impl Fn(&Row) -> f64) -> f64 {
        runs.iter().map(|&r| value(self.rungs[rung][r])).sum::<f64>() / runs.len() as f64
    }

    /// Of all runs.
    fn median(&self, rung: usize, value: impl Fn(&Row) -> f64) -> f64 {
        median(&mut self.rungs[rung].iter().map(|r| value(r)).collect::<Vec<_>>())
    }

    /// Median seconds of all runs, without those of the pre-passes.
    fn own_seconds(&self, rung: usize) -> f64 {
        self.median(rung, |r| r.seconds - r.setup).max(f64::MIN_POSITIVE)
    }

    /// The median run's seconds: a run that another program held up does not count.
    fn seconds(&self, rung: usize, runs: &[usize]) -> f64 {
        median(&mut runs.iter().map(|&r| self.rungs[rung][r].seconds).collect::<Vec<_>>())
    }

    /// Variance of the error times seconds, at the longest rung.
    fn unit(&self, runs: &[usize], square: impl Fn(&Row) -> f64) -> f64 {
        let last = self.rungs.len() - 1;
        self.mean(last, runs, square).max(0.0) * self.seconds(last, runs)
    }

    /// Iterations and square errors of the rungs below one.
    fn points(&self, below: usize, runs: &[usize]) -> Vec<(f64, f64)> {
        (0..below)
            .map(|k| (self.median(k, |r| r.iterations as f64), self.mean(k, runs, |r| r.square)))
            .collect()
    }

    /// Of the rungs below the longest, at most [`FITTED`].
    fn fit(&self, runs: &[usize]) -> Fall {
        let below = self.rungs.len() - 1;
        let point = |k: usize| (self.own_seconds(k), self.mean(k, runs, |r| r.square).max(f64::MIN_POSITIVE));
        let first = below.saturating_sub(FITTED);
        let ratio = |value: &dyn Fn(usize) -> f64| value(below - 1) / value(first);
        let more = ratio(&|k| self.median(k, |r| r.iterations as f64));
        let growing = more < ratio(&|k| self.own_seconds(k)).sqrt();
        Fall::fit(&(first..below).map(point).collect::<Vec<_>>(), growing)
    }
}

/// All settings' curves; speed-ups are over the first.
pub fn curves(results: &Results) -> Vec<Curve> {
    let names = results.settings();
    let Some(first) = names.first().map(|name| Table::new(results, name)) else { return Vec::new() };
    names.iter().map(|name| curve(name, &Table::new(results, name), &first)).collect()
}

fn curve(name: &str, table: &Table<'_>, first: &Table<'_>) -> Curve {
    let n = table.runs;
    let all: Vec<usize> = (0..n).collect();
    let rungs: Vec<Rung> = (0..table.rungs.len())
        .map(|k| Rung {
            iterations: table.median(k, |r| r.iterations as f64),
            seconds: table.seconds(k, &all),
            error: Interval::new(n, |runs| table.mean(k, runs, |r| r.square).max(0.0).sqrt()),
        })
        .collect();
    let last = rungs.len() - 1;
    let biased = table.rungs[0][0].biased;
    let mean = |value: fn(&Row) -> f64| (0..last).map(|k| table.mean(k, &all, value)).sum::<f64>();
    let rare = mean(|r| r.whole) > RARE * mean(|r| r.square);
    // Runs with the same number were interleaved: the machine was as busy.
    let speedup = |square: fn(&Row) -> f64| {
        Interval::new(n.min(first.runs), |runs| first.unit(runs, square) / table.unit(runs, square))
    };
    Curve {
        name: name.to_owned(),
        biased,
        runs: n,
        unit: Interval::new(n, |runs| table.unit(runs, |r| r.square)),
        speedup: speedup(|r| r.square),
        whole: Whole {
            error: Interval::new(n, |runs| table.mean(last, runs, |r| r.whole).max(0.0).sqrt()),
            unit: Interval::new(n, |runs| table.unit(runs, |r| r.whole)),
            speedup: speedup(|r| r.whole),
        },
        prediction: match (rare, biased) {
            (true, _) => None,
            (false, true) => predict_blur(table, &rungs),
            (false, false) => (rungs.len() >= 3).then(|| predict(table, &rungs)),
        },
        rare,
        blur: biased.then(|| Blur::fit(&table.points(rungs.len(), &all))).flatten(),
        flip: table.median(last, |r| r.flip),
        cpu: table.rungs[last].iter().map(|r| r.cpu).collect::<Option<Vec<_>>>().map(|mut s| median(&mut s)),
        stages: std::array::from_fn(|s| table.mean(last, &all, |r| r.stages[s])),
        fireflies: table.mean(last, &all, |r| r.fireflies as f64),
        rungs,
    }
}

fn predict(table: &Table<'_>, rungs: &[Rung]) -> Prediction {
    let all: Vec<usize> = (0..table.runs).collect();
    let (longest, setup) = (table.own_seconds(rungs.len() - 1), table.median(0, |r| r.setup));
    let fall = table.fit(&all);
    extrapolate(table, rungs, |runs| table.fit(runs).square(longest), |square| setup + fall.reached(square))
}

fn predict_blur(table: &Table<'_>, rungs: &[Rung]) -> Option<Prediction> {
    let last = rungs.len() - 1;
    let all: Vec<usize> = (0..table.runs).collect();
    let fitted = Blur::fit(&table.points(last, &all))?;
    let (iterations, setup) = (rungs[last].iterations, table.median(0, |r| r.setup));
    let per_iteration = table.own_seconds(last - 1) / rungs[last - 1].iterations;
    let predicted = |runs: &[usize]| {
        Blur::fit(&table.points(last, runs)).map_or(f64::NAN, |blur| blur.square(iterations))
    };
    Some(extrapolate(table, rungs, predicted, |square| setup + per_iteration * fitted.iterations_to(square)))
}

/// The longest rung as a model says: `predicted`, its square error from some runs; `needed`, seconds to a square error.
fn extrapolate(
    table: &Table<'_>,
    rungs: &[Rung],
    predicted: impl Fn(&[usize]) -> f64,
    needed: impl Fn(f64) -> f64,
) -> Prediction {
    let (n, last) = (table.runs, rungs.len() - 1);
    let all: Vec<usize> = (0..n).collect();
    let below = last - 1;
    let level = table.mean(below, &all, |r| r.square);
    let error = Interval::new(n, |runs| {
        // What is measured is a mean of as many runs, and errs as much: others, shifted by half.
        let others: Vec<usize> = runs.iter().rev().map(|r| (r * 7 + 3) % n).collect();
        let chance = if runs == all { 1.0 } else { table.mean(below, &others, |r| r.square) / level };
        (predicted(runs) * chance).max(0.0).sqrt()
    });
    let measured = rungs[last].error.value;
    Prediction {
        error,
        seconds: needed(measured.powi(2).max(f64::MIN_POSITIVE)),
        measured,
        measured_seconds: rungs[last].seconds,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::counter::{combine, mix, unit};

    /// Runs whose squares are `variance / n` times a number of mean 1, after `seconds` an iteration.
    fn rows(setting: &str, variance: f64, seconds: f64, key: u64) -> Vec<Row> {
        let mut rows = Vec::new();
        for run in 0..16 {
            for n in [1u64, 2, 4, 8, 16] {
                let u = unit(mix(combine(combine(key, run), n)));
                rows.push(Row {
                    setting: setting.into(),
                    biased: false,
                    run: run as usize,
                    rung: n.ilog2(),
                    iterations: n,
                    seconds: 0.5 + seconds * n as f64,
                    setup: 0.5,
                    cpu: Some(1.5),
                    flip: 0.25,
                    square: variance / n as f64 * (0.8 + 0.4 * u),
                    whole: variance / n as f64 * (1.6 + 0.8 * u),
                    fireflies: 1,
                    stages: [1.0, 2.0, 3.0, 4.0, 5.0],
                });
            }
        }
        rows
    }

    #[test]
    fn speed_is_the_ratio_of_variance_times_time() {
        let both = [rows("a", 1.0, 1.0, 1), rows("b", 0.5, 1.0, 2)].concat();
        let found = curves(&Results { about: Vec::new(), rows: both });
        let [a, b] = &found[..] else { panic!() };
        assert_eq!((a.runs, a.rungs.len(), a.stages[4], a.fireflies), (16, 5, 5.0, 1.0));
        assert_eq!((a.flip, a.cpu, a.blur), (0.25, Some(1.5), None));
        assert!((a.unit.value - 16.5 / 16.0).abs() < 0.1 && a.unit.low < a.unit.value);
        assert!(b.speedup.holds(2.0) && !b.is_unresolved(), "{b:?}");
        assert!(a.is_unresolved());
        // Twice the square with all pixels, of either.
        assert!(
            (b.whole.error.value / b.rungs[4].error.value - 2f64.sqrt()).abs() < 1e-9
                && b.whole.speedup == b.speedup
        );
        // Of equals, one in ten pairs is told apart by chance.
        let equal = |key: u64| {
            let both = [rows("a", 1.0, 1.0, 2 * key), rows("b", 1.0, 1.0, 2 * key + 1)].concat();
            curves(&Results { about: Vec::new(), rows: both })[1].is_unresolved()
        };
        let unresolved = (0..60).filter(|&key| equal(key)).count();
        assert!((45..60).contains(&unresolved), "{unresolved} of 60");
    }

    #[test]
    fn what_rests_on_rare_samples_is_not_predicted() {
        let mut lucky = rows("a", 1.0, 1.0, 5);
        assert!(!curves(&Results { about: Vec::new(), rows: lucky.clone() })[0].rare);
        for row in lucky.iter_mut().filter(|r| r.run == 3) {
            row.whole *= 200.0;
        }
        let curve = &curves(&Results { about: Vec::new(), rows: lucky })[0];
        assert!(curve.rare && curve.prediction.is_none());
    }

    #[test]
    fn blur_is_told_from_noise_and_extrapolated() {
        let mut blurred = rows("vcm", 1.0, 1.0, 7);
        for row in &mut blurred {
            row.biased = true;
            row.square += 0.2 * (row.iterations as f64).powf(-0.5);
        }
        let curve = &curves(&Results { about: Vec::new(), rows: blurred })[0];
        let blur = curve.blur.unwrap();
        // How the two share what few rungs show is open; their sum is not.
        assert!((blur.square(16.0) / (1.0 / 16.0 + 0.05) - 1.0).abs() < 0.05, "{blur:?}");
        assert!(blur.blur > 0.0 && blur.overtakes() < 1000.0, "{blur:?}");
        let p = curve.prediction.as_ref().unwrap();
        assert!(p.error.holds(p.measured) && (p.seconds / p.measured_seconds - 1.0).abs() < 0.25, "{p:?}");
    }

    #[test]
    fn the_longest_rung_is_predicted_from_the_others() {
        let mut inside = 0;
        for key in 0..100 {
            let curves = curves(&Results { about: Vec::new(), rows: rows("a", 1.0, 2.0, 100 + key) });
            let p = curves[0].prediction.as_ref().unwrap();
            assert!((p.error.value / p.measured - 1.0).abs() < 0.1);
            assert!((p.seconds / p.measured_seconds - 1.0).abs() < 0.15, "{p:?}");
            inside += u32::from(p.error.holds(p.measured));
        }
        assert!((80..=100).contains(&inside), "{inside} of 100");
    }
}
