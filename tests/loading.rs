//! Scenes from files: every way in which a file can be wrong is an error or a warning with its file and line, and
//! what is right arrives as it was meant.

use hrr::scene::Scene;
use hrr::{Error, Result};
use std::path::PathBuf;
use tempfile::TempDir;

mod mtl;
mod obj;
mod project;
mod settings_file;

/// A triangle in the plane z = 0, its front towards +z.
const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
const LAMP: &str = "newmtl lamp\nKe 1 1 1\n";

/// Files in a folder of their own.
struct Files(TempDir);

impl Files {
    fn new(files: &[(&str, &str)]) -> Self {
        let folder = Self(TempDir::new().unwrap());
        for (name, text) in files {
            folder.write(name, text.as_bytes());
        }
        folder
    }

    fn write(&self, name: &str, bytes: &[u8]) {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Loads one of them with `-D` flags.
    fn load(&self, name: &str, flags: &[(&str, &str)]) -> Result<Scene> {
        let flags: Vec<_> = flags.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
        Scene::load(&self.path(name), &flags)
    }

    /// An error's text without the folder's name.
    fn message(&self, e: &Error) -> String {
        e.to_string().replace(&format!("{}/", self.0.path().display()), "")
    }

    fn warnings(&self, scene: &Scene) -> Vec<String> {
        scene.warnings.iter().map(|w| w.replace(&format!("{}/", self.0.path().display()), "")).collect()
    }
}

/// A scene of faces (after `TRIANGLE`) that use the materials of an MTL text; a lamp comes with it.
fn with_mtl(mtl: &str, faces: &str) -> (Files, Result<Scene>) {
    let obj = format!("mtllib s.mtl lamp.mtl\n{TRIANGLE}usemtl lamp\nf 1 2 3\n{faces}");
    let files = Files::new(&[("s.obj", &obj), ("s.mtl", mtl), ("lamp.mtl", LAMP)]);
    let scene = files.load("s.obj", &[]);
    (files, scene)
}

/// A TOML scene around a triangle that emits.
fn toml_scene(toml: &str) -> Files {
    let obj = format!("mtllib s.mtl\n{TRIANGLE}usemtl lamp\nf 1 2 3\n");
    Files::new(&[("s.toml", toml), ("s.obj", &obj), ("s.mtl", LAMP)])
}

fn toml_error(toml: &str) -> (String, u8) {
    let files = toml_scene(toml);
    let e = files.load("s.toml", &[]).unwrap_err();
    (files.message(&e), e.exit_code())
}

const OBJ_LINE: &str = "obj = [\"s.obj\"]\n";
