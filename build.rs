//! Does nothing, unless the development feature `header` asks for include/raykern.h.
//!
//! ```sh
//! cargo check --features header && git diff --exit-code include/raykern.h
//! ```

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    #[cfg(feature = "header")]
    header::write();
}

#[cfg(feature = "header")]
mod header {
    use std::path::Path;

    /// In the order in which the header shall show them.
    const SOURCES: [&str; 9] =
        ["status", "types", "version", "build", "refit", "query", "hits", "closest", "batch"];
    const HEADER: &str = "include/raykern.h";

    pub fn write() {
        let root = std::env::var("CARGO_MANIFEST_DIR").expect("cargo sets it");
        let root = Path::new(&root);
        let config = root.join("cbindgen.toml");
        println!("cargo::rerun-if-changed=cbindgen.toml");
        println!("cargo::rerun-if-changed={HEADER}");
        println!("cargo::rerun-if-changed=src/capi");
        let config = cbindgen::Config::from_file(config).expect("cbindgen.toml is readable");
        let mut builder = cbindgen::Builder::new().with_config(config);
        for name in SOURCES {
            builder = builder.with_src(root.join(format!("src/capi/{name}.rs")));
        }
        let mut text = Vec::new();
        builder.generate().expect("the C face can be expressed in C").write(&mut text);
        let text = in_c(&String::from_utf8(text).expect("cbindgen writes UTF-8"));
        let path = root.join(HEADER);
        if std::fs::read_to_string(&path).ok().as_deref() != Some(&text) {
            std::fs::write(&path, text).expect("include/ is writable");
        }
    }

    /// What cbindgen cannot be told: drops the `# Safety` sections, whose meaning for C stands in the
    /// conventions at the top; groups constants; says `RtRay` rather than `struct RtRay`.
    fn in_c(header: &str) -> String {
        let mut lines: Vec<String> = Vec::new();
        let mut in_safety = false;
        let mut family = "";
        for line in header.lines() {
            let comment = line.trim_start().strip_prefix("//").map(str::trim);
            in_safety = comment.is_some_and(|text| in_safety || text == "# Safety");
            let blank_again = line.is_empty() && lines.last().is_none_or(String::is_empty);
            if in_safety || blank_again {
                continue;
            }
            // The blank comment line that stood above the section.
            if comment.is_none() && lines.last().is_some_and(|last| last.trim() == "//") {
                lines.pop();
            }
            if let Some(name) = line.strip_prefix("#define ") {
                let end = name.match_indices('_').nth(1).map_or(name.len(), |(at, _)| at);
                if family == &name[..end] {
                    join_to_constant_above(&mut lines);
                }
                family = &name[..end];
            }
            let is_definition = line.starts_with("typedef struct");
            lines.push(if is_definition { line.into() } else { line.replace("struct Rt", "Rt") });
        }
        lines.join("\n") + "\n"
    }

    /// Removes the blank line between a constant's comment, which ends `lines`, and what is above.
    fn join_to_constant_above(lines: &mut Vec<String>) {
        let is_comment = |line: &&String| line.starts_with("//");
        let comment = lines.iter().rev().take_while(is_comment).count();
        if let Some(above) = lines.len().checked_sub(comment + 1)
            && lines[above].is_empty()
        {
            lines.remove(above);
        }
    }
}
