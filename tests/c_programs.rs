//! Compiles the programs in `c_tests/` against the header and the static library, and runs them.
//!
//! With `RAYKERN_SANITIZE=1` the programs are compiled with address and undefined-behaviour
//! sanitizers; the Rust side is not.

#![cfg(all(unix, not(miri)))]

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

const WARNINGS: [&str; 4] = ["-pedantic", "-Wall", "-Wextra", "-Werror"];
const SYSTEM: [&str; 3] = ["-lpthread", "-lm", "-ldl"];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The directory of the cargo that runs the test, whose core is linked and not compiled again.
fn target() -> &'static Path {
    Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("a folder within another")
}

/// Where programs and their libraries are put.
fn folder() -> PathBuf {
    let folder = target().join("c-tests");
    std::fs::create_dir_all(&folder).expect("a folder for programs");
    folder
}

/// Runs `command`, which must succeed; returns what it printed.
fn run(command: &mut Command) -> String {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {}\n{errors}", output.status);
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn cargo() -> Command {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.current_dir(root()).env("CARGO_TARGET_DIR", target()).arg("--locked");
    by_all_cores(&mut cargo);
    cargo
}

/// With release builds optimised as programs are, but in half the time; `check.sh` says the same and links the same.
fn by_all_cores(command: &mut Command) {
    command.env("CARGO_PROFILE_RELEASE_CODEGEN_UNITS", "16");
}

/// The folder of the C library, which is built once.
fn library() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        run(cargo().args(["build", "-p", "raykern-c", "--profile", "test"]));
        target().join("debug")
    })
}

fn compiler(cpp: bool) -> Command {
    let host = format!("{}-unknown-linux-gnu", std::env::consts::ARCH);
    let mut build = cc::Build::new();
    build.cpp(cpp).target(&host).host(&host).opt_level(1).cargo_metadata(false);
    build.out_dir(folder()).get_compiler().to_command()
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a path in UTF-8")
}

/// Compiles `source` with `flags`, links it and runs it; returns what it printed.
fn program(name: &str, source: &str, cpp: bool, flags: &[&str]) -> String {
    program_with(name, source, cpp, flags, &[])
}

/// The same with other libraries.
fn program_with(name: &str, source: &str, cpp: bool, flags: &[&str], libraries: &[&str]) -> String {
    let library = library().join("libraykern.a");
    let binary = folder().join(name);
    let mut command = compiler(cpp);
    command.args(flags).args(WARNINGS).arg("-I").arg(root().join("include"));
    if std::env::var_os("RAYKERN_SANITIZE").is_some() {
        command.args(["-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]);
    }
    let language = if cpp { "c++" } else { "c" };
    command.args(["-x", language]).arg(root().join(source)).args(["-x", "none"]);
    run(command.arg(library).args(libraries).args(SYSTEM).arg("-o").arg(&binary));
    // Memory of the programs is never freed.
    run(Command::new(binary).env("ASAN_OPTIONS", "detect_leaks=0"))
}

#[test]
fn abi() {
    program("abi99", "c_tests/abi.c", false, &["-std=c99"]);
    program("abi11", "c_tests/abi.c", false, &["-std=c11"]);
    program("abi++", "c_tests/abi.c", true, &["-std=c++11"]);
}

#[test]
fn layout() {
    program("layout", "c_tests/layout.c", false, &["-std=c11"]);
}

#[test]
fn errors() {
    program("errors", "c_tests/errors.c", false, &["-std=c11"]);
}

#[test]
fn memory() {
    program("memory", "c_tests/memory.c", false, &["-std=c11"]);
}

#[test]
fn threads() {
    program("threads", "c_tests/threads.c", false, &["-std=c11"]);
}

#[test]
fn builds() {
    program("builds", "c_tests/builds.c", false, &["-std=c11", "-frounding-math"]);
}

#[test]
fn refit() {
    program("refit", "c_tests/refit.c", false, &["-std=c11"]);
}

#[test]
fn hits() {
    program("hits", "c_tests/hits.c", false, &["-std=c11"]);
}

#[test]
fn closest() {
    program("closest", "c_tests/closest.c", false, &["-std=c11"]);
}

#[test]
fn instances() {
    program("instances", "c_tests/instances.c", false, &["-std=c11"]);
}

/// Where Embree 3 is installed.
#[test]
fn instances_against_embree() {
    if !Path::new("/usr/include/embree3/rtcore.h").exists() {
        println!("skipped: no Embree 3");
        return;
    }
    let source = "c_tests/instances_embree.c";
    program_with("instances_embree", source, false, &["-std=c11"], &["-lembree3"]);
}

#[test]
fn control() {
    program("control", "c_tests/control.c", false, &["-std=c11", "-frounding-math"]);
}

/// The picture that boards give, from a block that was baked: as in `targets/picture.txt`.
#[test]
fn picture() {
    let targets = root().join("targets");
    let board = targets.join("board/host.c");
    let (include, block) = (targets.join("board"), format!("-Wa,-I,{}", targets.display()));
    let flags = ["-std=c11", "-ffp-contract=off", "-I", text(&include), &block, text(&board)];
    let printed = program("picture", "targets/programs/picture.c", false, &flags);
    let expected = std::fs::read_to_string(targets.join("picture.txt")).unwrap();
    let lines = |text: &str| -> Vec<String> {
        text.lines().filter(|line| !line.starts_with('#')).map(str::to_owned).collect()
    };
    assert_eq!(lines(&printed), lines(&expected));
}

#[test]
fn first_ray() {
    program("first_ray", "examples/first_ray.c", false, &["-std=c11"]);
    program("first_ray++", "examples/first_ray.cpp", true, &["-std=c++17"]);
}

#[test]
fn the_shared_library_exports_only_its_own_names() {
    let symbols = run(Command::new("nm")
        .args(["-D", "--defined-only", "-P"])
        .arg(library().join("libraykern.so")));
    let names: Vec<&str> = symbols.lines().filter_map(|line| line.split(' ').next()).collect();
    assert!(names.contains(&"rt_intersect"), "{names:?}");
    assert!(names.iter().all(|name| name.starts_with("rt_")), "{names:?}");
}

#[test]
#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
fn freestanding() {
    let features = ["--no-default-features", "--features", "freestanding"];
    run(cargo()
        .args(["rustc", "-p", "raykern-c", "--profile", "freestanding"])
        .args(features)
        .args(["--crate-type", "staticlib"]));
    let binary = folder().join("freestanding");
    let mut command = compiler(false);
    command.args(["-std=c11", "-ffreestanding", "-fno-builtin", "-fno-stack-protector"]);
    command.args(["-nostdlib", "-nostartfiles", "-static", "-no-pie", "-Wl,--gc-sections"]);
    command.args(WARNINGS).arg("-I").arg(root().join("include"));
    command.arg(root().join("c_tests/freestanding.c"));
    command.arg(target().join("freestanding/libraykern.a")).arg("-o").arg(&binary);
    run(&mut command);
    run(&mut Command::new(binary));
}

/// The example against an installed copy, as a user would build it.
#[test]
fn install() {
    let prefix = folder().join("installed");
    let make = |goal: &str| {
        let mut make = Command::new("make");
        make.current_dir(root()).env("CARGO_TARGET_DIR", target()).arg(goal);
        by_all_cores(&mut make);
        run(make.arg(format!("PREFIX={}", prefix.display())).env("CARGO_NET_OFFLINE", "true"));
    };
    make("install");
    let pc = std::fs::read_to_string(prefix.join("lib/pkgconfig/raykern.pc")).unwrap();
    let value = |key: &str| -> Vec<String> {
        let line = pc.lines().find_map(|line| line.strip_prefix(key)).expect(key);
        let line = line.replace("${includedir}", &format!("{}/include", prefix.display()));
        let line = line.replace("${libdir}", &format!("{}/lib", prefix.display()));
        line.split_whitespace().map(str::to_owned).collect()
    };
    let source = root().join("examples/first_ray.c");
    let (shared, fixed) = (folder().join("installed-shared"), folder().join("installed-static"));
    run(compiler(false)
        .args(value("Cflags:"))
        .arg(&source)
        .args(value("Libs:"))
        .arg("-o")
        .arg(&shared));
    run(Command::new(&shared).env("LD_LIBRARY_PATH", prefix.join("lib")));
    let archive = prefix.join("lib/libraykern.a");
    run(compiler(false)
        .args(value("Cflags:"))
        .arg(&source)
        .arg(archive)
        .args(value("Libs.private:"))
        .arg("-o")
        .arg(&fixed));
    run(&mut Command::new(&fixed));
    // All of it linked statically, as `pkg-config --static` has it.
    run(compiler(false)
        .arg("-static")
        .args(value("Cflags:"))
        .arg(&source)
        .args(value("Libs:"))
        .args(value("Libs.private:"))
        .arg("-o")
        .arg(&fixed));
    run(&mut Command::new(&fixed));
    make("uninstall");
    assert!(!prefix.join("include/raykern.h").exists());
    assert!(std::fs::read_dir(prefix.join("lib")).unwrap().all(|e| e.unwrap().path().is_dir()));
}
