#!/usr/bin/env bash
# Builds and runs the library for other processors, in emulators. Installs what it needs (Debian packages by name).
#
#   targets/run.sh short          one microcontroller, one big-endian processor, WebAssembly
#   targets/run.sh all            every target
#   targets/run.sh NAME ...       some: see the table below
#   targets/run.sh --write ...    the same, and the costs that are measured become those that are committed
#
# Another compiler than Debian's, one whose rustup has the targets: CARGO_FOR_TARGETS="cargo" targets/run.sh ...
set -euo pipefail
shopt -s inherit_errexit
cd "$(dirname "$0")"
work=${CARGO_TARGET_DIR:-$PWD/../target}/targets
export CARGO_TERM_COLOR=never
mkdir -p "$work"

# name     kind  Rust target                     C compiler and flags, emulator
table='
m0         arm   thumbv6m-none-eabi              -mcpu=cortex-m0                                      microbit
m3         arm   thumbv7m-none-eabi              -mcpu=cortex-m3                                      mps2-an385
m4f        arm   thumbv7em-none-eabihf           -mcpu=cortex-m4,-mfloat-abi=hard,-mfpu=fpv4-sp-d16   mps2-an386
m7         arm   thumbv7em-none-eabihf           -mcpu=cortex-m7,-mfloat-abi=hard,-mfpu=fpv5-sp-d16   mps2-an500
rv32imac   riscv riscv32imac-unknown-none-elf    -march=rv32imac,-mabi=ilp32                          virt
rv32imafc  riscv riscv32imafc-unknown-none-elf   -march=rv32imafc,-mabi=ilp32f                        virt
x86_64     bare  x86_64-unknown-linux-gnu        gcc                                                  -
i686       user  i686-unknown-linux-gnu          i686-linux-gnu-gcc                                   -
armv7      user  armv7-unknown-linux-gnueabihf   arm-linux-gnueabihf-gcc                              qemu-arm
aarch64    user  aarch64-unknown-linux-gnu       aarch64-linux-gnu-gcc                                qemu-aarch64
powerpc    user  powerpc-unknown-linux-gnu       powerpc-linux-gnu-gcc                                qemu-ppc
powerpc64  user  powerpc64-unknown-linux-gnu     powerpc64-linux-gnu-gcc                              qemu-ppc64
wasm       wasm  wasm32-unknown-unknown          -                                                    node
wasm128    wasm  wasm32-unknown-unknown          -C,target-feature=+simd128                           node
page       page  wasm32-unknown-unknown          -                                                    chromium
'

# install COMMAND PACKAGE ...: the packages, if the command is missing.
install() {
    local command=$1
    shift
    ! command -v "$command" >/dev/null && ! [ -e "$command" ] || return 0
    local sudo=()
    [ "$(id -u)" -eq 0 ] || sudo=(sudo)
    [ -e "$work/updated" ] || "${sudo[@]}" apt-get update -qq
    touch "$work/updated"
    "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >/dev/null
}

# A compiler with the sources of its library, which rustup does not have everywhere; only that takes RUSTC_BOOTSTRAP.
cargo_for() {
    if [ -n "${CARGO_FOR_TARGETS:-}" ]; then
        $CARGO_FOR_TARGETS "$@"
    else
        install /usr/bin/rustc rustc-web
        install /usr/bin/cargo cargo-web
        install /usr/lib/rustlib/src/rust/library/core/Cargo.toml rust-web-src
        RUSTC=/usr/bin/rustc RUSTC_BOOTSTRAP=1 /usr/bin/cargo "$1" -Zbuild-std=core "${@:2}"
    fi
}

# library TARGET FEATURES [PANICS [PROFILE]]: where libraykern.a is, with these kinds of blocks. A program that could panic does not link,
# unless PANICS is `freestanding`: microcontrollers are held to that.
library() {
    local panics=${3:-panic-free} profile=${4:-embedded}
    local folder=$work/lib
    local archive=$folder/$1-$panics-${2//,/-}.a
    (cd .. && CARGO_TARGET_DIR=$folder cargo_for rustc -q --locked -p raykern-c --profile "$profile" \
        --no-default-features --features "$panics${2:+,$2}" --target "$1" --crate-type staticlib) >&2
    # The next one, with other features, takes its place.
    cp "$folder/$1/$profile/libraykern.a" "$archive"
    echo "$archive"
}

# agree TARGET KIND FLAGS: where the crate `agree` is.
agree() {
    local folder=$work/lib flags=${3:-}
    # The flags are for the library as well, not for the last crate alone.
    RUSTFLAGS=${flags//,/ } CARGO_TARGET_DIR=$folder cargo_for rustc -q --locked --manifest-path agree/Cargo.toml \
        --profile emulated --target "$1" --crate-type "$2" >&2
    echo "$folder/$1/emulated"
}

# What is not a measurement must be what is committed.
same() { # expected, printed
    if ! diff <(grep -v '^#' "$2") "$1" >&2; then
        echo "$name: this is not what $1 says" >&2
        return 1
    fi
}

# A measurement must not be above the committed one by more than a fiftieth. Less is good news: --write keeps it.
cost() { # what, number
    printf '%-10s %-22s %9d\n' "$name" "$1" "$2" | tee -a "$work/costs"
    [ -z "$write" ] || return 0
    local most
    most=$(awk -v n="$name" -v w="$1" '$1 == n && $2 == w { print $3 + int($3 / 50) }' costs.txt)
    if [ -z "$most" ] || [ "$2" -gt "$most" ]; then
        echo "$name: $1 is $2, and ${most:-no number} is allowed by targets/costs.txt" >&2
        return 1
    fi
}

# size PREFIX ARCHIVE WHAT ENTRY ...: the bytes that a program pays for these entry points, and that no variables are among them.
size() {
    local what=$3 text data bss
    links "$1" "$2" "${@:4}"
    read -r text data bss _ < <("$1size" "$work/links.elf" | tail -1)
    if [ $((data + bss)) -ne 0 ]; then
        echo "$name: there are variables: $data + $bss bytes" >&2
        return 1
    fi
    cost "flash-$what" "$text"
}

# cannot_panic PREFIX TARGET: links whatever cannot panic: all entry points, of libraries that build no grids and no bundles; with grids,
# queries; and sees a program that could.
cannot_panic() {
    local all ask=(rt_accel_open rt_intersect rt_occluded rt_intersect_watertight rt_occluded_watertight rt_intersect_with rt_occluded_with)
    mapfile -t all < <(grep -o 'rt_[a-z_]*(' ../include/raykern.h | tr -d '(' | sort -u)
    links "$1" "$(library "$2" "")" "${all[@]}"
    links "$1" "$(library "$2" spheres,instances,refit)" "${all[@]}"
    links "$1" "$(library "$2" grid)" "${ask[@]}"
    if links "$1" "$(library "$2" grid)" rt_build_grid 2>/dev/null; then
        echo "$name: builds of grids cannot panic: hold them to it" >&2
        return 1
    fi
}

# links PREFIX ARCHIVE ENTRY ...: whether these entry points do, with all they call.
links() {
    local gcc=$1gcc archive=$2
    shift 2
    "$gcc" "${flags[@]}" -nostdlib -Wl,--gc-sections -Wl,-e,"$1" "${@/#rt_/-Wl,-u,rt_}" "$archive" -lgcc -o "$work/links.elf"
}

# program PREFIX ARCHIVE BOARD NAME: a C program without a C library for a board; where it is.
program() {
    local image=$work/$name-$4.elf
    "$1gcc" "${flags[@]}" "${memory[@]}" -std=c11 -Os -ffreestanding -ffp-contract=off -fno-common -Wall -Wextra -Werror \
        -ffunction-sections -fdata-sections -nostdlib -Wl,--gc-sections -Wl,--build-id=none -z noexecstack -T board/board.ld \
        -I ../include -I board "board/$3.c" "programs/$4.c" "$2" -lgcc -o "$image"
    echo "$image"
}

# What a board has for a program: flash at 0 or where the emulator starts, and RAM.
board_memory() { # program
    case $name in
    rv*) defsym __flash=0x80000000 __flash_size=0x100000 __ram=0x80100000 __ram_size=0x20000 ;;
    m0)
        defsym __flash=0 __flash_size=0x40000 __ram=0x20000000 __ram_size=0x4000
        # Others take more memory than it has; another board runs the same instructions.
        [ "$1" = picture ] || { emulator=(qemu-system-arm -M mps2-an385) && defsym "${large[@]}"; }
        ;;
    *) defsym "${large[@]}" ;;
    esac
}
large=(__flash=0 __flash_size=0x100000 __ram=0x20000000 __ram_size=0x20000)
defsym() { memory=("${@/#/-Wl,--defsym=}"); }

run_board() { # image, what it printed goes to
    timeout 120 "${emulator[@]}" -icount shift=0 -display none -serial none -monitor none -chardev stdio,id=console \
        -semihosting-config enable=on,target=native,chardev=console -kernel "$1" </dev/null >"$2"
}

board() { # prefix, Rust target, board
    local small kinds printed=$work/$name.txt image
    local part what number archive
    small=$(library "$2" "")
    kinds=$(library "$2" spheres,instances)
    for part in picture core kinds; do
        board_memory "$part"
        archive=$small
        [ "$part" != kinds ] || archive=$kinds
        image=$(program "$1" "$archive" "$3" "$part")
        run_board "$image" "$printed" || { cat "$printed" >&2; return 1; }
        same "$part.txt" "$printed"
        while read -r _ what number; do
            cost "$part-$what" "$number"
        done < <(grep '^#' "$printed")
    done
    # Asked of one board for all.
    [ "$name" != m4f ] || cannot_panic "$1" "$2"
    [ "$name" != m4f ] || size "$1" "$kinds" kinds rt_accel_open rt_intersect rt_occluded
    [ "$name" != m4f ] || size "$1" "$(library "$2" grid)" grids rt_accel_open rt_intersect rt_occluded
    size "$1" "$small" queries rt_accel_open rt_intersect rt_occluded
    size "$1" "$small" watertight rt_accel_open rt_intersect_watertight rt_occluded_watertight
    size "$1" "$small" choices rt_accel_open rt_intersect_with rt_occluded_with
    size "$1" "$small" build rt_build_bvh rt_bvh_needs
    size "$1" "$small" build-and-queries rt_build_bvh rt_bvh_needs rt_accel_open rt_intersect rt_occluded
}

arm() { # Rust target, flags, machine
    install arm-none-eabi-gcc gcc-arm-none-eabi
    install qemu-system-arm qemu-system-arm
    # SysTick of the micro:bit counts at 16 MHz, that of the others at 25.
    local tick=40
    [ "$3" != microbit ] || tick=62
    read -r -a flags <<<"-mthumb ${2//,/ } -DTICK=$tick"
    emulator=(qemu-system-arm -M "$3")
    board arm-none-eabi- "$1" cortex_m
    # No circle of calls, and the deepest chain whether it was taken or not. The M0 has frames that are not told from constants.
    install python3 python3
    local chain
    chain=$(python3 calls.py arm-none-eabi-objdump "$work/$name-picture.elf" rt_accel_open rt_intersect rt_occluded \
        2>"$work/chain.txt") || { cat "$work/chain.txt" >&2; return 1; }
    [ "$name" = m0 ] || cost picture-chain "$chain"
}

riscv() {
    install riscv64-unknown-elf-gcc gcc-riscv64-unknown-elf
    install qemu-system-riscv32 qemu-system-misc
    read -r -a flags <<<"${2//,/ }"
    emulator=(qemu-system-riscv32 -M "$3" -bios none)
    board riscv64-unknown-elf- "$1" riscv
}

# No libc, no libm, no start-up files, and nothing left to look up. On another processor than this there is nothing to run.
bare() { # Rust target, C compiler
    [ "$(uname -m)" = "$name" ] || return 0
    install "$2" gcc
    local image=$work/$name.elf small
    small=$(library "$1" "" freestanding)
    "$2" -std=c11 -Os -ffreestanding -fno-builtin -fno-stack-protector -nostdlib -nostartfiles -static -no-pie \
        -Wall -Wextra -Werror -Wl,--gc-sections -I ../include ../c_tests/freestanding.c "$small" -o "$image"
    "$image"
    cost text "$(command size "$image" | awk 'NR == 2 { print $1 }')"
}

user() { # Rust target, C compiler, emulator
    local arch=$2
    case $arch in
    i686*) install "$2" gcc-i686-linux-gnu libc6-dev-i386-cross ;;
    arm-*) install "$2" gcc-arm-linux-gnueabihf libc6-dev-armhf-cross ;;
    aarch64*) install "$2" gcc-aarch64-linux-gnu libc6-dev-arm64-cross ;;
    powerpc-*) install "$2" gcc-powerpc-linux-gnu libc6-dev-powerpc-cross ;;
    powerpc64*) install "$2" gcc-powerpc64-linux-gnu libc6-dev-ppc64-cross ;;
    esac
    [ "$3" = - ] || install "$3" qemu-user
    # The x87 keeps more than a float has.
    local sse=()
    [[ $arch != i686* ]] || sse=(-msse2 -mfpmath=sse)
    local folder image=$work/$name.elf small
    folder=$(agree "$1" staticlib)
    "$2" -O1 "${sse[@]}" -static -I board programs/agree.c board/host.c "$folder/libagree.a" -o "$image"
    native() { if [ "$emulator" = - ]; then "$@"; else "$emulator" "$@"; fi; }
    emulator=$3
    native "$image" >"$work/$name.txt" || { cat "$work/$name.txt" >&2; return 1; }
    same agree.txt "$work/$name.txt"
    # A block of the other byte order is refused; the others give the picture.
    small=$(library "$1" "" freestanding emulated)
    "$2" -O1 "${sse[@]}" -static -ffp-contract=off -I ../include -I board programs/picture.c board/host.c "$small" -o "$image"
    native "$image" >"$work/$name.txt"
    case $name in
    powerpc*) same refused.txt "$work/$name.txt" ;;
    *) same picture.txt "$work/$name.txt" ;;
    esac
}

wasm() { # Rust target, Rust flags
    install wasm-ld lld
    install node nodejs
    local folder rust="-C,linker=wasm-ld"
    [ "$2" = - ] || rust+=",$2"
    folder=$(agree "$1" cdylib "$rust")
    node wasm.mjs "$folder/agree.wasm" >"$work/$name.txt" || { cat "$work/$name.txt" >&2; return 1; }
    same agree.txt "$work/$name.txt"
}

# module NAME FEATURES: one of the page's modules, beside the page.
module() {
    local folder=$work/page
    CARGO_TARGET_DIR=$folder cargo_for rustc -q --locked --manifest-path ../examples/wasm/Cargo.toml --release \
        --no-default-features --features "$2" --target "$target" -- -C linker=wasm-ld >&2
    # Takes off a tenth; what it may use is what every browser has known for years, and the compiler uses.
    wasm-opt -Oz --enable-bulk-memory --enable-sign-ext --enable-nontrapping-float-to-int --enable-mutable-globals \
        --enable-reference-types --enable-multivalue "$folder/$target/release/page.wasm" -o "../examples/wasm/$1.wasm"
    cost "$1-bytes" "$(wc -c <"../examples/wasm/$1.wasm")"
}

# The page of examples/wasm, and what it shows.
page() { # Rust target, -, browser
    install wasm-ld lld
    install wasm-opt binaryen
    install node nodejs
    module page trace
    module build build
    node ../examples/wasm/bake.js
    [ -z "${PAGE_ONLY:-}" ] || return 0
    install "$3" chromium
    node page.mjs ../examples/wasm "$3" scene.obj "$work/page.png"
}

write=
[ "${1:-}" != --write ] || { write=yes; shift; }
case ${1:-short} in
short) set -- m4f powerpc64 wasm ;;
all) set -- $(awk 'NF { print $1 }' <<<"$table") ;;
esac
: >"$work/costs"
for name in "$@"; do
    read -r _ kind target how machine < <(grep "^$name " <<<"$table") || { echo "no target $name" >&2; exit 2; }
    started=$SECONDS
    "$kind" "$target" "$how" "$machine"
    echo "$name: $((SECONDS - started)) s"
done
if [ -n "$write" ]; then
    # Those of targets that were not run stay.
    awk 'NR == FNR { run[$1]; print; next } !($1 in run)' "$work/costs" costs.txt | sort >"$work/new-costs"
    mv "$work/new-costs" costs.txt
fi
