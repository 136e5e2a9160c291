//! Writes the places of shared libraries that are not in the loader's default ones into programs, tests and the C
//! library, so that they run without `LD_LIBRARY_PATH`.

use std::path::PathBuf;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_FAMILY").as_deref() != Ok("unix") {
        return;
    }
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("linux") {
        // The C library exports its own functions only, not those of the libraries in it.
        println!("cargo::rustc-cdylib-link-arg=-Wl,--exclude-libs,ALL");
    }
    let mut directories: Vec<PathBuf> =
        std::env::var_os("DEP_EMBREE4_LIBDIR").map(PathBuf::from).into_iter().collect();
    #[cfg(feature = "oiio")]
    directories.extend(openimageio());
    directories.sort();
    directories.dedup();
    for directory in directories {
        println!("cargo::rustc-link-arg=-Wl,-rpath,{}", directory.display());
    }
}

/// Where oiio-sys found OpenImageIO: its variables first, then pkg-config (which leaves out default places).
#[cfg(feature = "oiio")]
fn openimageio() -> Vec<PathBuf> {
    for name in ["OIIO_ROOT", "OIIO_LIBRARY_DIR"] {
        println!("cargo::rerun-if-env-changed={name}");
    }
    let directory = std::env::var_os("OIIO_LIBRARY_DIR")
        .map(PathBuf::from)
        .or_else(|| std::env::var_os("OIIO_ROOT").map(|root| PathBuf::from(root).join("lib")));
    match directory {
        Some(directory) => vec![directory.canonicalize().unwrap_or(directory)],
        // Whether it is there at all is oiio-sys's to say.
        None => pkg_config::Config::new()
            .cargo_metadata(false)
            .probe("OpenImageIO")
            .map_or(Vec::new(), |library| library.link_paths),
    }
}
