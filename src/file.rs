//! Output files that are either complete or not there: written beside their destination, then renamed.

use crate::error::{Error, Result};
use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// Finds out whether [`replace`] could write the file, without touching what is there.
///
/// # Errors
/// [`Error::Output`] when the path is a directory, its directory is missing, or either may not be written.
pub fn check_writable(path: &Path) -> Result<()> {
    if path.is_dir() {
        return Err(output(path, "is a directory"));
    }
    if path.exists() {
        OpenOptions::new().append(true).open(path).map_err(|e| explain(path, &e))?;
    }
    let (temporary, _) = create_beside(path)?;
    fs::remove_file(temporary).map_err(|e| explain(path, &e))
}

/// Writes a whole file. When this fails, a file that was there before is still there, unharmed.
///
/// # Errors
/// [`Error::Output`] with what the system said.
pub fn replace(path: &Path, contents: &[u8]) -> Result<()> {
    let (temporary, mut file) = create_beside(path)?;
    let destination = follow(path);
    let written = file
        .write_all(contents)
        .and_then(|()| file.sync_all())
        .and_then(|()| match fs::metadata(&destination) {
            Ok(old) => file.set_permissions(old.permissions()),
            Err(_) => Ok(()),
        })
        .and_then(|()| fs::rename(&temporary, &destination));
    written.map_err(|e| {
        // The error that matters is the first one.
        let _ = fs::remove_file(&temporary);
        explain(path, &e)
    })
}

/// A new, empty file in the destination's directory (so that a rename stays within one file system).
fn create_beside(path: &Path) -> Result<(PathBuf, File)> {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let destination = follow(path);
    let name = destination.file_name().ok_or_else(|| output(path, "names no file"))?;
    let mut hidden = OsString::from(".");
    hidden.push(name);
    hidden.push(format!(".{}-{}.tmp", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed)));
    let temporary = destination.with_file_name(hidden);
    let file =
        OpenOptions::new().write(true).create_new(true).open(&temporary).map_err(|e| explain(path, &e))?;
    Ok((temporary, file))
}

/// The file that a symbolic link stands for, so that the link itself survives.
fn follow(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
}

fn output(path: &Path, message: impl Into<String>) -> Error {
    Error::Output { path: path.to_owned(), message: message.into() }
}

fn explain(path: &Path, error: &io::Error) -> Error {
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty());
    match (error.kind(), parent) {
        (ErrorKind::NotFound, Some(parent)) if !parent.exists() => {
            output(path, format!("cannot be written: there is no directory '{}'", parent.display()))
        }
        _ => output(path, format!("cannot be written: {error}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(directory: &Path) -> Vec<String> {
        let mut names: Vec<_> =
            fs::read_dir(directory).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_is_replaced_and_nothing_is_left_beside_it() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.txt");
        check_writable(&path).unwrap();
        assert_eq!(names(directory.path()), [""; 0]);
        replace(&path, b"first").unwrap();
        replace(&path, b"second").unwrap();
        check_writable(&path).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"second");
        assert_eq!(names(directory.path()), ["a.txt"]);
    }

    #[test]
    fn what_cannot_be_written_is_said_with_the_reason() {
        let directory = tempfile::tempdir().unwrap();
        let check = |path: PathBuf| {
            let checked = check_writable(&path).unwrap_err().to_string();
            assert!(replace(&path, b"x").is_err(), "{checked}");
            checked
        };
        assert!(check(directory.path().join("none/a.txt")).contains("no directory"));
        assert!(check(directory.path().to_owned()).contains("is a directory"));
        replace(&directory.path().join("file"), b"").unwrap();
        assert!(check(directory.path().join("file/a.txt")).contains("cannot be written"));
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link() {
        let directory = tempfile::tempdir().unwrap();
        let (file, link) = (directory.path().join("file"), directory.path().join("link"));
        replace(&file, b"old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        replace(&link, b"new").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&file).unwrap(), b"new");
    }
}
