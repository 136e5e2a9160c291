#!/usr/bin/env bash
# Renders the demo, a caustic seen in a glossy mirror, and says where the image is.
#
#   scripts/demo.sh [further arguments of `hrr render`]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

features=()
if ! scripts/setup.sh; then
    echo "demo: going on with the pure-Rust build" >&2
    features=(--no-default-features)
fi
cargo run --release "${features[@]}" -- render scenes/caustic_mirror/scene.toml \
    -o caustic_mirror.exr -o caustic_mirror.png "$@"
echo "demo: the image is $PWD/caustic_mirror.png (and, with all its range, $PWD/caustic_mirror.exr)" >&2
