//! The first five dimensions of the Sobol sequence, shuffled and scrambled: any power of two of consecutive points puts
//! one point into each of as many equal intervals of every dimension, and rectangles of the first two.
//!
//! Shuffling and scrambling by keys keeps this, and makes sequences of different keys independent, so that they can be
//! used side by side for any number of purposes ("padding") \[Burley20\]. Both permutations are nested uniform ones, of
//! Laine and Karras's kind with better mixing \[Vegdahl21\]. Numbers are read from the point down: the lowest bit of a
//! point's place in the sequence is the highest of its first coordinate.

use super::counter::mix;

/// Dimensions of a point.
const DIMENSIONS: usize = 5;

/// Coefficients between the first and the last of a primitive polynomial over two elements, highest first, its degree and
/// the first direction numbers, of the dimensions from the third on: as \[Joe08\] has them.
const POLYNOMIALS: [(u32, usize, [u32; 3]); DIMENSIONS - 2] =
    [(0b1, 2, [1, 3, 0]), (0b01, 3, [1, 3, 1]), (0b10, 3, [1, 1, 1])];

/// The coordinate in a dimension from the third on, as the sum without carry of what each byte of the first adds.
static BY_BYTE: [[[u32; 256]; 4]; DIMENSIONS - 2] = by_byte();

const fn by_byte() -> [[[u32; 256]; 4]; DIMENSIONS - 2] {
    let mut table = [[[0; 256]; 4]; DIMENSIONS - 2];
    let mut dimension = 0;
    while dimension < DIMENSIONS - 2 {
        let (coefficients, degree, first) = POLYNOMIALS[dimension];
        let mut column = [0u32; 32];
        let mut i = 0;
        while i < 32 {
            if i < degree {
                column[i] = first[i] << (31 - i);
            } else {
                column[i] = column[i - degree] ^ (column[i - degree] >> degree);
                let mut k = 1;
                while k < degree {
                    column[i] ^= column[i - k] * (coefficients >> (degree - 1 - k) & 1);
                    k += 1;
                }
            }
            // Bit i of the place is bit 31 - i of the first coordinate.
            let (byte, bit) = ((31 - i) / 8, (31 - i) % 8);
            let mut value = 0;
            while value < 256 {
                table[dimension][byte][value] ^= column[i] * (value as u32 >> bit & 1);
                value += 1;
            }
            i += 1;
        }
        dimension += 1;
    }
    table
}

/// A place in the sequence, as points read it.
#[derive(Debug, Clone, Copy)]
pub struct Place(u32);

impl Place {
    /// Of the `index`-th point.
    #[inline(always)]
    pub fn new(index: u32) -> Self {
        Self(index.reverse_bits())
    }

    /// `N` coordinates of the point, from the dimension `first` on, as fractions of 2^32. Points of one key belong together.
    ///
    /// # Panics
    /// If there are no such dimensions.
    #[inline(always)]
    pub fn point<const N: usize>(self, key: u64, first: usize) -> [u32; N] {
        // Blocks of 2^k consecutive points stay together.
        let x = permuted(self.0, key as u32);
        std::array::from_fn(|i| match first + i {
            0 => x,
            dimension => {
                let y = if dimension == 1 { second(x) } else { further(x, dimension) };
                // Intervals of 2^-k stay together.
                permuted(y.reverse_bits(), mix(key.wrapping_add(dimension as u64)) as u32).reverse_bits()
            }
        })
    }
}

/// Flips each bit by a hash of the bits below it.
#[inline(always)]
fn permuted(mut bits: u32, key: u32) -> u32 {
    bits ^= bits.wrapping_mul(0x3d20_adea);
    bits = bits.wrapping_add(key).wrapping_mul((key >> 16) | 1);
    bits ^= bits.wrapping_mul(0x0552_6c56);
    bits ^ bits.wrapping_mul(0x53a2_2864)
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

/// A coordinate after the second, from the first.
#[inline(always)]
fn further(x: u32, dimension: usize) -> u32 {
    let bytes = &BY_BYTE[dimension - 2];
    x.to_le_bytes().iter().zip(bytes).fold(0, |sum, (&byte, table)| sum ^ table[usize::from(byte)])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All coordinates of a point that is neither shuffled nor scrambled.
    fn plain(index: u32) -> [u32; DIMENSIONS] {
        let x = index.reverse_bits();
        [x, second(x), further(x, 2), further(x, 3), further(x, 4)]
    }

    #[test]
    fn the_second_dimension_is_sobols() {
        // Direction numbers by their recurrence, v_{i+1} = v_i ^ (v_i >> 1).
        let direction = |i: u32| (0..i).fold(1u32 << 31, |v, _| v ^ (v >> 1));
        for index in [0u32, 1, 2, 3, 1000, 0xdead_beef, u32::MAX] {
            let expected = (0..32).filter(|i| index >> i & 1 == 1).fold(0, |sum, i| sum ^ direction(i));
            assert_eq!(second(index.reverse_bits()), expected);
        }
    }

    /// In eighths, by the order of Gray's code, as tables of the sequence give it.
    #[test]
    fn the_first_points_are_sobols() {
        let points = [
            [0, 0, 0, 0, 0],
            [4, 4, 4, 4, 4],
            [6, 2, 2, 2, 6],
            [2, 6, 6, 6, 2],
            [3, 3, 5, 7, 3],
            [7, 7, 1, 3, 7],
            [5, 1, 7, 5, 5],
            [1, 5, 3, 1, 1],
        ];
        for (n, expected) in (0u32..).zip(points) {
            assert_eq!(plain(n ^ (n >> 1)).map(|v| v >> 29), expected, "point {n}");
        }
    }

    #[test]
    fn each_interval_has_one_point() {
        for (k, log) in (0..40).zip((0..9).cycle()) {
            let n = 1u32 << log;
            // Any aligned block of the sequence.
            let first = n * (k % 5) as u32;
            let key = mix(k + 1);
            let points: Vec<[u32; DIMENSIONS]> =
                (first..first + n).map(|i| Place::new(i).point(key, 0)).collect();
            for dimension in 0..DIMENSIONS {
                let mut seen = vec![0; n as usize];
                for point in &points {
                    seen[((u64::from(point[dimension]) * u64::from(n)) >> 32) as usize] += 1;
                }
                assert!(seen.iter().all(|&c| c == 1), "{n} points in dimension {dimension}: {seen:?}");
            }
            for across in 0..=log {
                let mut seen = vec![0; n as usize];
                for point in &points {
                    let (x, y) = (u64::from(point[0]), u64::from(point[1]));
                    let (column, row) = (x << across >> 32, y << (log - across) >> 32);
                    seen[((row << across) + column) as usize] += 1;
                }
                assert!(seen.iter().all(|&c| c == 1), "2^{across} columns of 2^{log}: {seen:?}");
            }
        }
    }

    /// What the third dimension is for: where a number of it decides which points of the square are used, those that
    /// are used are spread evenly too.
    #[test]
    fn half_of_the_points_is_spread_evenly() {
        let empty = |even: bool| -> usize {
            let cells = |key: u64| {
                let mut seen = [false; 16];
                for i in 0..64 {
                    let [x, y, z] = Place::new(i).point(mix(key), 0);
                    let z = if even { z } else { mix(u64::from(i) << 32 | key) as u32 };
                    if z < 1 << 31 {
                        seen[((x >> 30) << 2 | y >> 30) as usize] = true;
                    }
                }
                seen.iter().filter(|&&s| !s).count()
            };
            (1..200).map(cells).sum()
        };
        assert_eq!(empty(true), 0);
        assert!(empty(false) > 50);
    }

    /// Over keys, the point of any number is uniform, and independent of that with another key.
    #[test]
    fn points_are_uniform_over_keys() {
        for index in [0u32, 1, 7, 100_000] {
            let n = 64_000;
            let (mut pairs, mut across) = ([0u32; 64], [0u32; 64]);
            for k in 0..n {
                let point: [u32; DIMENSIONS] = Place::new(index).point(mix(k + 1), 0);
                let [other] = Place::new(index).point(mix(k + 1_000_000), 0);
                pairs[((point[0] >> 30) << 4 | (point[1] >> 30) << 2 | other >> 30) as usize] += 1;
                let cell = point.iter().fold(other >> 31, |cell, v| cell << 1 | v >> 31);
                across[cell as usize] += 1;
            }
            for cells in [pairs, across] {
                // chi^2 of 63 degrees of freedom: 121 is its 1 - 1e-5 quantile.
                let expected = n as f64 / 64.0;
                let chi2: f64 = cells.iter().map(|&c| (f64::from(c) - expected).powi(2) / expected).sum();
                assert!(chi2 < 121.0, "point {index}: chi^2 {chi2}");
            }
        }
    }
}
