//! Programs in C and C++ that use the library as hosts do: compiled, linked with the shared and with the static
//! library, run. `CC` and `CXX` name the compilers (default: cc, c++).

use super::support::{root, run, there};
use std::path::{Path, PathBuf};
use std::process::Command;

const STRICT: [&str; 5] = ["-Wall", "-Wextra", "-pedantic", "-Werror", "-O1"];

fn compiler(variable: &str, default: &str) -> Command {
    Command::new(std::env::var_os(variable).unwrap_or_else(|| default.into()))
}

fn c() -> Command {
    let mut command = compiler("CC", "cc");
    command.arg("-std=c99").args(STRICT).arg("-I").arg(root().join("include"));
    command
}

fn cpp(standard: &str) -> Command {
    let mut command = compiler("CXX", "c++");
    command.arg(format!("-std={standard}")).args(STRICT).arg("-I").arg(root().join("include"));
    command
}

/// Where cargo puts the libraries of the build that this test belongs to.
fn libraries() -> PathBuf {
    let directory = std::env::current_exe().unwrap().parent().unwrap().to_owned();
    assert!(directory.join("libhrr.so").exists(), "no libhrr.so in {}", directory.display());
    directory
}

/// What a static libhrr needs beside itself: `cargo rustc --lib -- --print native-static-libs`.
fn static_needs(command: &mut Command) {
    for variable in ["EMBREE4_ROOT", "OIIO_ROOT"] {
        if let Some(directory) = std::env::var_os(variable) {
            let directory = Path::new(&directory).join("lib");
            command.arg("-L").arg(&directory).arg(format!("-Wl,-rpath,{}", directory.display()));
        }
    }
    command.arg("-Wl,--as-needed");
    if cfg!(feature = "embree") {
        command.arg("-lembree4");
    }
    if cfg!(feature = "oiio") {
        command.args(["-lOpenImageIO", "-lOpenImageIO_Util", "-lstdc++"]);
    }
    command.args(["-lpthread", "-ldl", "-lm", "-lgcc_s", "-lc"]);
}

fn compile_and_run(compiler: Command, source: &str, shared: bool) {
    compile_and_run_with(compiler, source, shared, &[]);
}

/// `DIRECTORY` among the arguments stands for one that is there for the time of the run.
fn compile_and_run_with(mut compiler: Command, source: &str, shared: bool, arguments: &[&str]) -> String {
    let directory = tempfile::tempdir().unwrap();
    let program = directory.path().join("program");
    compiler.arg(root().join("examples/c").join(source)).arg("-o").arg(&program);
    if shared {
        compiler.arg("-L").arg(libraries()).arg("-lhrr").arg("-lpthread").arg("-lm");
    } else {
        compiler.arg("-Wl,--gc-sections").arg(libraries().join("libhrr.a"));
        static_needs(&mut compiler);
    }
    run(&mut compiler);
    let mut program = Command::new(program);
    for argument in arguments {
        program.arg(if *argument == "DIRECTORY" { directory.path().as_os_str() } else { argument.as_ref() });
    }
    if shared {
        program.env("LD_LIBRARY_PATH", libraries());
    }
    let text = run(&mut program);
    assert!(text.ends_with("all is well\n"), "{text}");
    text
}

#[test]
fn headers_compile_alone() {
    for header in ["hrr.h", "hrr.hpp"] {
        let header = root().join("include").join(header);
        if header.extension().unwrap() == "h" {
            run(c().args(["-fsyntax-only", "-x", "c"]).arg(&header));
        }
        for standard in ["c++11", "c++17"] {
            run(cpp(standard).args(["-fsyntax-only", "-x", "c++"]).arg(&header));
        }
    }
}

#[test]
fn headers_compile_with_clang() {
    if !there("clang") {
        return;
    }
    for (header, language, standard) in [
        ("hrr.h", "c", "c99"),
        ("hrr.h", "c++", "c++11"),
        ("hrr.hpp", "c++", "c++11"),
        ("hrr.hpp", "c++", "c++17"),
    ] {
        let mut clang = Command::new("clang");
        clang.args(STRICT).arg(format!("-std={standard}")).args(["-fsyntax-only", "-x", language]);
        run(clang.arg(root().join("include").join(header)));
    }
}

#[test]
fn a_host_with_threads_of_its_own() {
    for (standard, shared) in [("c++11", true), ("c++17", false)] {
        compile_and_run_with(cpp(standard), "threads.cpp", shared, &["DIRECTORY"]);
    }
}

#[test]
fn a_host_with_a_path_tracer_of_its_own() {
    let mut compiler = cpp("c++17");
    compiler.arg("-O2");
    let text = compile_and_run_with(compiler, "connect.cpp", true, &["64", "12", "DIRECTORY"]);
    let ratio = text.split("variance without / with ").nth(1).unwrap().lines().next().unwrap();
    assert!(ratio.parse::<f64>().unwrap() > 3.0, "{text}");
    compile_and_run_with(cpp("c++17"), "connect.cpp", false, &["16", "2"]);
}

#[cfg(feature = "embree")]
#[test]
fn a_host_with_an_embree_scene_of_its_own() {
    for shared in [true, false] {
        let mut compiler = cpp("c++17");
        if let Some(directory) = std::env::var_os("EMBREE4_ROOT") {
            // As the system's headers: their warnings are theirs.
            compiler.arg("-isystem").arg(Path::new(&directory).join("include"));
            let library = Path::new(&directory).join("lib");
            compiler.arg("-L").arg(&library).arg(format!("-Wl,-rpath,{}", library.display()));
        }
        compiler.arg("-Wl,--no-as-needed").arg("-lembree4");
        compile_and_run(compiler, "embree_host.cpp", shared);
    }
}

#[test]
fn every_function_with_good_and_bad_arguments() {
    for shared in [true, false] {
        let mut compiler = c();
        compiler.arg("-D_POSIX_C_SOURCE=200809L");
        let scene = root().join("scenes/cornell/scene.toml");
        let scene = scene.to_str().unwrap();
        compile_and_run_with(compiler, "../../tests/ffi/every_function.c", shared, &["DIRECTORY", scene]);
    }
}

#[test]
fn c_with_the_shared_library() {
    compile_and_run(c(), "minimal.c", true);
}

#[test]
fn c_with_the_static_library() {
    compile_and_run(c(), "minimal.c", false);
}

#[test]
fn cpp_with_the_shared_library() {
    compile_and_run(cpp("c++11"), "minimal.cpp", true);
}

#[test]
fn cpp_with_the_static_library() {
    compile_and_run(cpp("c++17"), "minimal.cpp", false);
}

#[test]
fn only_own_names_are_exported() {
    let names = run(Command::new("nm")
        .args(["-D", "--defined-only", "--format=just-symbols"])
        .arg(libraries().join("libhrr.so")));
    let foreign: Vec<_> = names.lines().filter(|name| !name.starts_with("hrr_")).collect();
    assert!(foreign.is_empty() && names.lines().count() > 20, "{foreign:?}");
}
