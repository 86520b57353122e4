#!/usr/bin/env bash
# Everything that must hold before a change lands. Needs Rust and a C compiler; installs the rest
# (Debian packages by name). A quarter of an hour on two idle cores, or a little more.
#
#   ./check.sh            all of it, but for most of the other processors
#   ./check.sh all        these too
#   ./check.sh STEP ...   some of it: format clippy build test backends docs header c targets fuzz embree stress compare
#                         bench report, or all_targets
set -euo pipefail
cd "$(dirname "$0")"
export CARGO_TERM_COLOR=never
# Nothing here is compiled a second time, and what that would be faster by fills the disk.
export CARGO_INCREMENTAL=0

# What every step with tests asks for: other features of any crate would compile the core once more, which takes minutes.
all=(--workspace --features raykern/capi)

# Optimised as programs are, but by all cores: this takes half as long, and what is measured here means nothing.
released() { CARGO_PROFILE_RELEASE_CODEGEN_UNITS=16 cargo "$@"; }

step_install() {
    local missing=()
    command -v cc >/dev/null || missing+=(gcc libc6-dev)
    command -v c++ >/dev/null || missing+=(g++)
    command -v make >/dev/null || missing+=(make)
    [ -e /usr/include/embree3/rtcore.h ] || missing+=(libembree-dev)
    [ ${#missing[@]} -eq 0 ] && return
    local sudo=()
    [ "$(id -u)" -eq 0 ] || sudo=(sudo)
    "${sudo[@]}" apt-get update -qq
    "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
        "${missing[@]}"
}

step_format() {
    cargo fmt --all -- --check
    cargo fmt --manifest-path fuzz/Cargo.toml -- --check
    cargo fmt --manifest-path targets/agree/Cargo.toml -- --check
}

step_clippy() {
    cargo clippy --workspace --all-targets -- -D warnings
    cargo clippy -p raykern --features capi --all-targets -- -D warnings
    cargo clippy -p raykern --no-default-features --features libm,capi --lib -- -D warnings
    # By its manifest and from here, so that the flags for fuzzing are left out.
    cargo clippy --manifest-path fuzz/Cargo.toml --all-targets -- -D warnings
}

# The sets of features that programs choose, each without the others' leftovers.
step_build() {
    cargo check -p raykern --lib --no-default-features --features libm
    cargo check -p raykern --lib --no-default-features --features libm,alloc
    cargo check -p raykern --lib --no-default-features --features libm,capi
    cargo check -p raykern --lib --no-default-features --features libm,full
    cargo check -p raykern --lib --features capi
    if cargo check -q -p raykern --lib --no-default-features 2>/dev/null; then
        echo "a build without std and without libm must be refused" >&2
        return 1
    fi
}

step_test() {
    cargo test "${all[@]}"
}

# The tests of answers once more with each lower backend; `test` has run them with the best one.
step_backends() {
    local backend
    for backend in scalar bits128 avx2; do
        RAYKERN_BACKEND=$backend cargo test -q "${all[@]}" \
            --test agree --test exact --test hostile --test laws --test watertight
    done
}

step_docs() { RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --features raykern/capi; }

# The committed header is what the sources give.
step_header() {
    local before
    before=$(mktemp)
    cp include/raykern.h "$before"
    cargo check -p raykern --lib --features header
    if ! cmp -s include/raykern.h "$before"; then
        diff -u "$before" include/raykern.h || true
        cp "$before" include/raykern.h
        echo "include/raykern.h is stale: cargo check --features header writes it again" >&2
        return 1
    fi
}

# The C programs once more, with address and undefined-behaviour sanitizers.
step_c() { RAYKERN_SANITIZE=1 cargo test "${all[@]}" --test c_programs; }

# Other processors in emulators: a Cortex-M, one of the other byte order, and WebAssembly.
step_targets() { targets/run.sh short; }

# Each of them.
step_all_targets() { targets/run.sh all; }

# Each fuzz target for ten seconds, from nothing; fuzz/README.md says how to run them for longer. Without vector instructions,
# which take minutes to compile with all that a fuzzer counts: tests/fuzz_cases.rs has the same checks with them.
step_fuzz() (
    cd fuzz
    export RUSTC_BOOTSTRAP=1
    released build --release --config 'build.rustflags=["--cfg=raykern_portable"]'
    findings=$(mktemp -d)
    for target in mesh ray block; do
        echo "-- $target"
        if ! "target/x86_64-unknown-linux-gnu/release/$target" "-artifact_prefix=$findings/" \
            -max_total_time=10 -max_len=2048 -len_control=0 -timeout=10 >"$findings/log" 2>&1; then
            grep -a -A2 panicked "$findings/log" || tail -n 40 "$findings/log"
            echo "a finding: fuzz/README.md, with the input in $findings" >&2
            exit 1
        fi
        tail -n 1 "$findings/log"
    done
)

# A million rays a scene against Embree, every difference judged exactly.
step_embree() {
    released test --release -p raykern-harness --features embree,raykern/capi --test compare_embree -- --nocapture
}

# Rays that look for trouble, all answers judged exactly; Embree on the same rays.
step_stress() {
    released run --release -p raykern-harness --features raykern/capi --bin stress -- --rays 200000 --embree
}

# The main job, cut short.
step_compare() { released run --release --features capi --example compare -- --runs 2 --budget 20 --out target/compare-check; }

# The comparison with Embree, cut short: its answers are checked, its times mean nothing here.
step_bench() { released run --release -p raykern-bench --features embree -- --quick; }

# Every method on ordinary rays and stress families, every answer judged, and the page.
step_report() {
    released run --release -p raykern-bench --features embree --bin report -- --quick --out target/report-check
}

steps=(install format clippy build test backends docs header c targets fuzz embree stress compare bench report)
case ${1:-} in
'') ;;
all) steps=("${steps[@]/#targets/all_targets}") ;;
*) steps=("$@") ;;
esac
for step in "${steps[@]}"; do
    started=$SECONDS
    echo "== $step"
    "step_$step"
    echo "== $step: $((SECONDS - started)) s"
done
