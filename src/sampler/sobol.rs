//! The first two dimensions of the Sobol sequence, shuffled and shifted: any power of two of consecutive points puts one
//! point into each of as many equal intervals, and rectangles, of the unit square.
//!
//! Shuffling by keys keeps this, and makes sequences of different keys independent, so that they can be used side by side
//! for any number of purposes ("padding") \[Burley20\]. The permutation is a nested uniform one, of Laine and Karras's kind
//! with better mixing \[Vegdahl21\]. Numbers are read from the point down: the lowest bit of a point's place in the sequence
//! is the highest of its coordinate.

/// A place in the sequence, as points read it.
#[derive(Debug, Clone, Copy)]
pub struct Place(u32);

impl Place {
    /// Of the `index`-th point.
    #[inline(always)]
    pub fn new(index: u32) -> Self {
        Self(index.reverse_bits())
    }

    /// The place after shuffling: each bit is flipped by a hash of the bits below it, so that blocks of 2^k consecutive
    /// points stay together.
    #[inline(always)]
    fn shuffled(self, key: u32) -> u32 {
        let mut bits = self.0;
        bits ^= bits.wrapping_mul(0x3d20_adea);
        bits = bits.wrapping_add(key).wrapping_mul((key >> 16) | 1);
        bits ^= bits.wrapping_mul(0x0552_6c56);
        bits ^ bits.wrapping_mul(0x53a2_2864)
    }

    /// The point of the one-dimensional sequence, as a fraction of 2^32. The lower half of the key counts.
    #[inline(always)]
    pub fn point1(self, key: u64) -> u32 {
        self.shuffled(key as u32)
    }

    /// The point of the two-dimensional sequence, as fractions of 2^32.
    #[inline(always)]
    pub fn point2(self, key: u64) -> [u32; 2] {
        let x = self.shuffled(key as u32);
        [x, second(x) ^ (key >> 32) as u32]
    }
}

/// The second coordinate from the first. Its matrix is Pascal's triangle modulo 2: of polynomials over two elements,
/// f(t) becomes f(t + 1).
#[inline(always)]
fn second(x: u32) -> u32 {
    let mut y = x;
    y ^= (y << 1) & 0xaaaa_aaaa;
    y ^= (y << 2) & 0xcccc_cccc;
    y ^= (y << 4) & 0xf0f0_f0f0;
    y ^= (y << 8) & 0xff00_ff00;
    y ^ (y << 16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::counter::mix;

    #[test]
    fn the_second_dimension_is_sobols() {
        // Direction numbers by their recurrence, v_{i+1} = v_i ^ (v_i >> 1).
        let direction = |i: u32| (0..i).fold(1u32 << 31, |v, _| v ^ (v >> 1));
        for index in [0u32, 1, 2, 3, 1000, 0xdead_beef, u32::MAX] {
            let expected = (0..32).filter(|i| index >> i & 1 == 1).fold(0, |sum, i| sum ^ direction(i));
            assert_eq!(second(index.reverse_bits()), expected);
        }
    }

    #[test]
    fn each_interval_has_one_point() {
        for (k, log) in (0..40).zip((0..9).cycle()) {
            let n = 1u32 << log;
            // Any aligned block of the sequence.
            let first = n * (k % 5) as u32;
            let key = mix(k + 1);
            let mut seen = vec![0; n as usize];
            for i in first..first + n {
                seen[((u64::from(Place::new(i).point1(key)) * u64::from(n)) >> 32) as usize] += 1;
            }
            assert!(seen.iter().all(|&c| c == 1), "{n} points in one dimension: {seen:?}");
            for across in 0..=log {
                let mut seen = vec![0; n as usize];
                for i in first..first + n {
                    let [x, y] = Place::new(i).point2(key).map(u64::from);
                    let (column, row) = (x << across >> 32, y << (log - across) >> 32);
                    seen[((row << across) + column) as usize] += 1;
                }
                assert!(seen.iter().all(|&c| c == 1), "2^{across} columns of 2^{log}: {seen:?}");
            }
        }
    }

    /// Over keys, the point of any number is uniform, and independent of that with another key.
    #[test]
    fn points_are_uniform_over_keys() {
        for index in [0u32, 1, 7, 100_000] {
            let (mut cells, n) = ([0u32; 64], 64_000);
            for k in 0..n {
                let [x, y] = Place::new(index).point2(mix(k + 1));
                let other = Place::new(index).point1(mix(k + 1_000_000));
                cells[((x >> 30) << 4 | (y >> 30) << 2 | other >> 30) as usize] += 1;
            }
            // chi^2 of 63 degrees of freedom: 121 is its 1 - 1e-5 quantile.
            let expected = n as f64 / 64.0;
            let chi2: f64 = cells.iter().map(|&c| (f64::from(c) - expected).powi(2) / expected).sum();
            assert!(chi2 < 121.0, "point {index}: chi^2 {chi2}");
        }
    }
}
