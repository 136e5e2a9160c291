//! Relative square errors of images: one definition for what is estimated while rendering and for what is measured
//! against a reference.

use super::Spectrum;

/// `eps` of relative errors, in units of the image's mean luminance.
pub const FLOOR: f64 = 0.01;

/// `eps` of relative errors for an image's mean luminance; never 0, so that black images compare.
pub fn floor(mean_luminance: f64) -> f64 {
    (FLOOR * mean_luminance.abs()).max(1e-30)
}

/// A pixel's square error relative to itself: the mean over its channels of d^2 / (r^2 + eps^2), `square` the squares d^2.
pub fn relative_square(square: Spectrum, reference: Spectrum, eps: f64) -> f64 {
    let d = square / (reference * reference + Spectrum::splat(eps * eps));
    (d.x + d.y + d.z) / 3.0
}

/// Side of the tiles that local errors are relative to, pixels.
pub const TILE: u32 = 16;

/// The tiles of an image: 16 x 16 pixels each, less at the right and lower border.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tiles {
    width: u32,
    height: u32,
}

impl Tiles {
    /// Those of an image of that size.
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height }
    }

    /// How many there are.
    pub fn count(self) -> usize {
        (self.across() * self.height.div_ceil(TILE)) as usize
    }

    fn across(self) -> u32 {
        self.width.div_ceil(TILE)
    }

    /// The tile of a pixel; tiles are numbered row by row.
    pub fn of(self, x: u32, y: u32) -> usize {
        (y / TILE * self.across() + x / TILE) as usize
    }

    /// Pixels in a tile.
    pub fn pixels(self, tile: usize) -> f64 {
        let side = |i: u32, size: u32| f64::from((size - i * TILE).min(TILE));
        let tile = tile as u32;
        side(tile % self.across(), self.width) * side(tile / self.across(), self.height)
    }

    /// The mean of each tile. `value` is that of a pixel.
    pub fn means(self, value: impl Fn(u32, u32) -> f64) -> Vec<f64> {
        let mut sums = vec![0.0; self.count()];
        for (x, y) in (0..self.height).flat_map(|y| (0..self.width).map(move |x| (x, y))) {
            sums[self.of(x, y)] += value(x, y);
        }
        sums.iter().enumerate().map(|(tile, sum)| sum / self.pixels(tile)).collect()
    }
}

/// A pixel's square error relative to what is around it: the mean over its channels of d^2, over t^2 + eps^2, t the mean
/// luminance of its tile. Unlike a pixel's own mean, that of a tile is soon known well, so that this error can be told
/// while rendering: a pixel whose light is one rare bright sample would measure its error by that very sample.
pub fn local_square(square: Spectrum, tile: f64, eps: f64) -> f64 {
    (square.x + square.y + square.z) / 3.0 / (tile * tile + eps * eps)
}

/// The mean of values without the greatest `share` of them, rounded down to whole values; reorders them. NaN for none.
pub fn trimmed_mean(values: &mut [f64], share: f64) -> f64 {
    let kept = values.len() - (values.len() as f64 * share) as usize;
    if kept < values.len() && kept > 0 {
        values.select_nth_unstable_by(kept, f64::total_cmp);
    }
    values[..kept].iter().sum::<f64>() / kept as f64
}

/// The middle of values, or the mean of the two in the middle; reorders them. NaN for none.
pub fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return f64::NAN;
    }
    values.sort_by(f64::total_cmp);
    let n = values.len();
    (values[(n - 1) / 2] + values[n / 2]) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_greatest_go() {
        let mut values: Vec<f64> = (0..1000).rev().map(f64::from).collect();
        assert_eq!(trimmed_mean(&mut values, 0.001), 499.0);
        assert_eq!(trimmed_mean(&mut values, 0.01), 494.5);
        assert_eq!(trimmed_mean(&mut values[..3], 0.01) * 3.0, values[..3].iter().sum::<f64>());
        assert!(trimmed_mean(&mut [], 0.1).is_nan());
    }

    #[test]
    fn tiles_at_the_border_are_smaller() {
        let tiles = Tiles::new(20, 33);
        assert_eq!((tiles.count(), tiles.of(15, 15), tiles.of(16, 15), tiles.of(19, 32)), (6, 0, 1, 5));
        assert_eq!([0, 1, 4, 5].map(|t| tiles.pixels(t)), [256.0, 64.0, 16.0, 4.0]);
        let means = tiles.means(|x, y| f64::from(tiles.of(x, y) as u32));
        assert_eq!(means, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(local_square(Spectrum::new(3.0, 0.0, 0.0), 2.0, 1.0), 0.2);
    }

    #[test]
    fn the_middle_of_few() {
        assert_eq!((median(&mut [3.0, 1.0, 9.0]), median(&mut [4.0, 1.0, 3.0, 9.0])), (3.0, 3.5));
    }
}
