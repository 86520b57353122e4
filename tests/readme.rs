//! What the README says in C is what the example, which is compiled and run, does.

#![allow(missing_docs)]

#[test]
fn the_c_snippet_is_the_example() {
    let readme = include_str!("../README.md");
    let example = include_str!("../examples/first_ray.c");
    let snippet = readme.split("```c\n").nth(1).and_then(|rest| rest.split("```").next());
    let snippet = snippet.expect("the README has an example in C");
    assert!(snippet.lines().count() >= 8);
    let lines: Vec<_> = example.lines().map(str::trim).collect();
    for line in snippet.lines().map(str::trim) {
        assert!(lines.contains(&line), "not in examples/first_ray.c: {line}");
    }
}
