#!/usr/bin/env bash
# Builds what the page fetches, beside it. Then any file server shows it: python3 -m http.server
#
# With the target of rustup this is all there is to do, apart from the copies:
#   cargo build --release --target wasm32-unknown-unknown                                          # page.wasm
#   cargo build --release --target wasm32-unknown-unknown --no-default-features --features build   # build.wasm
#   node bake.js
set -euo pipefail
cd "$(dirname "$0")"
PAGE_ONLY=yes exec ../../targets/run.sh page
