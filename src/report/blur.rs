//! Noise and blur of vertex merging: square error = a / n + b n^-c after n iterations.
//!
//! Noise falls as 1/n; blur falls with the shrinking radius, c = 2 (1 - alpha) in the limit [Knaus & Zwicker 2011], where
//! the fit finds c itself from what was measured.

use super::fall::TwoParts;

/// The exponents that are tried; 0: a blur that stays.
const EXPONENTS: usize = 20;

/// From here on an exponent is as good as that of noise.
const AS_NOISE: f64 = 0.9;

/// How a square error is made up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Blur {
    /// Square of the noise of one iteration.
    pub noise: f64,
    /// Square of the first iteration's blur.
    pub blur: f64,
    /// How fast the square of the blur falls, from 0 (not at all) to below 1 (as fast as noise).
    pub exponent: f64,
}

impl Blur {
    /// The least squares fit, in relative errors, to points (iterations, square error), both positive; parts are not
    /// negative. `None` for fewer than four points: there are three unknowns.
    pub fn fit(points: &[(f64, f64)]) -> Option<Self> {
        if points.len() < 4 || points.iter().any(|&(n, square)| !(n > 0.0 && square > 0.0)) {
            return None;
        }
        let candidates = (0..EXPONENTS).map(|i| TwoParts::fit(points, i as f64 / EXPONENTS as f64));
        let best = candidates.min_by(|a, b| a.residual(points).total_cmp(&b.residual(points)))?;
        Some(Self { noise: best.first, blur: best.second, exponent: best.exponent })
    }

    fn parts(&self) -> TwoParts {
        TwoParts { first: self.noise, second: self.blur, exponent: self.exponent }
    }

    /// Whether what was taken for blur may as well be noise, since it falls as fast.
    pub fn is_like_noise(&self) -> bool {
        self.exponent >= AS_NOISE
    }

    /// The square error after `n` iterations.
    pub fn square(&self, n: f64) -> f64 {
        self.parts().square(n)
    }

    /// Iterations from which on there is more blur than noise; infinite when there never is.
    pub fn overtakes(&self) -> f64 {
        if self.blur > 0.0 {
            (self.noise / self.blur).powf(1.0 / (1.0 - self.exponent))
        } else {
            f64::INFINITY
        }
    }

    /// Iterations to a square error; infinite when it is never reached.
    pub fn iterations_to(&self, square: f64) -> f64 {
        self.parts().reached(square)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(noise: f64, blur: f64, exponent: f64) -> Vec<(f64, f64)> {
        let truth = Blur { noise, blur, exponent };
        (0..8).map(|k| f64::from(1 << k)).map(|n| (n, truth.square(n))).collect()
    }

    #[test]
    fn the_parts_are_found_again() {
        for (noise, blur, exponent) in [(1.0, 0.01, 0.5), (2.0, 0.5, 0.0), (0.1, 0.1, 0.8)] {
            let found = Blur::fit(&points(noise, blur, exponent)).unwrap();
            assert!((found.noise / noise - 1.0).abs() < 1e-6, "{found:?}");
            assert!((found.blur / blur - 1.0).abs() < 1e-6 && found.exponent == exponent, "{found:?}");
        }
        let noise = Blur::fit(&points(3.0, 0.0, 0.0)).unwrap();
        assert!((noise.square(256.0) * 256.0 / 3.0 - 1.0).abs() < 1e-6, "{noise:?}");
    }

    #[test]
    fn parts_are_never_negative_and_too_little_is_refused() {
        // Falls faster than noise.
        let steep: Vec<_> = (0..6).map(|k| f64::from(1 << k)).map(|n| (n, n.powf(-1.2))).collect();
        let found = Blur::fit(&steep).unwrap();
        assert!(found.noise >= 0.0 && found.blur >= 0.0, "{found:?}");
        for (exponent, like_noise) in [(0.8, false), (0.95, true)] {
            assert_eq!(Blur::fit(&points(0.0, 0.1, exponent)).unwrap().is_like_noise(), like_noise);
        }
        assert_eq!(Blur::fit(&points(1.0, 1.0, 0.5)[..3]), None);
        assert_eq!(Blur::fit(&[(1.0, 1.0), (2.0, -0.1), (4.0, 0.1), (8.0, 0.1)]), None);
    }

    #[test]
    fn times_are_told_from_the_parts() {
        let b = Blur { noise: 1.0, blur: 0.01, exponent: 0.5 };
        assert!((b.overtakes() - 1e4).abs() < 1e-6);
        assert!((b.square(b.iterations_to(1e-3)) / 1e-3 - 1.0).abs() < 1e-6);
        assert_eq!(Blur { exponent: 0.0, ..b }.iterations_to(0.005), f64::INFINITY);
        assert_eq!(Blur { blur: 0.0, ..b }.overtakes(), f64::INFINITY);
    }
}
