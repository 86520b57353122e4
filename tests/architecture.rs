//! The picture in ARCHITECTURE.md, held against every `crate::` path under `src/`.

#![allow(missing_docs)]

use std::fs;
use std::path::{Path, PathBuf};

/// Each module and what it may name; whatever is lower stands before.
const HOUSE: &[(&str, &[&str])] = &[
    ("kinds", &[]),
    ("math", &[]),
    ("error", &[]),
    ("storage", &[]),
    ("pending", &[]),
    ("simd", &["math"]),
    ("caller", &["kinds"]),
    ("exact", &["kinds", "math"]),
    ("ray", &["exact", "math", "simd"]),
    ("block", &["error", "kinds", "math", "storage"]),
    ("scene", &["block", "math"]),
    ("instance", &["block", "error", "exact", "math", "ray", "scene", "simd"]),
    ("interval", &["exact", "math", "simd"]),
    // The tests of its bounds judge by `interval` and `exact`.
    ("sieve", &["block", "exact", "interval", "math", "ray", "simd"]),
    ("query", &["block", "exact", "interval", "math", "ray", "sieve", "simd"]),
    (
        "prim",
        &[
            "block", "caller", "error", "interval", "kinds", "math", "query", "ray", "scene",
            "sieve", "simd",
        ],
    ),
    ("point", &["block", "instance", "math", "prim", "query", "ray", "simd"]),
    ("choice", &["block", "math", "scene"]),
    ("list", &["block", "error", "prim", "scene"]),
    (
        "grid",
        &[
            "block", "caller", "error", "math", "pending", "point", "prim", "query", "ray",
            "scene", "simd", "storage",
        ],
    ),
    (
        "bvh",
        &[
            "block", "caller", "error", "kinds", "math", "pending", "point", "prim", "query",
            "ray", "scene", "simd", "storage",
        ],
    ),
    ("surface", &["exact", "instance", "interval", "math"]),
    ("trace", &["block", "bvh", "grid", "kinds", "math", "prim", "query", "ray", "simd"]),
    (
        "batch",
        &[
            "block", "bvh", "grid", "kinds", "math", "prim", "query", "ray", "sieve", "simd",
            "trace",
        ],
    ),
    (
        "levels",
        &["batch", "block", "bvh", "instance", "math", "prim", "query", "ray", "simd", "trace"],
    ),
    ("hits", &["block", "levels", "query", "ray", "simd", "trace"]),
    (
        "closest",
        &[
            "block", "bvh", "grid", "kinds", "levels", "math", "point", "prim", "query", "ray",
            "simd",
        ],
    ),
    (
        "accel",
        &[
            "batch", "block", "bvh", "closest", "error", "grid", "hits", "instance", "kinds",
            "levels", "prim", "query", "ray", "scene", "storage", "surface", "trace",
        ],
    ),
    ("refit", &["block", "bvh", "caller", "error", "kinds", "math", "prim", "scene", "storage"]),
    (
        "build",
        &[
            "accel", "block", "bvh", "caller", "choice", "error", "grid", "instance", "kinds",
            "list", "math", "prim", "refit", "scene", "storage",
        ],
    ),
    ("pack", &["accel", "block", "build", "error", "storage"]),
    ("accel_mut", &["accel", "build", "caller", "error", "refit", "scene"]),
    ("owned", &["accel", "build", "caller", "error", "refit", "scene", "storage"]),
    (
        "capi",
        &[
            "accel", "build", "caller", "closest", "error", "grid", "hits", "kinds", "query",
            "ray", "refit", "scene", "simd", "storage", "surface",
        ],
    ),
];

#[test]
fn dependencies_point_down() {
    let mut wrong = Vec::new();
    let mut files = 0;
    for file in rust_files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src")) {
        let module = module_of(&file);
        if module == "lib" {
            continue;
        }
        files += 1;
        let Some((_, allowed)) = HOUSE.iter().find(|(name, _)| *name == module) else {
            wrong.push(format!("{}: the module `{module}` is not in the picture", file.display()));
            continue;
        };
        let text = fs::read_to_string(&file).expect("a source file");
        for named in named_modules(&text) {
            if named != module && !allowed.contains(&named.as_str()) {
                wrong.push(format!("{}: `{module}` names `{named}`", file.display()));
            }
        }
    }
    assert!(files > 20, "only {files} source files were found");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_picture_has_no_cycle() {
    for (place, (module, allowed)) in HOUSE.iter().enumerate() {
        for lower in *allowed {
            let below = HOUSE[..place].iter().any(|(name, _)| name == lower);
            assert!(below, "`{lower}` must stand before `{module}`");
        }
    }
}

/// The modules after each `crate::`, one by one or in braces; names that are no modules are types
/// re-exported at the root, which only `lib.rs` may use.
fn named_modules(text: &str) -> Vec<String> {
    let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
    let code = code.collect::<Vec<_>>().join("\n");
    let mut names = Vec::new();
    for rest in code.split("crate::").skip(1) {
        let list = match rest.strip_prefix('{') {
            Some(list) => top_level_items(list),
            None => vec![rest],
        };
        for item in list {
            let name: String =
                item.trim().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            if !name.is_empty() {
                names.push(name);
            }
        }
    }
    names
}

/// What stands between the commas of a brace list, nested braces left whole.
fn top_level_items(list: &str) -> Vec<&str> {
    let (mut depth, mut start, mut items) = (0, 0, Vec::new());
    for (i, c) in list.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => {
                items.push(&list[start..i]);
                break;
            }
            '}' => depth -= 1,
            ',' if depth == 0 => {
                items.push(&list[start..i]);
                start = i + 1;
            }
            _ => {}
        }
    }
    items
}

fn module_of(file: &Path) -> String {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let inside = file.strip_prefix(src).expect("a file under src");
    let first = inside.components().next().expect("a name").as_os_str().to_string_lossy();
    first.trim_end_matches(".rs").to_owned()
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).expect("the source folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
    files
}
