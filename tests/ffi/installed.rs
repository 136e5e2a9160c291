//! The installed library: found by pkg-config and by CMake, wherever its directory is moved to.
//!
//! `cargo test -- --ignored installed` (some minutes: it builds the library twice).

use super::support::{root, run, there};
use std::path::PathBuf;
use std::process::Command;

const CMAKE: &str = "cmake_minimum_required(VERSION 3.16)
project(consumer C CXX)
set(CMAKE_C_STANDARD 99)
set(CMAKE_CXX_STANDARD 11)
find_package(hrr 0.1 REQUIRED)
find_package(Threads REQUIRED)
add_executable(minimal_c SOURCE/minimal.c)
target_link_libraries(minimal_c hrr::hrr m)
add_executable(minimal_cpp SOURCE/minimal.cpp)
target_link_libraries(minimal_cpp hrr::hrr Threads::Threads)
add_executable(minimal_static SOURCE/minimal.c)
target_link_libraries(minimal_static hrr::static m)
";

#[test]
#[ignore = "builds the library anew: cargo test -- --ignored installed"]
fn installed_libraries_are_found() {
    let scratch = tempfile::tempdir().unwrap();
    let first = scratch.path().join("first");
    let target = scratch.path().join("target");
    run(Command::new("make")
        .current_dir(root())
        .arg("install")
        .arg(format!("PREFIX={}", first.display()))
        .arg("ARGUMENTS=--profile dev")
        .env("CARGO_TARGET_DIR", &target));
    // Nothing of it knows where it was.
    let prefix = scratch.path().join("moved");
    std::fs::rename(&first, &prefix).unwrap();
    let library = prefix.join("lib");
    let named = run(Command::new("readelf").arg("-d").arg(library.join("libhrr.so")));
    assert!(named.contains(&format!("soname: [libhrr.so.{}]", hrr::ffi::HRR_ABI)), "{named}");
    let names = run(Command::new("nm")
        .args(["-D", "--defined-only", "--format=just-symbols"])
        .arg(library.join("libhrr.so")));
    assert!(names.lines().all(|name| name.starts_with("hrr_")), "{names}");
    if there("pkg-config") {
        for (flags, shared) in
            [(vec!["--cflags", "--libs"], true), (vec!["--cflags", "--libs", "--static"], false)]
        {
            let flags = run(Command::new("pkg-config")
                .args(&flags)
                .arg("hrr")
                .env("PKG_CONFIG_PATH", library.join("pkgconfig")));
            let program = scratch.path().join("program");
            let mut compile = Command::new("cc");
            compile.args(["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror"]);
            compile.arg(root().join("examples/c/minimal.c")).arg("-o").arg(&program);
            if !shared {
                compile.arg("-Wl,-Bstatic");
            }
            for flag in flags.split_whitespace() {
                compile.arg(flag);
                // Only libhrr itself.
                if !shared && flag == "-lhrr" {
                    compile.arg("-Wl,-Bdynamic");
                }
            }
            run(compile.arg("-lm"));
            let mut program = Command::new(program);
            if shared {
                program.env("LD_LIBRARY_PATH", &library);
            }
            assert!(run(&mut program).ends_with("all is well\n"));
        }
    }
    if there("cmake") {
        let source = scratch.path().join("consumer");
        std::fs::create_dir(&source).unwrap();
        let lists = CMAKE.replace("SOURCE", root().join("examples/c").to_str().unwrap());
        std::fs::write(source.join("CMakeLists.txt"), lists).unwrap();
        let build: PathBuf = scratch.path().join("build");
        run(Command::new("cmake")
            .arg("-S")
            .arg(&source)
            .arg("-B")
            .arg(&build)
            .arg(format!("-DCMAKE_PREFIX_PATH={}", prefix.display())));
        run(Command::new("cmake").arg("--build").arg(&build));
        for program in ["minimal_c", "minimal_cpp", "minimal_static"] {
            assert!(run(&mut Command::new(build.join(program))).ends_with("all is well\n"), "{program}");
        }
        let lists =
            std::fs::read_to_string(source.join("CMakeLists.txt")).unwrap().replace("hrr 0.1", "hrr 7.0");
        std::fs::write(source.join("CMakeLists.txt"), lists).unwrap();
        let other = Command::new("cmake").arg("-S").arg(&source).arg("-B").arg(&build).output().unwrap();
        assert!(!other.status.success(), "another version is not taken");
    }
}
