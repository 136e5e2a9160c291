//! Whether two renders of a scene say the same.

use crate::math::luminance;
use crate::render::Noise;
use crate::report::metric::least_p;
use serde::Serialize;

/// Tiles whose mean is known to this share of itself, in standard deviations, are compared; in others rare light may not
/// have been found yet, and their own variance with it.
const SURE: f64 = 0.1;
/// How often renders of the same thing are told apart by chance.
pub const SIGNIFICANCE: f64 = 0.01;

/// The comparison of two renders by the means of their tiles (16 x 16 pixels).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Agreement {
    /// Tiles of the image.
    pub tiles: usize,
    /// Tiles that both renders know well enough to be compared.
    pub compared: usize,
    /// Largest deviation of a tile's luminance, in standard deviations.
    pub z: f64,
    /// How likely the largest of that many is as large by chance [Sidak 1967].
    pub p: f64,
    /// That tile's number, row by row, and the two means.
    pub worst: Option<(usize, [f64; 2])>,
    /// Mean luminance of the second over that of the first, over the tiles that were compared.
    pub ratio: f64,
}

impl Agreement {
    /// Whether what was compared is the same but for chance.
    pub fn holds(&self) -> bool {
        self.compared > 0 && self.p >= SIGNIFICANCE
    }
}

/// Compares two renders of one size; `None` when one of them has no variance yet. Variances are those of the tiles, so
/// that pixels may err together (with shared light subpaths they do).
pub fn agreement(a: &Noise, b: &Noise) -> Option<Agreement> {
    let (tiles_a, tiles_b) = (a.tiles()?, b.tiles()?);
    let groups = [a.groups() as f64, b.groups() as f64];
    let mut result =
        Agreement { tiles: tiles_a.len(), compared: 0, z: 0.0, p: 1.0, worst: None, ratio: f64::NAN };
    let (mut first, mut second) = (0.0, 0.0);
    for (tile, (a, b)) in tiles_a.iter().zip(&tiles_b).enumerate() {
        let (means, variances) = ([luminance(a.0), luminance(b.0)], [of_luminance(a.1), of_luminance(b.1)]);
        let sure = |i: usize| means[i] > 0.0 && variances[i].sqrt() <= SURE * means[i];
        if !(sure(0) && sure(1)) {
            continue;
        }
        result.compared += 1;
        (first, second) = (first + means[0], second + means[1]);
        let z = deviate(means[1] - means[0], variances, groups);
        if result.worst.is_none() || z > result.z {
            (result.z, result.worst) = (z, Some((tile, means)));
        }
    }
    if result.compared > 0 {
        result.p = least_p(result.z, result.compared as u32);
        result.ratio = second / first;
    }
    Some(result)
}

/// A bound of the variance of luminance: channels of one path err together.
fn of_luminance(variance: glam::DVec3) -> f64 {
    luminance(variance.map(f64::sqrt)).powi(2)
}

/// The normal deviate that is as rare as a difference of two means: Welch's t, whose degrees of freedom come from the
/// groups that the variances are from, by the approximation of [Wallace 1959].
fn deviate(difference: f64, variances: [f64; 2], groups: [f64; 2]) -> f64 {
    let sum = variances[0] + variances[1];
    if difference == 0.0 {
        return 0.0;
    }
    let t2 = difference * difference / sum;
    let freedom =
        sum * sum / (variances[0].powi(2) / (groups[0] - 1.0) + variances[1].powi(2) / (groups[1] - 1.0));
    (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0) * (freedom * (t2 / freedom).ln_1p()).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{Film, FilmSettings, Filter};
    use crate::math::Spectrum;
    use crate::sampler::counter::{combine, unit};
    use glam::DVec2;

    /// 32 x 16 pixels of mean 1, the right tile `more` brighter.
    fn noise(key: u64, more: f64, noise: f64) -> Noise {
        let mut film = Film::new(&FilmSettings { width: 32, height: 16, filter: Filter::Box });
        let mut watch = Noise::new(32, 16);
        for i in 0..40 {
            for (x, y) in (0..32u32).flat_map(|x| (0..16u32).map(move |y| (x, y))) {
                let u = unit(combine(combine(key, i), u64::from(y * 32 + x)));
                let value = 1.0 + noise * (u - 0.5) + if x < 16 { 0.0 } else { more };
                film.add(DVec2::new(x.into(), y.into()) + 0.5, Spectrum::splat(value));
            }
            film.count_samples(1);
            watch.update(&film, i + 1, i == 39);
        }
        watch
    }

    #[test]
    fn the_same_agrees_and_a_brighter_tile_is_found() {
        // The standard deviation of a tile is 1 / sqrt(12 * 256 * 40) = 0.0029.
        let same = agreement(&noise(1, 0.0, 1.0), &noise(2, 0.0, 1.0)).unwrap();
        assert!(same.holds() && same.compared == 2 && (same.ratio - 1.0).abs() < 0.01, "{same:?}");
        let brighter = agreement(&noise(1, 0.0, 1.0), &noise(2, 0.03, 1.0)).unwrap();
        assert!(!brighter.holds() && brighter.worst.unwrap().0 == 1, "{brighter:?}");
        assert!((4.0..9.0).contains(&brighter.z), "{brighter:?}");
    }

    #[test]
    fn what_is_not_known_is_not_compared() {
        let unsure = agreement(&noise(1, 0.0, 1.0), &noise(2, 0.0, 200.0)).unwrap();
        assert!(unsure.compared == 0 && !unsure.holds(), "{unsure:?}");
        assert_eq!(agreement(&noise(1, 0.0, 1.0), &Noise::new(32, 16)), None);
    }

    /// Two-sided p of t = 3 with 10 degrees of freedom is 0.01334: a normal deviate of 2.476.
    #[test]
    fn few_groups_deviate_more_by_chance() {
        assert!((deviate(3.0, [0.5, 0.5], [6.0, 6.0]) - 2.476).abs() < 0.01);
        assert!((deviate(3.0, [0.5, 0.5], [1e6, 1e6]) - 3.0).abs() < 1e-4);
    }
}
