//! The first two dimensions of the Sobol sequence, scrambled and shuffled: any power of two of consecutive points puts one
//! point into each of as many equal intervals, and rectangles, of the unit square.
//!
//! Scrambling and shuffling by keys keep this, and make sequences of different keys independent, so that they can be
//! used side by side for any number of purposes ("padding") [Burley20]. The permutations are nested uniform ones, of
//! Laine and Karras's kind with better mixing [Vegdahl21].

/// Permutes numbers so that each bit is flipped by a hash of the bits *below* it.
#[inline(always)]
fn permute_upwards(mut bits: u32, key: u32) -> u32 {
    bits ^= bits.wrapping_mul(0x3d20_adea);
    bits = bits.wrapping_add(key).wrapping_mul((key >> 16) | 1);
    bits ^= bits.wrapping_mul(0x0552_6c56);
    bits ^ bits.wrapping_mul(0x53a2_2864)
}

/// The number of a point after shuffling: blocks of 2^k consecutive points stay together.
#[inline(always)]
fn shuffled(index: u32, key: u32) -> u32 {
    permute_upwards(index.reverse_bits(), key).reverse_bits()
}

/// A point of the one-dimensional sequence, as a fraction of 2^32.
#[inline(always)]
pub fn point1(index: u32, key: u64) -> u32 {
    // In one dimension, scrambling the points does all that shuffling them would, but for their order.
    permute_upwards(shuffled(index, key as u32), (key >> 32) as u32).reverse_bits()
}

/// A point of the two-dimensional sequence, as fractions of 2^32. `keys`: 96 bits that count.
#[inline(always)]
pub fn point2(index: u32, keys: [u64; 2]) -> [u32; 2] {
    let x = shuffled(index, keys[0] as u32);
    // The second dimension's matrix is Pascal's triangle modulo 2: polynomials f(t) over two elements become f(t + 1).
    let mut y = x;
    y ^= (y >> 1) & 0x5555_5555;
    y ^= (y >> 2) & 0x3333_3333;
    y ^= (y >> 4) & 0x0f0f_0f0f;
    y ^= (y >> 8) & 0x00ff_00ff;
    y ^= y >> 16;
    // Both read from the lowest bit up, which is the highest of the point.
    [(x, (keys[0] >> 32) as u32), (y, keys[1] as u32)]
        .map(|(bits, key)| permute_upwards(bits, key).reverse_bits())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::counter::mix;

    fn keys(i: u64) -> [u64; 2] {
        [mix(i + 1), mix(i ^ 0x1234_5678_9abc_def0)]
    }

    #[test]
    fn the_second_dimension_is_sobols() {
        // Direction numbers by their recurrence, v_{i+1} = v_i ^ (v_i >> 1).
        let direction = |i: u32| (0..i).fold(1u32 << 31, |v, _| v ^ (v >> 1));
        for index in [0u32, 1, 2, 3, 1000, 0xdead_beef, u32::MAX] {
            let expected = (0..32).filter(|i| index >> i & 1 == 1).fold(0, |sum, i| sum ^ direction(i));
            let mut y = index;
            for (shift, mask) in
                [(1, 0x5555_5555), (2, 0x3333_3333), (4, 0x0f0f_0f0f), (8, 0x00ff_00ff), (16, 0xffff)]
            {
                y ^= (y >> shift) & mask;
            }
            assert_eq!(y.reverse_bits(), expected);
        }
    }

    #[test]
    fn each_interval_has_one_point() {
        for (k, log) in (0..40).zip((0..9).cycle()) {
            let n = 1u32 << log;
            // Any aligned block of the sequence.
            let first = n * (k % 5) as u32;
            let key = keys(k);
            let mut seen = vec![0; n as usize];
            for i in first..first + n {
                seen[((u64::from(point1(i, key[0])) * u64::from(n)) >> 32) as usize] += 1;
            }
            assert!(seen.iter().all(|&c| c == 1), "{n} points in one dimension: {seen:?}");
            for across in 0..=log {
                let mut seen = vec![0; n as usize];
                for i in first..first + n {
                    let [x, y] = point2(i, key).map(u64::from);
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
                let [x, y] = point2(index, keys(k));
                let other = point1(index, keys(k)[0] ^ mix(k + 77));
                cells[((x >> 30) << 4 | (y >> 30) << 2 | other >> 30) as usize] += 1;
            }
            // chi^2 of 63 degrees of freedom: 121 is its 1 - 1e-5 quantile.
            let expected = n as f64 / 64.0;
            let chi2: f64 = cells.iter().map(|&c| (f64::from(c) - expected).powi(2) / expected).sum();
            assert!(chi2 < 121.0, "point {index}: chi^2 {chi2}");
        }
    }
}
