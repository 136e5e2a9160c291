//! A scene, from its files or from memory.
//!
//! A file is either a TOML scene, which names OBJ files, or a bare OBJ file. Whatever is wrong with one is an error
//! with its file and line; whatever has to be bent to make sense is a warning with the same.

use crate::camera::CameraSettings;
use crate::error::{Error, Place, Result};
use crate::film::FilmSettings;
use crate::geometry::Mesh;
use crate::light::LightSource;
use crate::material::Material;
use crate::math::Spectrum;
use crate::settings::Settings;
use document::Table;
use inputs::Inputs;
use notes::Notes;
use obj::Gathering;
use settings_file::SettingsFile;
use std::path::{Path, PathBuf};

mod camera_keys;
mod document;
mod inputs;
mod light_keys;
mod material_keys;
mod mtl;
mod mtl_rules;
mod notes;
mod obj;
mod obj_scan;
mod polygon;
mod settings_file;
mod textures;

/// Everything that is rendered.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The file it came from; empty when made in memory.
    pub path: PathBuf,
    /// All triangles.
    pub mesh: Mesh,
    /// The materials that [`Mesh::materials`] indexes.
    pub materials: Vec<Material>,
    /// Lights beside emitting materials.
    pub lights: Vec<LightSource>,
    /// The camera.
    pub camera: CameraSettings,
    /// The image.
    pub film: FilmSettings,
    /// How to render it, unless told otherwise.
    pub settings: Settings,
    /// What the loader wants the user to know, one sentence each.
    pub warnings: Vec<String>,
    /// Fingerprint of the contents of all files and of the overrides (XXH3-64), the same on every machine; 0 when made
    /// in memory.
    pub hash: u64,
}

impl Scene {
    /// Reads a scene from a `.toml` or `.obj` file.
    ///
    /// `overrides` are dotted keys of the TOML file and their values, such as `("camera.fov_y", "30")` or
    /// `("material.mirror.alpha", "[1e-3, 1e-3]")`; they win over the file. A bare OBJ file gets a camera that sees all
    /// of it, and its light from the materials' `Ke`, or else from a uniform white sky.
    ///
    /// Errors: [`Error::Scene`] with file and line for what cannot be read, [`Error::Usage`] for overrides,
    /// [`Error::Unsupported`] for what is understood but missing from hrr. Remarks go to [`Scene::warnings`].
    pub fn load(path: &Path, overrides: &[(String, String)]) -> Result<Self> {
        let mut inputs = Inputs::new();
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        let (mut document, bare) = match extension.as_str() {
            "toml" => {
                let bytes = inputs.read(path).map_err(|e| unreadable(path, &e))?;
                let text = String::from_utf8(bytes)
                    .map_err(|_| Error::scene(Place::file(path), "is not text (UTF-8)"))?;
                (Table::parse(path, &text)?, false)
            }
            "obj" => (Table::default(), true),
            _ => return Err(Error::scene(Place::file(path), "is neither a .toml scene nor an .obj file")),
        };
        for (key, value) in overrides {
            inputs.add(key.as_bytes());
            inputs.add(value.as_bytes());
            document.merge(Table::parse_flag(key, value)?);
        }
        let file = SettingsFile::read(&document)?;
        let mut notes = Notes::default();
        let mut gathering = Gathering::default();
        if bare {
            gathering.add(path, &mut inputs, &mut notes)?;
        }
        if !bare && file.objs.is_empty() {
            return Err(Error::scene(Place::file(path), "no geometry: obj = [\"scene.obj\"] is missing"));
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        for (name, at) in &file.objs {
            let obj = folder.join(name);
            if !obj.is_file() {
                return Err(at.error(format!("there is no file '{}'", obj.display())));
            }
            gathering.add(&obj, &mut inputs, &mut notes)?;
        }
        let (mesh, mut materials) = gathering.finish(&mut notes);
        if mesh.triangles.is_empty() {
            return Err(Error::scene(Place::file(path), "the scene has no triangles"));
        }
        for keys in &file.materials {
            keys.apply(&mut materials)?;
        }
        let mut lights =
            file.lights.iter().map(|keys| keys.load(folder, &mut inputs)).collect::<Result<Vec<_>>>()?;
        if lights.is_empty() && !mesh.materials.iter().any(|&m| materials[m as usize].emits()) {
            if bare {
                let message = "nothing emits light (no material has a Ke): it is lit by a uniform white sky";
                notes.add("sky", &Place::file(path), message);
                lights.push(LightSource::Environment { color: Spectrum::ONE, image: None });
            } else {
                notes.add("dark", &Place::file(path), "nothing emits light: the image will be black");
            }
        }
        let aspect = f64::from(file.film.width) / f64::from(file.film.height);
        let camera = file.camera.settings(&mesh, aspect)?;
        Ok(Self {
            path: path.to_owned(),
            mesh,
            materials,
            lights,
            camera,
            film: file.film,
            settings: file.settings,
            warnings: notes.into_warnings(),
            hash: inputs.hash(),
        })
    }
}

fn unreadable(path: &Path, e: &std::io::Error) -> Error {
    Error::scene(Place::file(path), format!("cannot be read: {e}"))
}
