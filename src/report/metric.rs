//! How far an image is from a reference.
//!
//! All of it is linear RGB; a pixel's error is the mean of its three channels' errors. Relative errors are squared
//! differences over `r^2 + eps^2`, r the reference and eps a hundredth of its mean luminance: what is darker than that
//! counts as if it were that bright, and images of any unit give the same numbers.

use super::flip;
use crate::error::{Error, Result};
use crate::image::Image;
use crate::math::luminance;
use crate::math::relative::{TILE, Tiles, floor, local_square, median, relative_square, trimmed_mean};
use glam::DVec3;
use serde::Serialize;

/// Sides of images are told apart by this many standard deviations.
const SIGMAS: f64 = 2.0;

/// The metrics of an image against a reference. All are 0 for equal images, but for those of variances.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Metrics {
    /// Mean square difference, in squares of the images' unit.
    pub mse: f64,
    /// Mean relative square difference.
    pub relmse: f64,
    /// The same without the worst thousandth of the pixels.
    pub relmse_trim01: f64,
    /// The same without the worst hundredth of the pixels.
    pub relmse_trim1: f64,
    /// Root of the mean square difference of all pixels but the worst thousandth, relative to the reference's tiles
    /// ([`crate::math::relative::local_square`]): what `hrr render --error` estimates.
    pub error: f64,
    /// Root of the median pixel's relative square difference.
    pub median_nrmse: f64,
    /// Mean of |a - r| / (|a| + |r|), 0..=1; 0 where both are 0.
    pub smape: f64,
    /// Mean of LDR-FLIP, 0..=1 ([`flip::map`], [`flip::PIXELS_PER_DEGREE`]).
    pub flip: f64,
    /// Pixels that are not finite in either image. They are left out of everything else, and no image passes with them.
    pub nonfinite: u64,
    /// Tests of the difference against its variance, when both variances are known.
    #[serde(flatten)]
    pub deviation: Option<Deviation>,
}

/// A difference in units of its standard deviation.
///
/// The tiles' variances are sums of the pixels': right for errors that are independent from pixel to pixel, as those of path
/// tracing are. Where pixels share light subpaths, tiles deviate more than that by chance, and only `pixels_2sigma` holds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Deviation {
    /// Largest |Z| of any tile of 16 x 16 pixels, of any channel.
    pub tile_z: f64,
    /// How likely the largest of that many tiles' deviations is as large as this by chance [Sidak 1967].
    pub tile_p: f64,
    /// Left upper corner of that tile, pixels.
    pub tile_at: [u32; 2],
    /// Share of channels of pixels that deviate by more than two standard deviations; by chance 0.0455.
    pub pixels_2sigma: f64,
}

/// The names that [`Metrics::get`] knows, in order.
pub const NAMES: [&str; 10] = [
    "error",
    "mse",
    "relmse",
    "relmse_trim01",
    "relmse_trim1",
    "median_nrmse",
    "smape",
    "flip",
    "tile_z",
    "pixels_2sigma",
];

impl Metrics {
    /// A metric by its name; `None` for unknown names and for tests without variances.
    pub fn get(&self, name: &str) -> Option<f64> {
        Some(match name {
            "error" => self.error,
            "mse" => self.mse,
            "relmse" => self.relmse,
            "relmse_trim01" => self.relmse_trim01,
            "relmse_trim1" => self.relmse_trim1,
            "median_nrmse" => self.median_nrmse,
            "smape" => self.smape,
            "flip" => self.flip,
            "tile_z" => self.deviation.as_ref()?.tile_z,
            "pixels_2sigma" => self.deviation.as_ref()?.pixels_2sigma,
            _ => return None,
        })
    }
}

/// Compares an image with a reference. `variances` are those of the pixels of either, in squares of the images' unit.
/// FLIP sees both brighter by `exposure` stops.
///
/// # Errors
/// [`Error::Input`] for images of different sizes, or without a finite pixel.
pub fn compare(
    image: &Image,
    reference: &Image,
    variances: Option<(&Image, &Image)>,
    exposure: f32,
) -> Result<Metrics> {
    let others = variances.map_or([reference; 3], |(a, b)| [reference, a, b]);
    for other in others {
        same_size(image, other)?;
    }
    let finite: Vec<usize> = (0..image.pixels.len())
        .filter(|&i| image.pixels[i].is_finite() && reference.pixels[i].is_finite())
        .collect();
    if finite.is_empty() {
        return Err(Error::Input("the images have no pixel that is finite in both".into()));
    }
    let mean_of_finite =
        |f: &dyn Fn(usize) -> f64| finite.iter().map(|&i| f(i)).sum::<f64>() / finite.len() as f64;
    let (a, r) = (|i: usize| image.pixels[i].as_dvec3(), |i: usize| reference.pixels[i].as_dvec3());
    let eps = floor(mean_of_finite(&|i| luminance(r(i))));
    let mut relative: Vec<f64> =
        finite.iter().map(|&i| relative_square((a(i) - r(i)) * (a(i) - r(i)), r(i), eps)).collect();
    let tiles = Tiles::new(image.width, image.height);
    let at = |i: usize| (i as u32 % image.width, i as u32 / image.width);
    let means = tiles.means(|x, y| {
        let l = luminance(r((y * image.width + x) as usize));
        if l.is_finite() { l } else { 0.0 }
    });
    let local = |i: usize| {
        let (x, y) = at(i);
        local_square((a(i) - r(i)) * (a(i) - r(i)), means[tiles.of(x, y)], eps)
    };
    let mut local: Vec<f64> = finite.iter().map(|&i| local(i)).collect();
    let smape = |i: usize| {
        let (a, r) = (a(i), r(i));
        let channel = |c: usize| {
            let sum = a[c].abs() + r[c].abs();
            if sum > 0.0 { (a[c] - r[c]).abs() / sum } else { 0.0 }
        };
        (0..3).map(channel).sum::<f64>() / 3.0
    };
    let seen = flip::map(&shown(image, exposure), &shown(reference, exposure), flip::PIXELS_PER_DEGREE);
    Ok(Metrics {
        mse: mean_of_finite(&|i| (a(i) - r(i)).length_squared() / 3.0),
        relmse: trimmed_mean(&mut relative, 0.0),
        relmse_trim01: trimmed_mean(&mut relative, 0.001),
        relmse_trim1: trimmed_mean(&mut relative, 0.01),
        error: trimmed_mean(&mut local, 0.001).sqrt(),
        median_nrmse: median(&mut relative).sqrt(),
        smape: mean_of_finite(&smape),
        flip: mean_of_finite(&|i| seen[i]),
        nonfinite: (image.pixels.len() - finite.len()) as u64,
        deviation: variances.map(|(va, vr)| deviation(image, reference, va, vr)),
    })
}

/// What a display shows; what is not finite is black.
fn shown(image: &Image, exposure: f32) -> Image {
    let mut shown = image.exposed(exposure);
    for pixel in &mut shown.pixels {
        *pixel = if pixel.is_finite() { *pixel } else { glam::Vec3::ZERO };
    }
    shown
}

fn same_size(a: &Image, b: &Image) -> Result<()> {
    if (a.width, a.height) == (b.width, b.height) {
        return Ok(());
    }
    Err(Error::Input(format!(
        "images of {}x{} and {}x{} pixels cannot be compared",
        a.width, a.height, b.width, b.height
    )))
}

fn deviation(image: &Image, reference: &Image, va: &Image, vr: &Image) -> Deviation {
    let (width, height) = (image.width, image.height);
    let mut worst = Deviation { tile_z: 0.0, tile_p: 1.0, tile_at: [0, 0], pixels_2sigma: 0.0 };
    let (mut beyond, mut tests) = (0u64, 0u32);
    for y in (0..height).step_by(TILE as usize) {
        for x in (0..width).step_by(TILE as usize) {
            let (mut difference, mut variance) = (DVec3::ZERO, DVec3::ZERO);
            for j in y..(y + TILE).min(height) {
                for i in (x..(x + TILE).min(width)).map(|x| (j * width + x) as usize) {
                    let d = image.pixels[i].as_dvec3() - reference.pixels[i].as_dvec3();
                    let v = va.pixels[i].as_dvec3() + vr.pixels[i].as_dvec3();
                    if d.is_finite() && v.is_finite() {
                        difference += d;
                        variance += v;
                        beyond += (0..3).filter(|&c| z(d[c], v[c]) > SIGMAS).count() as u64;
                    }
                }
            }
            for c in 0..3 {
                tests += 1;
                let z = z(difference[c], variance[c]);
                if z > worst.tile_z {
                    (worst.tile_z, worst.tile_at) = (z, [x, y]);
                }
            }
        }
    }
    worst.tile_p = least_p(worst.tile_z, tests);
    worst.pixels_2sigma = beyond as f64 / (3 * image.pixels.len()) as f64;
    worst
}

/// |difference| in standard deviations; 0 for none.
pub fn z(difference: f64, variance: f64) -> f64 {
    if difference == 0.0 { 0.0 } else { difference.abs() / variance.max(0.0).sqrt() }
}

/// How likely it is that of `tests` standard normal numbers one is at least `z` from 0.
pub fn least_p(z: f64, tests: u32) -> f64 {
    let one = libm::erfc(z / std::f64::consts::SQRT_2);
    // 1 - (1 - p)^n without rounding small p away.
    -(f64::from(tests.max(1)) * (-one).ln_1p()).exp_m1()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn image(width: u32, pixels: Vec<Vec3>) -> Image {
        Image { width, height: pixels.len() as u32 / width, pixels }
    }

    /// Two pixels by hand. Reference (1,1,1), (3,3,3): eps = 0.02. Differences 0.5 (red) and -1 (all).
    #[test]
    fn two_pixels_by_hand() {
        let r = image(2, vec![Vec3::ONE, Vec3::splat(3.0)]);
        let a = image(2, vec![Vec3::new(1.5, 1.0, 1.0), Vec3::splat(2.0)]);
        let m = compare(&a, &r, None, 0.0).unwrap();
        let near = |x: f64, y: f64| assert!((x - y).abs() < 1e-9, "{x} {y}");
        near(m.mse, (0.25 / 3.0 + 1.0) / 2.0);
        let (first, second) = (0.25 / 1.0004 / 3.0, 1.0 / 9.0004);
        near(m.relmse, (first + second) / 2.0);
        near(m.relmse_trim1, m.relmse);
        near(m.median_nrmse, m.relmse.sqrt());
        near(m.error * m.error, (0.25 / 3.0 + 1.0) / 2.0 / 4.0004);
        near(m.smape, (0.5 / 2.5 / 3.0 + 1.0 / 5.0) / 2.0);
        assert_eq!((m.nonfinite, &m.deviation), (0, &None));
        let same = compare(&r, &r, None, 0.0).unwrap();
        assert_eq!((same.mse, same.relmse, same.smape, same.flip), (0.0, 0.0, 0.0, 0.0));
    }

    #[test]
    fn the_worst_pixels_are_dropped_and_only_they() {
        // 2000 pixels, of which 2 (a thousandth) and 20 (a hundredth) may go.
        let r = image(50, vec![Vec3::ONE; 2000]);
        let mut a = r.clone();
        for (i, pixel) in a.pixels.iter_mut().enumerate().take(21) {
            *pixel = Vec3::splat(if i < 2 { 101.0 } else { 2.0 });
        }
        let m = compare(&a, &r, None, 0.0).unwrap();
        let unit = 1.0 / 1.0001;
        for (value, expected) in [
            (m.relmse, (2.0 * 1e4 + 19.0) / 2000.0),
            (m.relmse_trim01, 19.0 / 1998.0),
            (m.relmse_trim1, 1.0 / 1980.0),
        ] {
            assert!((value / (expected * unit) - 1.0).abs() < 1e-6, "{value} {expected}");
        }
        assert_eq!(m.median_nrmse, 0.0);
    }

    #[test]
    fn units_change_no_relative_number() {
        let r = image(4, (0..16).map(|i| Vec3::new(i as f32, 2.0, 0.5)).collect());
        let a = image(4, r.pixels.iter().map(|p| *p * 1.1 + 0.01).collect());
        let scaled = |i: &Image| i.exposed(10.0);
        let (m, s) =
            (compare(&a, &r, None, 0.0).unwrap(), compare(&scaled(&a), &scaled(&r), None, -10.0).unwrap());
        assert!((m.relmse - s.relmse).abs() < 1e-12 && (m.error - s.error).abs() < 1e-12);
        assert!((m.flip - s.flip).abs() < 1e-9);
        assert!((s.mse / m.mse / 2f64.powi(20) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_not_finite_is_counted_and_left_out() {
        let r = image(3, vec![Vec3::ONE; 9]);
        let mut a = r.clone();
        (a.pixels[4], a.pixels[5]) = (Vec3::new(f32::NAN, 1.0, 1.0), Vec3::splat(f32::INFINITY));
        let m = compare(&a, &r, Some((&r, &r)), 0.0).unwrap();
        assert_eq!((m.nonfinite, m.mse, m.deviation.unwrap().tile_z), (2, 0.0, 0.0));
        let none = image(3, vec![Vec3::NAN; 9]);
        assert!(compare(&none, &r, None, 0.0).is_err());
        assert!(compare(&image(2, vec![Vec3::ONE; 2]), &r, None, 0.0).is_err());
    }

    /// 20 x 20 pixels are four tiles; the last has 4 x 4 pixels. Its difference of 0.3 with a variance of 0.02 + 0.02 is
    /// 0.3 * 16 / sqrt(0.04 * 16) = 6 standard deviations.
    #[test]
    fn tiles_deviate_by_what_their_variances_say() {
        let r = image(20, vec![Vec3::ONE; 400]);
        let mut a = r.clone();
        for (x, y) in (16..20).flat_map(|x| (16..20).map(move |y| (x, y))) {
            a.pixels[y * 20 + x].y += 0.3;
        }
        let v = image(20, vec![Vec3::splat(0.02); 400]);
        let d = compare(&a, &r, Some((&v, &v)), 0.0).unwrap().deviation.unwrap();
        assert!((d.tile_z - 6.0).abs() < 1e-5 && d.tile_at == [16, 16], "{d:?}");
        // 12 tests of p = 1.973e-9.
        assert!((d.tile_p / (12.0 * 1.973e-9) - 1.0).abs() < 1e-3, "{d:?}");
        assert_eq!(d.pixels_2sigma, 0.0);
        let small = image(20, vec![Vec3::splat(0.01); 400]);
        let d = compare(&a, &r, Some((&small, &small)), 0.0).unwrap().deviation.unwrap();
        assert!((d.pixels_2sigma - 16.0 / 1200.0).abs() < 1e-12, "{d:?}");
    }

    #[test]
    fn every_name_has_its_number() {
        let r = image(1, vec![Vec3::ONE]);
        let m = compare(&r, &r, Some((&r, &r)), 0.0).unwrap();
        assert!(NAMES.iter().all(|name| m.get(name).is_some()));
        assert_eq!(m.get("psnr"), None);
    }
}
