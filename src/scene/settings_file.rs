//! The TOML file of a scene: `obj`, `[camera]`, `[film]`, `[render]`, `[material.NAME]` and `[[light]]`.

use super::camera_keys::CameraKeys;
use super::document::{At, Node, Table};
use super::light_keys::{self, LightKeys};
use super::material_keys::MaterialKeys;
use crate::error::Result;
use crate::film::{FilmSettings, Filter};
use crate::settings::{SettingError, Settings};

/// Pixels across or down.
const MAX_PIXELS: u32 = 65536;

/// What the file says, checked as far as that goes without the geometry.
#[derive(Debug)]
pub(super) struct SettingsFile {
    /// OBJ files as written.
    pub(super) objs: Vec<(String, At)>,
    /// The camera.
    pub(super) camera: CameraKeys,
    /// The image.
    pub(super) film: FilmSettings,
    /// The render.
    pub(super) settings: Settings,
    /// Materials that take the place of the MTL's.
    pub(super) materials: Vec<MaterialKeys>,
    /// Lights beside emitting materials.
    pub(super) lights: Vec<LightKeys>,
}

impl SettingsFile {
    /// Reads a document's keys.
    pub(super) fn read(document: &Table) -> Result<Self> {
        document.only("the scene", &["obj", "camera", "film", "render", "material", "light"])?;
        let empty = Table::default();
        let section =
            |name: &str| document.get(name).map_or(Ok(&empty), |node| node.table(&format!("[{name}]")));
        let materials =
            section("material")?.entries().iter().map(MaterialKeys::read).collect::<Result<_>>()?;
        Ok(Self {
            objs: document.get("obj").map_or(Ok(Vec::new()), objs)?,
            camera: CameraKeys::read(section("camera")?)?,
            film: film(section("film")?)?,
            settings: settings(section("render")?)?,
            materials,
            lights: document.get("light").map_or(Ok(Vec::new()), light_keys::read)?,
        })
    }
}

fn objs(node: &Node) -> Result<Vec<(String, At)>> {
    if let Ok(one) = node.string("obj") {
        return Ok(vec![(one.to_owned(), node.at.clone())]);
    }
    node.array("obj")?.iter().map(|n| Ok((n.string("obj")?.to_owned(), n.at.clone()))).collect()
}

fn film(table: &Table) -> Result<FilmSettings> {
    table.only("[film]", &["width", "height", "filter"])?;
    let mut film = FilmSettings::default();
    for (key, side) in [("width", &mut film.width), ("height", &mut film.height)] {
        if let Some(node) = table.get(key) {
            *side = node.integer(&format!("film.{key}"), 1..=MAX_PIXELS)?;
        }
    }
    if let Some(node) = table.get("filter") {
        film.filter = match node.string("film.filter")? {
            "box" => Filter::Box,
            "gaussian" => Filter::Gaussian,
            other => {
                return Err(node.at.error(format!("film.filter is \"{other}\"; it must be box or gaussian")));
            }
        }
    }
    Ok(film)
}

fn settings(table: &Table) -> Result<Settings> {
    let mut settings = Settings::default();
    for entry in table.entries() {
        let Some(value) = entry.node.plain() else {
            return Err(entry.node.at.error(format!("render.{} takes a single value", entry.key)));
        };
        settings.set(&entry.key, &value).map_err(|e| match e {
            SettingError::Invalid(message) => entry.at.error(message),
            SettingError::NotYet(message) => entry.at.unsupported(message),
        })?;
    }
    Ok(settings)
}
