//! The textures of a scene, each file read once.

use super::inputs::Inputs;
use super::mtl::MapReference;
use crate::error::{Error, Place, Result};
use crate::image::{self, Image};
use crate::texture::Texture;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What an image's numbers are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Content {
    /// Colours, which files of whole numbers hold as sRGB.
    Colors,
    /// Numbers as they are.
    Data,
}

/// Image files by path and content.
pub(super) struct Textures<'a> {
    inputs: &'a mut Inputs,
    images: HashMap<(PathBuf, Content), Arc<Image>>,
}

impl<'a> Textures<'a> {
    pub(super) fn new(inputs: &'a mut Inputs) -> Self {
        Self { inputs, images: HashMap::new() }
    }

    /// The texture of a map key, whose file is named relative to the library's; `place` is where the key stands.
    pub(super) fn load(
        &mut self,
        library: &Path,
        map: &MapReference,
        content: Content,
        place: &Place,
    ) -> Result<Texture> {
        let path = library.parent().unwrap_or(Path::new("")).join(&map.file);
        if let Some(image) = self.images.get(&(path.clone(), content)) {
            return Ok(Texture::new(image.clone(), map.scale, map.offset));
        }
        let fail = |why: String| Error::scene(place.clone(), format!("texture '{}': {why}", map.file));
        self.inputs.read(&path).map_err(|e| fail(e.to_string()))?;
        let read = match content {
            Content::Colors => image::read,
            Content::Data => image::read_data,
        };
        let image = read(&path).map_err(|e| match e {
            Error::Scene { message, .. } => fail(message),
            other => fail(other.to_string()),
        })?;
        if image.width == 0 || image.height == 0 {
            return Err(fail("the image has no pixels".into()));
        }
        if let Some(i) = image.pixels.iter().position(|p| !p.is_finite()) {
            return Err(fail(format!("pixel {i} is {}; it must be finite", image.pixels[i])));
        }
        let image = Arc::new(image);
        self.images.insert((path, content), image.clone());
        Ok(Texture::new(image, map.scale, map.offset))
    }
}
