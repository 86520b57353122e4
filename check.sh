#!/usr/bin/env bash
# Everything that must hold before a change lands. Needs Rust and a C compiler; installs the rest
# (Debian packages by name). A quarter of an hour on two idle cores.
#
#   ./check.sh            all of it, but for most of the other processors
#   ./check.sh all        these too
#   ./check.sh STEP ...   some of it: format clippy build test backends docs header c targets fuzz embree stress compare
#                         bench report, or all_targets
set -euo pipefail
cd "$(dirname "$0")"
export CARGO_TERM_COLOR=never
# Nothing here is compiled a second time, and what that would be faster by fills the disk; so do line numbers.
export CARGO_INCREMENTAL=0 CARGO_PROFILE_TEST_DEBUG=false CARGO_PROFILE_RELEASE_DEBUG=false
built=$(realpath -m "${CARGO_TARGET_DIR:-target}")

# The core is compiled twice for this machine: with assertions for the tests and the C programs, and as it is released for the C library
# and the tools. It would be once more, which takes minutes, if two steps asked for other features or profiles of any crate.
all=(--workspace --features raykern/capi)
tools=(-p raykern-harness -p raykern-bench --features raykern-bench/embree)

# Optimised as programs are, but by all cores: this takes half as long, and what is measured here means nothing.
released() { CARGO_PROFILE_RELEASE_CODEGEN_UNITS=16 cargo "$@"; }

# One of the programs.
tool() {
    released build --release "${tools[@]}" --bins
    "$built/release/$1" "${@:2}"
}

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
    cargo clippy "${all[@]}" --all-targets -- -D warnings
    cargo clippy -p raykern --lib -- -D warnings
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

# Each fuzz target from nothing, as many inputs as take it ten seconds on a core of its own; fuzz/README.md says how to run them for
# longer. An input may take 30 seconds here, where a core is shared. Without vector instructions, which take minutes to compile with all
# that a fuzzer counts: tests/fuzz_cases.rs has the same checks with them.
step_fuzz() (
    export RUSTC_BOOTSTRAP=1 CARGO_TARGET_DIR=$built/fuzz
    cd fuzz
    released build --release --config 'build.rustflags=["--cfg=raykern_portable"]'
    findings=$(mktemp -d)
    # One that runs out of time ends without an error, but with fewer inputs.
    hunt() { # target, inputs
        "$CARGO_TARGET_DIR/x86_64-unknown-linux-gnu/release/$1" "-artifact_prefix=$findings/" "-runs=$2" \
            -max_total_time=300 -max_len=2048 -len_control=0 -timeout=30 >"$findings/$1.log" 2>&1 &&
            grep -aq "^Done $2 runs" "$findings/$1.log"
    }
    hunt mesh 4000 & mesh=$!
    hunt ray 1300 & ray=$!
    hunt block 5000 & block=$!
    found=
    for target in mesh ray block; do
        echo "-- $target"
        if wait "${!target}"; then
            tail -n 1 "$findings/$target.log"
        else
            grep -a -A2 panicked "$findings/$target.log" || tail -n 40 "$findings/$target.log"
            found=yes
        fi
    done
    if [ -n "$found" ]; then
        echo "a finding: fuzz/README.md, with the input in $findings" >&2
        exit 1
    fi
    rm -r "$findings"
)

# A million rays a scene through the released C library and through Embree, every difference judged exactly.
step_embree() {
    CARGO_PROFILE_RELEASE_CODEGEN_UNITS=16 cargo test "${all[@]}" --test compare_embree -- --ignored --nocapture
}

# Rays that look for trouble, all answers judged exactly; Embree on the same rays.
step_stress() { tool stress --rays 150000 --embree; }

# The main job, cut short.
step_compare() {
    cargo build --profile test "${all[@]}" --example compare
    "$built/debug/examples/compare" --runs 2 --budget 20 --out "$built/compare-check"
}

# The comparison with Embree, cut short: its answers are checked, its times mean nothing here.
step_bench() {
    tool raykern-bench --quick
    tool raykern-bench --builds --quick --runs 1
}

# Every method on ordinary rays and stress families, every answer judged, and the page.
step_report() { tool report --quick --out "$built/report-check"; }

steps=(install format clippy build test backends docs header c targets fuzz embree stress compare bench report)
case ${1:-} in
'') ;;
all) steps=("${steps[@]/#targets/all_targets}") ;;
*) steps=("$@") ;;
esac

run_steps() {
    local step started
    for step in "$@"; do
        started=$SECONDS
        echo "== $step"
        "step_$step"
        echo "== $step: $((SECONDS - started)) s"
    done
}

# These have compilers and folders of their own, and much in them is for one core alone: they fill the gaps of the others.
aside=() rest=()
for step in "${steps[@]}"; do
    case $step in
    targets | all_targets | fuzz) aside+=("$step") ;;
    *) rest+=("$step") ;;
    esac
done
# Before anything else installs anything.
[ "${rest[0]:-}" != install ] || { run_steps install; rest=("${rest[@]:1}"); }
if [ ${#aside[@]} -eq 0 ] || [ ${#rest[@]} -eq 0 ]; then
    run_steps "${rest[@]}" "${aside[@]}"
    exit
fi

printed=$(mktemp)
echo "== ${aside[*]}: aside, printed when all of it is done"
# In a process group of its own, so that none of it outlives this script.
set -m
{
    renice -n 5 "$BASHPID" >/dev/null
    run_steps "${aside[@]}"
} >"$printed" 2>&1 &
aside_group=$!
set +m
trap 'kill -- "-$aside_group" 2>/dev/null || true; rm -f "$printed"' EXIT

# Waits for it; prints it whole, and fails if it failed.
join_aside() {
    local status=0
    wait "$aside_group" || status=$?
    trap - EXIT
    cat "$printed"
    rm "$printed"
    [ "$status" -eq 0 ] || echo "failed: ${aside[*]}" >&2
    return "$status"
}

for step in "${rest[@]}"; do
    run_steps "$step"
    # A failure there is told at once.
    [ ! -e "$printed" ] || kill -0 "$aside_group" 2>/dev/null || join_aside
done
[ ! -e "$printed" ] || join_aside
echo "all of it: $SECONDS s"
