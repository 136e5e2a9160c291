//! The program, run in a directory with a small scene.

use std::ffi::OsStr;
use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;

/// A lamp above a floor, 12 x 8 pixels, `pt`.
pub const SCENE: &str = r#"
obj = ["box.obj"]
[camera]
origin = [0, 0, 3]
target = [0, 0, 0]
fov_y = 40.0
[film]
width = 12
height = 8
[render]
integrator = "pt"
visibility = "obvhs"
max_depth = 3
iterations = 2
"#;

/// A lamp above a floor.
const OBJ: &str = "\
mtllib box.mtl
v -1 -0.5 -1
v 1 -0.5 -1
v 1 -0.5 1
v -1 -0.5 1
v -0.3 0.9 -0.3
v 0.3 0.9 -0.3
v 0.3 0.9 0.3
v -0.3 0.9 0.3
usemtl floor
f 4 3 2 1
usemtl lamp
f 5 6 7 8
";
const MTL: &str = "newmtl floor\nKd 0.6 0.6 0.6\nnewmtl lamp\nKd 0 0 0\nKe 5 5 5\n";

/// A directory with a small scene in it.
pub struct Place(TempDir);

impl Place {
    pub fn new() -> Self {
        let directory = tempfile::tempdir().unwrap();
        for (name, text) in [("scene.toml", SCENE), ("box.obj", OBJ), ("box.mtl", MTL)] {
            fs::write(directory.path().join(name), text).unwrap();
        }
        Self(directory)
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn command<S: AsRef<OsStr>>(&self, args: impl IntoIterator<Item = S>) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_hrr"));
        command.current_dir(self.0.path()).args(args).stdin(Stdio::null());
        command.env_remove("NO_COLOR").env_remove("CLICOLOR_FORCE").env_remove("RUST_BACKTRACE");
        command
    }

    /// Runs `hrr` with the words of a line; returns exit code, stdout and stderr.
    pub fn run(&self, line: &str) -> (i32, String, String) {
        finish(self.command(line.split_whitespace()).output().unwrap())
    }

    pub fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.path()).unwrap();
        let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

/// Exit code, stdout and stderr.
pub fn finish(output: Output) -> (i32, String, String) {
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap_or(-1), text(output.stdout), text(output.stderr))
}
