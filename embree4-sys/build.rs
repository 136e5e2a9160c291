//! Finds Embree 4 and generates bindings from its headers: those that are installed, since the layout of `RTCHit`
//! depends on the version and on how the library was configured.
//!
//! `EMBREE4_ROOT` names an installation (`include/embree4/rtcore.h`, `lib/libembree4.so`); without it the compiler's
//! own search paths must do. `DEP_EMBREE4_LIBDIR` tells dependents where the library is, when not in a default place.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, panic};

const HELP: &str = "Embree >= 4.3 and libclang are needed: run scripts/setup.sh, or set EMBREE4_ROOT to an installation \
                    of Embree, or build without it (--no-default-features)";

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=EMBREE4_ROOT");
    println!("cargo::rerun-if-env-changed=LIBCLANG_PATH");
    println!("cargo::rustc-link-lib=dylib=embree4");
    let mut arguments = Vec::new();
    if let Some(root) = env::var_os("EMBREE4_ROOT").filter(|root| !root.is_empty()) {
        let root = Path::new(&root);
        let root =
            root.canonicalize().unwrap_or_else(|e| panic!("EMBREE4_ROOT={}: {e}. {HELP}", root.display()));
        let library = library_directory(&root)
            .unwrap_or_else(|| panic!("EMBREE4_ROOT={}: no libembree4 in its lib. {HELP}", root.display()));
        println!("cargo::rustc-link-search=native={}", library.display());
        println!("cargo::metadata=libdir={}", library.display());
        arguments.push(format!("-I{}", root.join("include").display()));
    }
    // A libclang without clang has no headers of its own (stddef.h, immintrin.h); the C compiler's do.
    if let Some(include) = compiler_headers() {
        arguments.push(format!("-idirafter{}", include.display()));
    }
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR")).join("bindings.rs");
    // libclang is loaded at run time; a missing one or missing headers are a panic inside bindgen.
    let generated = panic::catch_unwind(|| {
        bindgen::Builder::default()
            .header_contents("embree4.h", "#include <embree4/rtcore.h>\n")
            .clang_args(arguments)
            .allowlist_item("(rtc|RTC).*")
            .prepend_enum_name(false)
            .derive_default(false)
            .generate_comments(false)
            .formatter(bindgen::Formatter::None)
            .parse_callbacks(Box::new(bindgen::CargoCallbacks::new()))
            .generate()
    });
    match generated {
        Ok(Ok(bindings)) => bindings.write_to_file(&out).expect("cannot write the bindings"),
        Ok(Err(error)) => panic!("Embree's headers cannot be read: {error}. {HELP}"),
        Err(_) => panic!("libclang cannot be used. {HELP}"),
    }
}

fn library_directory(root: &Path) -> Option<PathBuf> {
    let multiarch = format!("lib/{}-linux-gnu", env::var("CARGO_CFG_TARGET_ARCH").unwrap_or_default());
    let names = ["libembree4.so", "libembree4.dylib", "embree4.lib"];
    ["lib", "lib64", &multiarch]
        .into_iter()
        .map(|directory| root.join(directory))
        .find(|directory| names.iter().any(|name| directory.join(name).exists()))
}

fn compiler_headers() -> Option<PathBuf> {
    let compiler = env::var_os("CC").unwrap_or_else(|| "cc".into());
    let output = Command::new(compiler).arg("-print-file-name=include").output().ok()?;
    let path = PathBuf::from(String::from_utf8(output.stdout).ok()?.trim_end());
    path.is_absolute().then_some(path)
}
