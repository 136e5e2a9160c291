//! Makes the scenes in `scenes/`. Run `cargo run --example make_scenes` after a change; a test compares the files with
//! what this makes.

mod obj;
mod parts;

mod brushed;
mod caustic;
mod cornell;
mod corridor;
mod furnished;

use std::path::Path;

/// A file below `scenes/` and its contents.
pub type File = (String, String);

/// All files of all scenes.
pub fn files() -> Vec<File> {
    [
        cornell::files(),
        caustic::mirror(),
        caustic::mirror_aniso(),
        caustic::glass(),
        brushed::files(),
        corridor::files(),
        furnished::glossy(),
        furnished::specular(),
    ]
    .concat()
}

/// The three files of a scene.
fn scene(name: &str, obj: obj::Obj, mtl: &str, toml: &str) -> Vec<File> {
    let file = |end: &str, text: String| (format!("{name}/scene.{end}"), text);
    vec![file("obj", obj.into_text()), file("mtl", mtl.to_owned()), file("toml", toml.to_owned())]
}

fn main() -> std::io::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for (name, text) in files() {
        let path = folder.join(name);
        std::fs::create_dir_all(path.parent().unwrap_or(&folder))?;
        std::fs::write(&path, &text)?;
        println!("{} ({} kB)", path.display(), text.len().div_ceil(1000));
    }
    Ok(())
}
