//! Images and their files: OpenEXR (32-bit float) and PNG (8 bits, sRGB), through OpenImageIO or, without the feature
//! `oiio`, in Rust alone. OpenImageIO also reads the other formats that it knows (JPEG, TIFF, Radiance HDR, ...).

pub mod attributes;
#[cfg(feature = "oiio")]
pub mod oiio;
pub mod pure;
pub mod tone;

pub use attributes::{Attributes, Value};

use crate::error::{Error, Place, Result};
use crate::file;
use glam::Vec3;
use std::path::Path;

#[cfg(feature = "oiio")]
use self::oiio as backend;
#[cfg(not(feature = "oiio"))]
use self::pure as backend;

/// Linear RGB, row by row, the top row first.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// `width * height` pixels.
    pub pixels: Vec<Vec3>,
}

/// A kind of file that can be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// OpenEXR: linear 32-bit floats and attributes.
    Exr,
    /// PNG: 8 bits, sRGB, no attributes.
    Png,
}

/// What a file holds, before its values are made linear.
#[derive(Debug, Clone)]
pub struct Decoded {
    /// The values as they stand in the file; whole numbers scaled to 0..=1.
    pub image: Image,
    /// Whether these are display (sRGB) values if they are colours: so it is where pixels are whole numbers.
    pub display: bool,
    /// Texts and numbers about the image, by name.
    pub attributes: Attributes,
}

/// More pixels than this on a side are taken for a broken file.
const LARGEST_SIDE: u32 = 1 << 20;
/// More pixels than this are taken for a broken file.
const MOST_PIXELS: u64 = 1 << 31;

impl Format {
    /// The format of a file's extension.
    ///
    /// # Errors
    /// [`Error::Output`] for any but `.exr` and `.png`.
    pub fn of(path: &Path) -> Result<Self> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("exr") => Ok(Self::Exr),
            Some("png") => Ok(Self::Png),
            Some(other) => Err(output(path, format!("cannot write images as '.{other}'; use .exr or .png"))),
            None => Err(output(path, "has no extension to tell its format; use .exr or .png")),
        }
    }
}

impl Image {
    /// A copy that is `stops` brighter: every value times 2^`stops`.
    pub fn exposed(&self, stops: f32) -> Self {
        let scale = stops.exp2();
        Self { pixels: self.pixels.iter().map(|p| *p * scale).collect(), ..*self }
    }

    /// Checks that there are pixels, and as many as `width` and `height` say.
    fn check(&self) -> Result<()> {
        let wanted = u64::from(self.width) * u64::from(self.height);
        if wanted == 0 || self.pixels.len() as u64 != wanted {
            return Err(Error::Input(format!(
                "an image of {}x{} pixels cannot have {} of them",
                self.width,
                self.height,
                self.pixels.len()
            )));
        }
        Ok(())
    }
}

/// Reads colours: linear, whatever the file holds (8- and 16-bit files are taken for sRGB). Grey is spread over the
/// three channels; alpha is left out.
///
/// # Errors
/// [`Error::Scene`] when the file is missing, broken, or of a kind that this build cannot read.
pub fn read(path: &Path) -> Result<Image> {
    let Decoded { mut image, display, .. } = decode(path)?;
    if display {
        for pixel in &mut image.pixels {
            *pixel = pixel.map(tone::decode);
        }
    }
    Ok(image)
}

/// Reads numbers, such as roughness or normals: values as they stand in the file (8- and 16-bit ones scaled to 0..=1).
///
/// # Errors
/// As [`read`].
pub fn read_data(path: &Path) -> Result<Image> {
    decode(path).map(|d| d.image)
}

/// Reads what an image file says about itself.
///
/// # Errors
/// As [`read`].
pub fn read_attributes(path: &Path) -> Result<Attributes> {
    decode(path).map(|d| d.attributes)
}

/// Writes an image; the extension says how. The attributes go into EXR files only. The file appears complete or not
/// at all.
///
/// # Errors
/// [`Error::Output`] when the file cannot be written or its extension is unknown, [`Error::Input`] for an image
/// without pixels.
pub fn write(path: &Path, image: &Image, attributes: &Attributes) -> Result<()> {
    image.check()?;
    let bytes = match Format::of(path)? {
        Format::Exr => backend::encode_exr(image, attributes),
        Format::Png => backend::encode_png(image),
    };
    file::replace(path, &bytes.map_err(|message| output(path, message))?)
}

/// Finds out, before hours of rendering, whether [`write()`] could write the file.
///
/// # Errors
/// [`Error::Output`] with the reason.
pub fn check_writable(path: &Path) -> Result<()> {
    Format::of(path)?;
    file::check_writable(path)
}

fn decode(path: &Path) -> Result<Decoded> {
    let fault = |message: String| Error::scene(Place::file(path), message);
    // Asked first, so that a missing file reads the same whatever the backend.
    std::fs::File::open(path).map_err(|e| fault(format!("cannot read the image: {e}")))?;
    backend::decode(path).map_err(|message| fault(format!("cannot read the image: {message}")))
}

fn output(path: &Path, message: impl Into<String>) -> Error {
    Error::Output { path: path.to_owned(), message: message.into() }
}

/// Refuses sizes that no real image has, before memory is asked for.
fn check_size(width: u64, height: u64) -> std::result::Result<(), String> {
    let side = u64::from(LARGEST_SIDE);
    if width == 0 || height == 0 || width > side || height > side || width * height > MOST_PIXELS {
        return Err(format!("a size of {width}x{height} pixels makes no sense"));
    }
    Ok(())
}

/// Which channels are red, green and blue: by name, or the first one for all three where there is no colour.
fn rgb_channels<'a>(names: impl Iterator<Item = &'a str>) -> std::result::Result<[usize; 3], String> {
    let names: Vec<_> = names.collect();
    let find = |name: &str| names.iter().position(|n| n.eq_ignore_ascii_case(name));
    match (find("R"), find("G"), find("B")) {
        (Some(r), Some(g), Some(b)) => Ok([r, g, b]),
        _ => match find("Y").or((!names.is_empty() && names.len() <= 2).then_some(0)) {
            Some(grey) => Ok([grey; 3]),
            None => Err(format!("there are no channels R, G, B, only {}", names.join(", "))),
        },
    }
}

/// Colours from interleaved channels.
fn gather(values: &[f32], channels: usize, [r, g, b]: [usize; 3]) -> Vec<Vec3> {
    values.chunks_exact(channels).map(|c| Vec3::new(c[r], c[g], c[b])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_go_by_extension_in_any_case() {
        assert_eq!(Format::of(Path::new("a/b.EXR")).unwrap(), Format::Exr);
        assert_eq!(Format::of(Path::new("b.png")).unwrap(), Format::Png);
        for name in ["b.jpg", "b", ".exr", "exr"] {
            assert_eq!(Format::of(Path::new(name)).unwrap_err().exit_code(), 4, "{name}");
        }
    }

    #[test]
    fn colours_are_found_by_name_in_any_order() {
        assert_eq!(rgb_channels(["A", "B", "G", "R"].into_iter()), Ok([3, 2, 1]));
        assert_eq!(rgb_channels(["A", "Y"].into_iter()), Ok([1; 3]));
        assert_eq!(rgb_channels(["depth"].into_iter()), Ok([0; 3]));
        assert!(rgb_channels(["x", "y2", "z"].into_iter()).unwrap_err().contains("only x, y2, z"));
        assert!(rgb_channels([].into_iter()).is_err());
    }

    #[test]
    fn an_image_without_its_pixels_is_refused() {
        for (width, height, pixels) in [(0, 0, 0), (0, 3, 0), (2, 2, 3), (1, 1, 2)] {
            let image = Image { width, height, pixels: vec![Vec3::ONE; pixels] };
            let error = write(Path::new("never.exr"), &image, &Attributes::new()).unwrap_err();
            assert!(matches!(error, Error::Input(_)), "{error}");
        }
    }
}
