//! `include/hrr.h` is what the functions of `src/ffi` say. `HRR_WRITE_HEADER=1 cargo test header` writes it anew.

use std::fs;
use std::path::Path;

/// In the order in which a host meets them.
const FILES: [&str; 17] = [
    "status", "log", "memory", "progress", "context", "segment", "cache", "lobe", "query", "batch", "aids",
    "replay", "capture", "geometry", "rays", "scene", "render",
];

const HEAD: &str = "/* hrr.h - the C interface of libhrr: hierarchical Russian roulette for vertex connections.
 *
 * Made from src/ffi; docs/c-api.md tells how to use it. C99 and C++11; include hrr.hpp for C++.
 *
 * Units are the host's. Outputs are written when a call succeeds (or where said otherwise). Structs are zeroed by the
 * host before their fields are set. Arguments may not be NULL where nothing is said.
 */";

fn generated() -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config {
        language: cbindgen::Language::C,
        cpp_compat: true,
        include_guard: Some("HRR_H".into()),
        header: Some(HEAD.into()),
        no_includes: true,
        sys_includes: vec!["stddef.h".into(), "stdint.h".into()],
        after_includes: Some(version()),
        usize_is_size_t: true,
        style: cbindgen::Style::Both,
        documentation_style: cbindgen::DocumentationStyle::C99,
        line_length: 110,
        tab_width: 2,
        function: cbindgen::FunctionConfig { prefix: Some("HRR_API".into()), ..Default::default() },
        ..Default::default()
    };
    let mut builder = cbindgen::Builder::new().with_config(config);
    for file in FILES {
        builder = builder.with_src(root.join("src/ffi").join(file).with_extension("rs"));
    }
    let mut text = Vec::new();
    builder.generate().unwrap().write(&mut text);
    String::from_utf8(text).unwrap()
}

fn version() -> String {
    let part = |name: &str, value: &str| format!("#define HRR_VERSION_{name} {value}\n");
    part("MAJOR", env!("CARGO_PKG_VERSION_MAJOR"))
        + &part("MINOR", env!("CARGO_PKG_VERSION_MINOR"))
        + &part("PATCH", env!("CARGO_PKG_VERSION_PATCH"))
        + "\n/* Define it where functions need an attribute, such as __declspec(dllimport). */\n"
        + "#ifndef HRR_API\n#define HRR_API\n#endif"
}

#[test]
fn header_is_up_to_date() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("include/hrr.h");
    let new = generated();
    if std::env::var_os("HRR_WRITE_HEADER").is_some() {
        fs::write(&path, &new).unwrap();
    }
    let old = fs::read_to_string(&path).unwrap_or_default();
    let differs = old.lines().zip(new.lines()).position(|(a, b)| a != b);
    assert!(old == new, "include/hrr.h differs from src/ffi at line {differs:?}; set HRR_WRITE_HEADER=1");
}

#[test]
fn header_declares_every_function() {
    let header = generated();
    let mut count = 0;
    for file in fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("src/ffi")).unwrap() {
        for line in fs::read_to_string(file.unwrap().path()).unwrap().lines() {
            let line = line.trim_start_matches("pub unsafe extern").trim_start_matches("pub extern");
            if let Some(name) = line.strip_prefix(" \"C\" fn ") {
                let name = name.split('(').next().unwrap();
                assert!(header.contains(&format!("{name}(")), "{name} is not in the header");
                count += 1;
            }
        }
    }
    assert!(count > 50);
}
