//! (being written)

use crate::error::{Error, Place, Result};
use glam::Vec3;
use std::path::Path;

/// An image in linear Rec. 709 RGB.
#[derive(Debug, Clone)]
pub struct Image {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Row by row, the top row first.
    pub pixels: Vec<Vec3>,
}

/// Reads an image file.
pub fn read(path: &Path) -> Result<Image> {
    Err(Error::scene(Place::file(path), "images cannot be read yet"))
}
