//! LDR-FLIP: how much of a difference a person sees who flips between two images on a display [Andersson et al. 2020,
//! "FLIP: A Difference Evaluator for Alternating Images"]. The steps and constants are the paper's.

use crate::image::Image;
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Pixels per degree of visual angle of the paper's display: 3840 pixels on 0.7 m, seen from 0.7 m.
pub const PIXELS_PER_DEGREE: f64 = 3840.0 * PI / 180.0;

/// Contrast sensitivity as the sum of two Gaussians a sqrt(pi/b) exp(-pi^2 x^2 / b), x in degrees: (a1, b1, a2, b2) of the
/// achromatic, red-green and blue-yellow channel.
const SENSITIVITY: [[f64; 4]; 3] =
    [[1.0, 0.0047, 0.0, 1e-5], [1.0, 0.0053, 0.0, 1e-5], [34.1, 0.04, 13.5, 0.025]];
/// Exponents of colour and feature differences.
const QC: f64 = 0.7;
const QF: f64 = 0.5;
/// The share `PC` of the largest colour difference is mapped to `PT`.
const PC: f64 = 0.4;
const PT: f64 = 0.95;
/// Width of the feature detectors, degrees.
const FEATURE_WIDTH: f64 = 0.082;

/// Linear Rec. 709 RGB to CIE XYZ, by the digits of the standard, as columns.
const XYZ_OF_RGB: DMat3 = DMat3::from_cols(
    DVec3::new(10135552.0 / 24577794.0, 2613072.0 / 12288897.0, 1425312.0 / 73733382.0),
    DVec3::new(8788810.0 / 24577794.0, 8788810.0 / 12288897.0, 8788810.0 / 73733382.0),
    DVec3::new(4435075.0 / 24577794.0, 887015.0 / 12288897.0, 70074185.0 / 73733382.0),
);

/// The error that is seen in every pixel, 0 (none) to 1, row by row. Values outside 0..=1 are clipped first: the images
/// are what a display shows, linear. `pixels_per_degree` is the observer's distance.
///
/// The images must be of one size.
pub fn map(image: &Image, reference: &Image, pixels_per_degree: f64) -> Vec<f64> {
    let size = (image.width as usize, image.height as usize);
    let [a, b] = [image, reference].map(|i| Seen::new(i, size, pixels_per_degree));
    let largest = largest_difference();
    (0..size.0 * size.1)
        .into_par_iter()
        .map(|i| {
            let colour = redistributed(hyab(a.lab[i], b.lab[i]).powf(QC), largest);
            let feature = (a.edges[i] - b.edges[i]).abs().max((a.points[i] - b.points[i]).abs());
            let feature = (feature / 2f64.sqrt()).powf(QF);
            colour.powf(1.0 - feature)
        })
        .collect()
}

/// What is left of an image in the eye.
struct Seen {
    /// Hunt-adjusted L*a*b* of the image blurred by the eye.
    lab: Vec<DVec3>,
    /// Strength of edges and of points.
    edges: Vec<f64>,
    points: Vec<f64>,
}

impl Seen {
    fn new(image: &Image, size: (usize, usize), pixels_per_degree: f64) -> Self {
        let opponent: Vec<DVec3> = image
            .pixels
            .iter()
            .map(|p| opponent_of(XYZ_OF_RGB * p.as_dvec3().clamp(DVec3::ZERO, DVec3::ONE)))
            .collect();
        let rgb_of_xyz = XYZ_OF_RGB.inverse();
        let lab = blurred(&opponent, size, pixels_per_degree)
            .into_par_iter()
            .map(|c| {
                let rgb = (rgb_of_xyz * xyz_of_opponent(c)).clamp(DVec3::ZERO, DVec3::ONE);
                hunt(lab_of(XYZ_OF_RGB * rgb))
            })
            .collect();
        let light: Vec<f64> = opponent.iter().map(|c| (c.x + 16.0) / 116.0).collect();
        let (gauss, edge, point) = feature_kernels(pixels_per_degree);
        let strength = |kernel: &[f64]| -> Vec<f64> {
            let across = columns(&rows(&light, size, kernel), size, &gauss);
            let down = columns(&rows(&light, size, &gauss), size, kernel);
            across.iter().zip(&down).map(|(x, y)| x.hypot(*y)).collect()
        };
        Self { lab, edges: strength(&edge), points: strength(&point) }
    }
}

fn white() -> DVec3 {
    XYZ_OF_RGB * DVec3::ONE
}

/// YyCxCz, in which the eye's blur is linear.
fn opponent_of(xyz: DVec3) -> DVec3 {
    let n = xyz / white();
    DVec3::new(116.0 * n.y - 16.0, 500.0 * (n.x - n.y), 200.0 * (n.y - n.z))
}

fn xyz_of_opponent(c: DVec3) -> DVec3 {
    let y = (c.x + 16.0) / 116.0;
    DVec3::new(y + c.y / 500.0, y, y - c.z / 200.0) * white()
}

/// CIE L*a*b*.
fn lab_of(xyz: DVec3) -> DVec3 {
    const DELTA: f64 = 6.0 / 29.0;
    let f = (xyz / white())
        .map(|t| if t > DELTA.powi(3) { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 });
    DVec3::new(116.0 * f.y - 16.0, 500.0 * (f.x - f.y), 200.0 * (f.y - f.z))
}

/// Colours look paler in the dark.
fn hunt(lab: DVec3) -> DVec3 {
    DVec3::new(lab.x, 0.01 * lab.x * lab.y, 0.01 * lab.x * lab.z)
}

/// A distance that holds for large differences as well.
fn hyab(a: DVec3, b: DVec3) -> f64 {
    let d = a - b;
    d.x.abs() + d.y.hypot(d.z)
}

/// Of pure green and pure blue, the farthest apart.
fn largest_difference() -> f64 {
    let [green, blue] = [DVec3::Y, DVec3::Z].map(|c| hunt(lab_of(XYZ_OF_RGB * c)));
    hyab(green, blue).powf(QC)
}

/// Large differences are squeezed into what is left above `PT`.
fn redistributed(difference: f64, largest: f64) -> f64 {
    let knee = PC * largest;
    if difference < knee {
        PT / knee * difference
    } else {
        PT + (difference - knee) / (largest - knee) * (1.0 - PT)
    }
}

/// Each channel through its contrast sensitivity. Two-dimensional Gaussians are products of one-dimensional ones.
fn blurred(image: &[DVec3], size: (usize, usize), pixels_per_degree: f64) -> Vec<DVec3> {
    let widest = SENSITIVITY.iter().flat_map(|s| [s[1], s[3]]).fold(0.0, f64::max);
    let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as i64;
    let channels: Vec<Vec<f64>> = SENSITIVITY
        .iter()
        .enumerate()
        .map(|(channel, [a1, b1, a2, b2])| {
            let plane: Vec<f64> = image.iter().map(|c| c[channel]).collect();
            let gaussian = |b: f64| -> Vec<f64> {
                (-radius..=radius)
                    .map(|i| (-PI * PI * (i as f64 / pixels_per_degree).powi(2) / b).exp())
                    .collect()
            };
            let parts: Vec<(f64, Vec<f64>)> = [(a1, b1), (a2, b2)]
                .into_iter()
                .filter(|(a, _)| **a > 0.0)
                .map(|(a, b)| (a * (PI / b).sqrt(), gaussian(*b)))
                .collect();
            let total: f64 = parts.iter().map(|(scale, g)| scale * g.iter().sum::<f64>().powi(2)).sum();
            let mut sum = vec![0.0; plane.len()];
            for (scale, g) in &parts {
                let part = columns(&rows(&plane, size, g), size, g);
                sum.iter_mut().zip(part).for_each(|(s, p)| *s += scale / total * p);
            }
            sum
        })
        .collect();
    (0..image.len()).map(|i| DVec3::new(channels[0][i], channels[1][i], channels[2][i])).collect()
}

/// The Gaussian that smooths along a feature, and its first and second derivative across, each of whose halves of one
/// sign sums to 1.
fn feature_kernels(pixels_per_degree: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let sigma = 0.5 * FEATURE_WIDTH * pixels_per_degree;
    let radius = (3.0 * sigma).ceil() as i64;
    let kernel = |factor: &dyn Fn(f64) -> f64| -> Vec<f64> {
        let raw: Vec<f64> = (-radius..=radius)
            .map(|i| (i as f64, (-(i * i) as f64 / (2.0 * sigma * sigma)).exp()))
            .map(|(x, g)| factor(x) * g)
            .collect();
        let positive: f64 = raw.iter().filter(|w| **w > 0.0).sum();
        let negative: f64 = -raw.iter().filter(|w| **w < 0.0).sum::<f64>();
        raw.iter().map(|w| w / if *w > 0.0 { positive } else { negative.max(f64::MIN_POSITIVE) }).collect()
    };
    (kernel(&|_| 1.0), kernel(&|x| -x), kernel(&|x| x * x / (sigma * sigma) - 1.0))
}

/// A filter along rows; pixels beyond the border are those on it.
fn rows(plane: &[f64], (width, _): (usize, usize), kernel: &[f64]) -> Vec<f64> {
    let radius = kernel.len() / 2;
    let mut out = vec![0.0; plane.len()];
    out.par_chunks_mut(width).zip(plane.par_chunks(width)).for_each(|(out, row)| {
        for (x, value) in out.iter_mut().enumerate() {
            let at = |k: usize| row[(x + k).saturating_sub(radius).min(width - 1)];
            *value = kernel.iter().enumerate().map(|(k, w)| w * at(k)).sum();
        }
    });
    out
}

/// The same along columns.
fn columns(plane: &[f64], (width, height): (usize, usize), kernel: &[f64]) -> Vec<f64> {
    let radius = kernel.len() / 2;
    let mut out = vec![0.0; plane.len()];
    out.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        for (k, w) in kernel.iter().enumerate() {
            let source = (y + k).saturating_sub(radius).min(height - 1) * width;
            out.iter_mut().zip(&plane[source..source + width]).for_each(|(o, p)| *o += w * p);
        }
    });
    out
}
