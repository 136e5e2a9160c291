//! How square errors fall with time or with iterations, and how that goes on.

/// first / n + second n^-exponent: what falls as noise does, and something that falls otherwise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoParts {
    /// Of the first part, at n = 1.
    pub first: f64,
    /// Of the second.
    pub second: f64,
    /// How fast the second falls.
    pub exponent: f64,
}

impl TwoParts {
    /// The least squares fit, in relative errors, to points (n, square error), both positive; no part is negative.
    pub fn fit(points: &[(f64, f64)], exponent: f64) -> Self {
        // Columns n^-1 / square and n^-c / square, right-hand side 1.
        let (mut xx, mut xy, mut yy, mut x1, mut y1) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for &(n, square) in points {
            let (x, y) = (1.0 / (n * square), n.powf(-exponent) / square);
            (xx, xy, yy, x1, y1) = (xx + x * x, xy + x * y, yy + y * y, x1 + x, y1 + y);
        }
        let det = xx * yy - xy * xy;
        let (first, second) = ((x1 * yy - y1 * xy) / det, (y1 * xx - x1 * xy) / det);
        if first >= 0.0 && second >= 0.0 {
            return Self { first, second, exponent };
        }
        let [a, b] = [(x1 / xx, 0.0), (0.0, y1 / yy)].map(|(first, second)| Self { first, second, exponent });
        if a.residual(points) <= b.residual(points) { a } else { b }
    }

    /// The sum of the squares of relative errors.
    pub fn residual(&self, points: &[(f64, f64)]) -> f64 {
        points.iter().map(|&(n, square)| (self.square(n) / square - 1.0).powi(2)).sum()
    }

    /// The square error at `n`.
    pub fn square(&self, n: f64) -> f64 {
        self.first / n + self.second * n.powf(-self.exponent)
    }

    /// The n at which a square error is reached; infinite when it never is.
    pub fn reached(&self, square: f64) -> f64 {
        let (mut low, mut high) = (1e-6f64.ln(), 1e18f64.ln());
        if !(self.square(high.exp()) <= square) {
            return f64::INFINITY;
        }
        while high - low > 1e-9 {
            let middle = 0.5 * (low + high);
            if self.square(middle.exp()) > square { low = middle } else { high = middle }
        }
        high.exp()
    }
}

/// How the square error of a recipe without blur falls with seconds.
#[derive(Debug, Clone, Copy)]
pub enum Fall {
    /// A line through the logarithms: noise falls as 1/n, but for what is trimmed off, which is more where short runs leave
    /// rarer peaks.
    Line {
        /// Logarithm of the square after a second.
        intercept: f64,
        /// Of the logarithms.
        slope: f64,
    },
    /// Faster than that, where iterations grow on both sides: noise of pairs of eye samples and light vertices falls as n^-2, until that of
    /// samples, n^-1, is what is left (docs/theory.md, "How large an iteration is").
    Pairs(TwoParts),
}

impl Fall {
    /// Through points (seconds, square error), two at least, both positive. `growing`: whether longer runs had larger iterations, in
    /// place of more of them.
    pub fn fit(points: &[(f64, f64)], growing: bool) -> Self {
        let logs: Vec<[f64; 2]> =
            points.iter().map(|&(seconds, square)| [seconds.ln(), square.ln()]).collect();
        let mean = |i: usize| logs.iter().map(|p| p[i]).sum::<f64>() / logs.len() as f64;
        let (x, y) = (mean(0), mean(1));
        let slope = logs.iter().map(|p| (p[0] - x) * (p[1] - y)).sum::<f64>()
            / logs.iter().map(|p| (p[0] - x).powi(2)).sum::<f64>();
        if growing && slope < -1.0 {
            return Self::Pairs(TwoParts::fit(points, 2.0));
        }
        Self::Line { intercept: y - slope * x, slope }
    }

    /// The square error after so many seconds.
    pub fn square(&self, seconds: f64) -> f64 {
        match self {
            Self::Line { intercept, slope } => (intercept + slope * seconds.ln()).exp(),
            Self::Pairs(parts) => parts.square(seconds),
        }
    }

    /// Seconds to a square error.
    pub fn reached(&self, square: f64) -> f64 {
        match self {
            Self::Line { intercept, slope } => ((square.ln() - intercept) / slope).exp(),
            Self::Pairs(parts) => parts.reached(square),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn laws_are_found_again_and_read_backwards() {
        let laws: [&dyn Fn(f64) -> f64; 4] =
            [&|t| 3.0 / t, &|t| 2.0 * t.powf(-0.7), &|t| 1.0 / t + 4.0 / (t * t), &|t| 0.5 / (t * t)];
        for law in laws {
            let points: Vec<(f64, f64)> = (0..4).map(|k| f64::from(1 << k)).map(|t| (t, law(t))).collect();
            let fall = Fall::fit(&points, true);
            for t in [1.0, 8.0, 16.0, 100.0] {
                assert!((fall.square(t) / law(t) - 1.0).abs() < 1e-6, "{fall:?} at {t}");
                assert!((fall.reached(law(t)) / t - 1.0).abs() < 1e-6, "{fall:?} at {t}");
            }
        }
    }

    #[test]
    fn no_part_is_negative() {
        // Falls faster than pairs.
        let steep: Vec<_> = (0..4).map(|k| f64::from(1 << k)).map(|t| (t, t.powi(-3))).collect();
        assert!(matches!(Fall::fit(&steep, false), Fall::Line { slope, .. } if (slope + 3.0).abs() < 1e-9));
        let parts = TwoParts::fit(&steep, 2.0);
        assert!(parts.first == 0.0 && parts.second > 0.0, "{parts:?}");
    }
}
