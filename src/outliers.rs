//! Outliers: rare contributions to a pixel that are much brighter than what is around them, and what to make of them.
//!
//! A bright contribution that others around it do not confirm is most likely noise, and one that does is light. So the few
//! largest contributions to each pixel are remembered beside the plain sum, which stays as it is, and what too few of them
//! have the like of around a pixel is counted for less \[Zirr18\]. They sort all contributions into layers of
//! brightness instead; lists of the largest take less memory and need no range of brightness to be known. What is left out
//! goes to zero as samples are added, but the image of any number of them is biased.

use crate::math::{Spectrum, luminance};

/// How many contributions around a pixel confirm each other; as many of each pixel are remembered.
const CONFIRMED: usize = 4;
/// How many times larger than the least of these a contribution may be.
const RANGE: f64 = 4.0;
/// Share of the median sum around a pixel that a contribution may be in any case: then it does not make an outlier of the pixel.
const HARMLESS: f64 = 0.1;

/// A contribution to a pixel's sum.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Contribution([f32; 3]);

impl Contribution {
    fn new(value: Spectrum) -> Self {
        Self(value.to_array().map(|v| v as f32))
    }

    fn value(self) -> Spectrum {
        Spectrum::from_array(self.0.map(f64::from))
    }

    fn size(self) -> f64 {
        luminance(self.value())
    }

    /// A total order, so that it does not matter which of several came first.
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        let channels = || self.0.iter().zip(&other.0).map(|(a, b)| a.total_cmp(b));
        self.size()
            .total_cmp(&other.size())
            .then_with(|| channels().find(|o| o.is_ne()).unwrap_or(std::cmp::Ordering::Equal))
    }
}

/// The largest contributions to a pixel, in falling order; zeros where there are fewer.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Largest([Contribution; CONFIRMED]);

impl Largest {
    /// Takes in a contribution.
    pub fn add(&mut self, value: Spectrum) {
        self.take(Contribution::new(value));
    }

    /// Takes in those to another sum, times a factor.
    pub fn add_scaled(&mut self, other: &Self, factor: f64) {
        other.0.iter().for_each(|c| self.take(Contribution::new(c.value() * factor)));
    }

    fn take(&mut self, mut new: Contribution) {
        for slot in &mut self.0 {
            if new.cmp(slot).is_gt() {
                std::mem::swap(slot, &mut new);
            }
        }
    }
}

/// What is too much of the sum of each pixel, for pixels in rows of `width` with their sums and largest contributions.
pub fn excess(width: usize, sums: &[Spectrum], largest: &[Largest]) -> Vec<Spectrum> {
    let height = sums.len() / width.max(1);
    let near = |at: usize, size: usize| at.saturating_sub(1)..(at + 2).min(size);
    (0..sums.len())
        .map(|i| {
            let around =
                || near(i / width, height).flat_map(|y| near(i % width, width).map(move |x| y * width + x));
            let mut all = Largest::default();
            around().for_each(|j| all.add_scaled(&largest[j], 1.0));
            let mut bright: Vec<f64> = around().map(|j| luminance(sums[j])).collect();
            let middle = bright.len() / 2;
            let median = *bright.select_nth_unstable_by(middle, f64::total_cmp).1;
            let most = (RANGE * all.0[CONFIRMED - 1].size()).max(HARMLESS * median);
            let too_much = largest[i].0.iter().filter(|c| c.size() > most);
            too_much.map(|c| c.value() * (1.0 - most / c.size())).sum()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 5;

    /// An image of `samples` contributions of 1 to each pixel, and of those given in its middle.
    fn image(samples: usize, middle: &[f64]) -> Vec<Spectrum> {
        let mut pixels = vec![(Spectrum::ZERO, Largest::default()); SIDE * SIDE];
        let mut add = |i: usize, value: f64| {
            pixels[i].0 += Spectrum::splat(value);
            pixels[i].1.add(Spectrum::splat(value));
        };
        (0..SIDE * SIDE).for_each(|i| (0..samples).for_each(|_| add(i, 1.0)));
        middle.iter().for_each(|&value| add(SIDE * SIDE / 2, value));
        let (sums, largest): (Vec<_>, Vec<_>) = pixels.into_iter().unzip();
        excess(SIDE, &sums, &largest)
    }

    fn middle(samples: usize, bright: &[f64]) -> f64 {
        let all = image(samples, bright);
        assert!(all.iter().enumerate().all(|(i, e)| i == SIDE * SIDE / 2 || *e == Spectrum::ZERO), "{all:?}");
        luminance(all[SIDE * SIDE / 2])
    }

    #[test]
    fn what_nothing_confirms_is_cut_to_what_may_be() {
        assert!((middle(10, &[100.0]) - (100.0 - RANGE)).abs() < 1e-9);
        assert!((middle(10, &[100.0, 60.0, 50.0]) - (210.0 - 3.0 * RANGE)).abs() < 1e-9);
        assert_eq!(middle(10, &[0.9 * RANGE]), 0.0);
    }

    #[test]
    fn light_stays() {
        assert_eq!(middle(10, &[100.0; CONFIRMED]), 0.0);
        assert_eq!(middle(10, &[100.0, 100.0 * RANGE, 150.0, 120.0]), 0.0);
        assert_eq!(middle(0, &[]), 0.0);
    }

    #[test]
    fn what_is_little_of_the_sum_stays() {
        assert_eq!(middle(1000, &[HARMLESS * 1000.0]), 0.0);
        assert!((middle(1000, &[1e6]) - (1e6 - HARMLESS * 1000.0)).abs() < 1.0);
    }

    #[test]
    fn the_largest_are_the_same_in_any_order_and_by_parts() {
        let values = |i: u32| Spectrum::new(f64::from(i % 7), f64::from(i % 5), f64::from(i * i % 11));
        let (mut forward, mut backward, mut halves) =
            (Largest::default(), Largest::default(), Largest::default());
        let mut half = Largest::default();
        for i in 0..100 {
            forward.add(values(i));
            backward.add(values(99 - i));
            if i % 2 == 0 { &mut halves } else { &mut half }.add(values(i));
        }
        halves.add_scaled(&half, 1.0);
        assert_eq!(forward, backward);
        assert_eq!(forward, halves);
    }
}
