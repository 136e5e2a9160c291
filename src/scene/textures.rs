//! The textures of a scene, each file read once.

use super::inputs::Inputs;
use super::mtl::MapReference;
use crate::error::{Error, Place, Result};
use crate::image::{self, Image};
use crate::texture::Texture;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Image files by path.
pub(super) struct Textures<'a> {
    inputs: &'a mut Inputs,
    images: HashMap<PathBuf, Arc<Image>>,
}

impl<'a> Textures<'a> {
    pub(super) fn new(inputs: &'a mut Inputs) -> Self {
        Self { inputs, images: HashMap::new() }
    }

    /// The texture of a map key, whose file is named relative to the library's; `place` is where the key stands.
    pub(super) fn load(&mut self, library: &Path, map: &MapReference, place: &Place) -> Result<Texture> {
        let path = library.parent().unwrap_or(Path::new("")).join(&map.file);
        if let Some(image) = self.images.get(&path) {
            return Ok(Texture::new(image.clone(), map.scale, map.offset));
        }
        let fail = |why: String| Error::scene(place.clone(), format!("texture '{}': {why}", map.file));
        self.inputs.read(&path).map_err(|e| fail(e.to_string()))?;
        let image = image::read(&path).map_err(|e| match e {
            Error::Scene { message, .. } => fail(message),
            other => fail(other.to_string()),
        })?;
        if image.width == 0 || image.height == 0 {
            return Err(fail("the image has no pixels".into()));
        }
        let image = Arc::new(image);
        self.images.insert(path, image.clone());
        Ok(Texture::new(image, map.scale, map.offset))
    }
}
