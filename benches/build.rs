//! Compiles the C side of the comparison with Embree.

fn main() {
    println!("cargo::rerun-if-changed=embree.c");
    println!("cargo::rerun-if-changed=embree.h");
    println!("cargo::rerun-if-changed=embree4.c");
    println!("cargo::rerun-if-changed=embree4.h");
    #[cfg(feature = "embree")]
    {
        let mut build = cc::Build::new();
        build
            .file("embree.c")
            .file("embree4.c")
            .std("c11")
            .opt_level(3)
            .warnings(true)
            .extra_warnings(true);
        build.compile("bench_embree");
        println!("cargo::rustc-link-lib=embree3");
        println!("cargo::rustc-link-lib=dl");
    }
}
