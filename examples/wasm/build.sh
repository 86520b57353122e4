#!/usr/bin/env bash
# Builds page.wasm, beside the page. Then any file server shows it: python3 -m http.server
#
# With the target of rustup this is all there is to do, apart from the copy:
#   cargo build --release --target wasm32-unknown-unknown
set -euo pipefail
cd "$(dirname "$0")"
PAGE_ONLY=yes exec ../../targets/run.sh page
