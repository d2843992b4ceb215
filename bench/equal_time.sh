#!/usr/bin/env bash
# Error against time of the modes on scenes with references, one after the other in one run:
#   bench/equal_time.sh SCENES_DIRECTORY [seconds]
# SCENES_DIRECTORY holds NAME/NAME.pbrt with NAME/reference.exr (and halves, mask), and public/NAME/scene.pbrt likewise.
set -euo pipefail
scenes=$1 seconds=${2:-10}
cd "$(dirname "$0")/.."
cargo build --release --quiet -p hemilux --example equal_time
run() { target/release/examples/equal_time "$@" seconds="$seconds"; }
for name in box office varnish skylight bulb; do
    run "$scenes/$name/$name.pbrt" "$scenes/$name/reference.exr"
done
run "$scenes/public/cornell-box/scene.pbrt" "$scenes/public/cornell-box/reference.exr" depth=file
