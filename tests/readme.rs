//! What the README says in C and in C++ is what the examples, which are compiled and run, do.

#![allow(missing_docs)]

#[test]
fn the_snippets_are_the_examples() {
    let readme = include_str!("../README.md");
    let examples = [
        ("```c\n", include_str!("../examples/first_ray.c")),
        ("```cpp\n", include_str!("../examples/first_ray.cpp")),
    ];
    for (begin, example) in examples {
        let snippet = readme.split(begin).nth(1).and_then(|rest| rest.split("```").next());
        let snippet = snippet.expect("the README has an example in C and one in C++");
        assert!(snippet.lines().count() >= 8);
        let lines: Vec<_> = example.lines().map(str::trim).collect();
        for line in snippet.lines().map(str::trim) {
            assert!(lines.contains(&line), "in no example: {line}");
        }
    }
}
