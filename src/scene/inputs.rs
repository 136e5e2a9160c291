//! The files that a scene is made from.

use std::path::Path;
use xxhash_rust::xxh3::Xxh3;

/// Reads files and takes the fingerprint of all that was read.
pub(super) struct Inputs(Xxh3);

impl Inputs {
    pub(super) fn new() -> Self {
        Self(Xxh3::new())
    }

    /// The bytes of a file.
    pub(super) fn read(&mut self, path: &Path) -> std::io::Result<Vec<u8>> {
        let bytes = std::fs::read(path)?;
        self.add(&bytes);
        Ok(bytes)
    }

    /// The text of a file. OBJ and MTL files in the wild hold names in any encoding; what is not UTF-8 becomes
    /// replacement characters, and stays the same name wherever it is used. A byte order mark is taken off.
    pub(super) fn read_text(&mut self, path: &Path) -> std::io::Result<String> {
        let bytes = self.read(path)?;
        let text = String::from_utf8(bytes);
        let text = text.unwrap_or_else(|e| String::from_utf8_lossy(e.as_bytes()).into_owned());
        Ok(match text.strip_prefix('\u{feff}') {
            Some(rest) => rest.to_owned(),
            None => text,
        })
    }

    /// Adds something that is not a file. Lengths keep neighbours apart.
    pub(super) fn add(&mut self, bytes: &[u8]) {
        self.0.update(&(bytes.len() as u64).to_le_bytes());
        self.0.update(bytes);
    }

    /// The fingerprint: XXH3-64, the same on every machine.
    pub(super) fn hash(&self) -> u64 {
        self.0.digest()
    }
}
