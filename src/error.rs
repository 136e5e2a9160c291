//! The one error type of the library, and the exit code each kind maps to.

use std::fmt;
use std::path::{Path, PathBuf};

/// Where in a text file something was found: `file`, `file:line` or `file:line:column`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The file as the user named it.
    pub file: PathBuf,
    /// 1-based line, when known.
    pub line: Option<usize>,
}

impl Place {
    /// A place that is a whole file.
    pub fn file(file: impl AsRef<Path>) -> Self {
        Self { file: file.as_ref().to_owned(), line: None }
    }

    /// A line (1-based) of a file.
    pub fn line(file: impl AsRef<Path>, line: usize) -> Self {
        Self { file: file.as_ref().to_owned(), line: Some(line) }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        self.line.map_or(Ok(()), |line| write!(f, ":{line}"))
    }
}

/// Everything that can go wrong, each with what and where.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A flag or setting has a name or value that is not understood.
    #[error("{0}")]
    Usage(String),
    /// A scene, material or image file is missing, broken or asks for the impossible.
    #[error("{place}: {message}")]
    Scene {
        /// File and line.
        place: Place,
        /// What is wrong with it.
        message: String,
    },
    /// Geometry or parameters handed over in memory are unusable.
    #[error("{0}")]
    Input(String),
    /// An image, statistics or report file cannot be written.
    #[error("{}: {message}", path.display())]
    Output {
        /// The file that was to be written.
        path: PathBuf,
        /// What the writer said.
        message: String,
    },
    /// The scene asks for an effect that hrr does not have (yet).
    #[error("{place}: not supported: {message}")]
    Unsupported {
        /// Where the scene asks for it.
        place: Place,
        /// The effect.
        message: String,
    },
    /// The work would not fit in the memory it was given.
    #[error("out of memory: {0}")]
    Memory(String),
    /// A library below (Embree, thread pool) failed.
    #[error("internal error: {0}")]
    Internal(String),
}

impl Error {
    /// A [`Error::Scene`] at a place.
    pub fn scene(place: Place, message: impl Into<String>) -> Self {
        Self::Scene { place, message: message.into() }
    }

    /// The program's exit code for this error.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Usage(_) => 2,
            Self::Scene { .. } | Self::Input(_) => 3,
            Self::Output { .. } => 4,
            Self::Unsupported { .. } => 5,
            Self::Memory(_) => 6,
            Self::Internal(_) => 70,
        }
    }
}

/// `std::result::Result` with [`enum@Error`].
pub type Result<T> = std::result::Result<T, Error>;
