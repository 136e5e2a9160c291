//! How large each iteration is, where the settings leave it open and time decides when to end.
//!
//! With the roulette, the pairs that are judged are eye samples times light vertices, while the time is their *sum*:
//! noise of pairs falls with the product, so one large iteration beats many small ones. Equal times would serve pairs best;
//! but eye samples have noise of their own, and deserve more.
//! A preview comes first, then a pilot that is large enough to measure costs by, then what is left of the time, in as few
//! iterations as the memory allows. Iterations count by their light subpaths times their samples.

use super::counters::machine_bytes;
use crate::film::FilmSettings;
use crate::integrator::{LIGHT_SHARE, Merge, Recipe, Size};
use crate::settings::Settings;
use crate::tally::Tally;

/// Share of the time that the pilot takes, and bounds in seconds.
const PILOT: (f64, f64, f64) = (0.04, 0.2, 10.0);
/// How many times longer than the preview, of one sample, it should be; and the share of the time that this may take.
const TELLING: f64 = 5.0;
const MOST_PILOT: f64 = 0.2;
/// Share of the time that is not worth another iteration.
const REST: f64 = 0.02;
/// Where only the number of samples is open, iterations to divide the time into: so that there is something to show.
const PARTS: f64 = 8.0;
/// What a cache takes while it is filled, over what it takes then, and a twentieth for all else.
const WHILE_FILLING: f64 = 2.1;

/// What is open.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Open {
    Samples,
    LightSubpaths,
    Both,
}

/// Chooses the sizes of iterations.
#[derive(Debug, Clone)]
pub(super) struct Sizing {
    open: Open,
    /// Whether noise falls with the product of both sides.
    pairs: bool,
    time: f64,
    memory: f64,
    light_subpaths_per_sample: f64,
    preview: Size,
    /// Whether playing the roulette takes the longer the more light vertices there are: where what it may keep of each is set.
    grows: bool,
}

/// What an iteration was measured to take.
#[derive(Debug, Clone, Copy)]
pub(super) struct Measured {
    /// Its size.
    pub size: Size,
    /// Its costs.
    pub tally: Tally,
    /// Bytes of light vertices and their tree.
    pub bytes: usize,
}

/// What comes next.
#[derive(Debug, Clone, Copy)]
pub(super) struct Next {
    /// The iteration's size.
    pub size: Size,
    /// What it counts for.
    pub weight: u32,
    /// How long it may take.
    pub seconds: f64,
}

impl Sizing {
    /// `None` when the settings say it all: sizes, or a number of iterations.
    pub(super) fn new(settings: &Settings, film: &FilmSettings) -> Option<Self> {
        let time = settings.time?;
        if settings.error.is_some() {
            return None; // the error is told from how iterations of one kind differ
        }
        let recipe = Recipe::of(settings.integrator);
        if recipe.is_some_and(|r| r.merge == Merge::All) {
            return None; // its radius shrinks from iteration to iteration: it needs many
        }
        let pairs = recipe.is_some_and(|r| r.roulette);
        let open = match (settings.samples, settings.light_subpaths, pairs) {
            (0, 0, true) => Open::Both,
            (0, _, _) => Open::Samples,
            (_, 0, true) => Open::LightSubpaths,
            _ => return None,
        };
        let bytes = if settings.memory > 0.0 { settings.memory * 1e9 } else { machine_bytes() as f64 / 2.0 };
        Some(Self {
            open,
            pairs,
            time,
            memory: bytes,
            light_subpaths_per_sample: f64::from(film.width) * f64::from(film.height),
            preview: Size::of(settings, film),
            grows: pairs && settings.axis_probability.is_some(),
        })
    }

    /// The next iteration after the last one; `None` when the time is up.
    pub(super) fn next(&self, elapsed: f64, last: &Measured) -> Option<Next> {
        let left = self.time - elapsed;
        if left < REST * self.time {
            return None;
        }
        let [light, eye] = last.tally.sides;
        let took = (light + eye).max(1e-9);
        let pilot = (PILOT.0 * self.time).clamp(PILOT.1, PILOT.2);
        // After the preview, large enough to tell the pixels' needs from, where that is not too much of the time.
        let previewed = last.size.samples == self.preview.samples && self.open != Open::LightSubpaths;
        let telling = if previewed { (TELLING * took).min(MOST_PILOT * self.time) } else { 0.0 };
        let pilot = pilot.max(telling);
        let mut seconds = if took < 0.7 * pilot { pilot.max(2.0 * took).min(left) } else { left };
        if self.open == Open::Samples {
            seconds = seconds.min((self.time / PARTS).max(pilot));
        }
        if left - seconds < 0.25 * seconds {
            seconds = left;
        }
        let per_subpath = light / last.size.light_subpaths.max(1) as f64;
        let per_sample = (eye / f64::from(last.size.samples)).max(1e-9);
        let size = match self.open {
            Open::Both => {
                let subpaths =
                    self.most_subpaths(last).min(LIGHT_SHARE * seconds / per_subpath.max(1e-12)).max(1.0);
                match self.playing(last) {
                    // In the same proportion where memory is short.
                    0.0 => {
                        self.size((1.0 / LIGHT_SHARE - 1.0) * subpaths * per_subpath / per_sample, subpaths)
                    }
                    playing => {
                        // As many samples as before at least, each with as many times the work as there are light subpaths.
                        let last_subpaths = last.size.light_subpaths as f64;
                        let least = per_sample * f64::from(last.size.samples);
                        let most = 1.0 + ((1.0 - LIGHT_SHARE) * seconds / least - 1.0) / playing;
                        let wanted = subpaths / last_subpaths;
                        let growth = wanted.min(most.max(1.0));
                        let light_side = growth * last_subpaths * per_subpath;
                        let rest = seconds - light_side;
                        // In the same proportion where memory is short, as above.
                        let eye = if growth < wanted {
                            rest
                        } else {
                            rest.min((1.0 / LIGHT_SHARE - 1.0) * light_side)
                        };
                        let samples = eye / (per_sample * (1.0 + playing * (growth - 1.0)));
                        self.size(samples, growth * last_subpaths)
                    }
                }
            }
            Open::LightSubpaths => {
                let eye_side = per_sample * f64::from(last.size.samples);
                let subpaths =
                    ((seconds - eye_side).max(0.5 * seconds.min(eye_side)) / per_subpath.max(1e-12)).max(1.0);
                Size { light_subpaths: subpaths.min(self.most_subpaths(last)) as u64, ..last.size }
            }
            // Light subpaths that were not set follow the samples, as in the preview.
            Open::Samples => {
                let follow = self.preview.light_subpaths as f64 == self.light_subpaths_per_sample;
                let light_per_sample =
                    if follow { self.light_subpaths_per_sample * per_subpath } else { 0.0 };
                let fixed = if follow { 0.0 } else { light };
                let samples = (seconds - fixed).max(0.0) / (per_sample + light_per_sample);
                let subpaths = if follow {
                    samples * self.light_subpaths_per_sample
                } else {
                    self.preview.light_subpaths as f64
                };
                self.size(samples, subpaths)
            }
        };
        let weight = size.light_subpaths as f64 / self.preview.light_subpaths.max(1) as f64;
        let weighted = self.pairs && self.open != Open::Samples;
        let weight = if weighted { weight.round().clamp(1.0, 1e6) as u32 } else { 1 };
        // Less where memory is short.
        let growth = size.light_subpaths as f64 / last.size.light_subpaths.max(1) as f64;
        let per_sample = per_sample * (1.0 + self.playing(last) * (growth - 1.0));
        let planned = size.light_subpaths as f64 * per_subpath + f64::from(size.samples) * per_sample;
        Some(Next { size, weight, seconds: planned.min(seconds) })
    }

    fn size(&self, samples: f64, subpaths: f64) -> Size {
        let samples = samples.round().clamp(1.0, 65535.0) as u32;
        Size { samples, light_subpaths: (subpaths as u64).max(1) }
    }

    /// The share of a sample's time that grows with the light vertices.
    fn playing(&self, last: &Measured) -> f64 {
        let Tally { eye_trace, roulette_seconds, visibility, playing, .. } = last.tally;
        let all = eye_trace + roulette_seconds + visibility;
        if self.grows && all > 0.0 { (playing / all).min(1.0) } else { 0.0 }
    }

    /// How many light subpaths fit the memory, and a tree.
    fn most_subpaths(&self, last: &Measured) -> f64 {
        let bytes = last.bytes as f64 / last.size.light_subpaths.max(1) as f64;
        // A tree's vertices are counted in 31 bits; a subpath leaves a few.
        (self.memory / (WHILE_FILLING * bytes).max(1e-3)).min((1u64 << 29) as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Integrator;

    const FILM: FilmSettings = FilmSettings { width: 100, height: 100, filter: crate::film::Filter::Box };

    /// Plays a render with given costs; the sizes and the time it took.
    fn play(
        settings: &Settings,
        per_subpath: f64,
        per_sample: f64,
        vertex_bytes: f64,
    ) -> (Vec<(Size, u32)>, f64) {
        play_growing(settings, per_subpath, [per_sample, 0.0], vertex_bytes)
    }

    /// The same, where a sample costs more with each light subpath.
    fn play_growing(
        settings: &Settings,
        per_subpath: f64,
        per_sample: [f64; 2],
        vertex_bytes: f64,
    ) -> (Vec<(Size, u32)>, f64) {
        let sizing = Sizing::new(settings, &FILM).unwrap();
        let (mut size, mut elapsed, mut sizes) = (Size::of(settings, &FILM), 0.0, Vec::new());
        loop {
            let (n, samples) = (size.light_subpaths as f64, f64::from(size.samples));
            let playing = per_sample[1] * n * samples;
            let sides = [per_subpath * n, per_sample[0] * samples + playing];
            elapsed += sides[0] + sides[1];
            let bytes = (vertex_bytes * size.light_subpaths as f64) as usize;
            let tally = Tally { sides, playing, eye_trace: sides[1], ..Tally::default() };
            let last = Measured { size, tally, bytes };
            match sizing.next(elapsed, &last) {
                Some(next) => sizes.push((next.size, next.weight)),
                None => return (sizes, elapsed),
            }
            size = sizes.last().unwrap().0;
            assert!(sizes.len() < 1000);
        }
    }

    fn timed(integrator: Integrator) -> Settings {
        Settings { integrator, time: Some(40.0), memory: 1.0, ..Settings::default() }
    }

    #[test]
    fn the_roulette_gets_one_large_iteration() {
        let (sizes, took) = play(&timed(Integrator::LvcHrr), 1e-6, 0.05, 20.0);
        assert!((took / 40.0 - 1.0).abs() < 0.03, "{took}");
        let (last, weight) = sizes[1];
        assert_eq!(sizes.len(), 2, "{sizes:?}");
        let ratio = last.light_subpaths as f64 * 1e-6 / (f64::from(last.samples) * 0.05);
        assert!((ratio * (1.0 / LIGHT_SHARE - 1.0) - 1.0).abs() < 0.02, "{ratio}");
        // All but the preview's and the pilot's time.
        let most = 40.0 * LIGHT_SHARE / 1e-6;
        assert!(last.light_subpaths as f64 > 0.93 * most && f64::from(weight) > 0.93e-4 * most);
    }

    #[test]
    fn a_roulette_that_takes_longer_with_more_vertices_ends_in_time() {
        let settings = Settings { axis_probability: Some(4.0), ..timed(Integrator::LvcHrr) };
        for per_pair in [1e-9, 1e-8, 1e-7, 1e-6] {
            let (sizes, took) = play_growing(&settings, 1e-6, [0.02, per_pair], 20.0);
            assert!((took / 40.0 - 1.0).abs() < 0.05, "{per_pair}: {took} {sizes:?}");
        }
        // Where memory is short as well, in several iterations.
        for per_pair in [1e-9, 1e-8] {
            let (sizes, took) = play_growing(&settings, 1e-6, [0.02, per_pair], 200.0);
            assert!(sizes.len() >= 4 && (took / 40.0 - 1.0).abs() < 0.05, "{per_pair}: {took} {sizes:?}");
        }
    }

    #[test]
    fn memory_bounds_light_subpaths_and_makes_more_iterations() {
        let (sizes, took) = play(&timed(Integrator::LvcHrr), 1e-6, 0.05, 200.0);
        let most = 1e9 / (WHILE_FILLING * 200.0);
        assert!(sizes.iter().all(|(s, _)| s.light_subpaths as f64 <= most), "{sizes:?}");
        assert!(sizes.len() >= 4 && (took / 40.0 - 1.0).abs() < 0.05, "{took} {sizes:?}");
    }

    #[test]
    fn path_tracing_shows_parts() {
        let (sizes, took) = play(&timed(Integrator::Pt), 0.0, 0.05, 0.0);
        assert!(sizes.len() >= 8 && sizes.iter().all(|&(_, w)| w == 1), "{sizes:?}");
        assert!((took / 40.0 - 1.0).abs() < 0.05, "{took}");
    }

    #[test]
    fn what_is_set_stays() {
        let fixed = |samples, light_subpaths| {
            let settings = Settings { samples, light_subpaths, ..timed(Integrator::LvcHrr) };
            Sizing::new(&settings, &FILM).is_none() || {
                let (sizes, _) = play(&settings, 1e-6, 0.05, 30.0);
                sizes.iter().all(|(s, _)| {
                    (samples == 0 || s.samples == samples)
                        && (light_subpaths == 0 || s.light_subpaths == light_subpaths)
                })
            }
        };
        assert!(fixed(3, 5000) && fixed(0, 5000) && fixed(3, 0));
        let untimed = Settings { time: None, ..timed(Integrator::LvcHrr) };
        assert!(Sizing::new(&untimed, &FILM).is_none());
    }
}
