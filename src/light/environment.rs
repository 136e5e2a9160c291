//! Light from far away on all sides: one colour, or an image of the sky.

use super::distant::DistantPoint;
use crate::image::Image;
use crate::math::{Discrete, Spectrum, luminance};
use crate::texture::Texture;
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// Most cells of the distribution across and down: larger skies share them between pixels.
const MOST_CELLS: [usize; 2] = [1024, 512];

/// Radiance by direction, and a distribution of directions in proportion to it.
///
/// The image is a map of longitude and latitude: its middle lies in the direction -z, its top is +y, and what is to the
/// right of the middle lies towards +x.
#[derive(Debug, Clone)]
pub struct Environment {
    color: Spectrum,
    image: Option<Texture>,
    cells: Discrete,
    across: usize,
    down: usize,
}

impl Environment {
    /// Radiance `color`, W/(m^2 sr), times that of `image`, where there is one; it must have pixels. `None` when
    /// nothing in it gives light.
    pub fn new(color: Spectrum, image: Option<Arc<Image>>) -> Option<Self> {
        let [across, down] = image.as_ref().map_or([1, 1], |image| {
            [(image.width as usize).min(MOST_CELLS[0]), (image.height as usize).min(MOST_CELLS[1])]
        });
        let weight = |cell: usize| {
            let (x, y) = (cell % across, cell / across);
            let mean = image.as_ref().map_or(1.0, |image| brightness(image, [x, y], [across, down]));
            mean * solid_angle(y, across, down)
        };
        let scale = luminance(color);
        let cells = Discrete::new((0..across * down).map(weight)).filter(|_| scale > 0.0)?;
        let image = image.map(|image| Texture::new(image, DVec2::ONE, DVec2::ZERO));
        Some(Self { color, image, cells, across, down })
    }

    /// Radiance that arrives from a unit direction, W/(m^2 sr).
    pub fn radiance(&self, direction: DVec3) -> Spectrum {
        match &self.image {
            None => self.color,
            Some(image) => self.color * image.lookup_clamped(square_of(direction)).max(Spectrum::ZERO),
        }
    }

    /// About how much radiance arrives from all sides: the integral of its luminance over the sphere, W/m^2.
    pub fn total(&self) -> f64 {
        luminance(self.color) * self.cells.total()
    }

    /// Density of [`Environment::sample`], 1/sr.
    pub fn pdf(&self, direction: DVec3) -> f64 {
        let s = square_of(direction);
        let index = |x: f64, cells: usize| ((x * cells as f64) as usize).min(cells - 1);
        let (x, y) = (index(s.x, self.across), index(1.0 - s.y, self.down));
        self.cells.probability(y * self.across + x) / solid_angle(y, self.across, self.down)
    }

    /// A direction towards the sky; `u` is uniform in the unit square.
    pub fn sample(&self, u: DVec2) -> DVec3 {
        let (cell, rest) = self.cells.sample_and_rest(u.x);
        let (x, y) = ((cell % self.across) as f64, cell / self.across);
        let [top, bottom] = [y, y + 1].map(|row| height(row, self.down));
        let z = top + (bottom - top) * u.y;
        let phi = TAU * ((x + rest) / self.across as f64 - 0.5);
        let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
        DVec3::new(r * phi.sin(), z, -r * phi.cos())
    }

    /// What a path that leaves the scene in a unit direction finds.
    pub(super) fn at(&self, direction: DVec3, share: f64, number: u32) -> DistantPoint {
        let (radiance, pdf) = (self.radiance(direction), share * self.pdf(direction));
        DistantPoint { direction: -direction, radiance, pdf, delta: false, number }
    }
}

/// Texture coordinates of a unit direction: (0, 0) is the lower left corner.
fn square_of(direction: DVec3) -> DVec2 {
    let longitude = direction.x.atan2(-direction.z) / TAU + 0.5;
    DVec2::new(longitude, 1.0 - direction.y.clamp(-1.0, 1.0).acos() / PI)
}

/// The y coordinate of directions on the upper border of a row of cells.
fn height(row: usize, down: usize) -> f64 {
    (PI * row as f64 / down as f64).cos()
}

/// Solid angle of a cell, sr.
fn solid_angle(row: usize, across: usize, down: usize) -> f64 {
    (height(row, down) - height(row + 1, down)) * TAU / across as f64
}

/// Mean luminance of a cell, as interpolation between pixels makes it: an eighth of what is next to it leaks in. Never 0
/// where the cell gives light.
fn brightness(image: &Image, [x, y]: [usize; 2], [across, down]: [usize; 2]) -> f64 {
    let (width, height) = (image.width as usize, image.height as usize);
    let mut sum = 0.0;
    for (row, down_weight) in pixels_of(y, down, height) {
        let row = row.clamp(1, height) - 1;
        for (column, across_weight) in pixels_of(x, across, width) {
            let pixel = image.pixels[row * width + (column + width - 1) % width].as_dvec3();
            sum += across_weight * down_weight * luminance(pixel.max(DVec3::ZERO));
        }
    }
    sum
}

/// The pixels of a cell and their neighbours along one axis, numbered from 1, each with its share of the cell.
fn pixels_of(cell: usize, cells: usize, pixels: usize) -> impl Iterator<Item = (usize, f64)> {
    let (first, end) = (cell * pixels / cells, (cell + 1) * pixels / cells);
    let count = (end - first) as f64;
    (first..=end + 1).map(move |i| {
        let leak = |at_border: bool| if at_border { 0.125 } else { 0.0 };
        let share =
            if i == first || i == end + 1 { 0.125 } else { 1.0 - leak(i == first + 1) - leak(i == end) };
        (i, share / count)
    })
}
