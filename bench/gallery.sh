#!/usr/bin/env bash
# Renders the scenes of docs/gallery.md into docs/images: bench/gallery.sh [SECONDSs [SCENE...]]
#   bench/gallery.sh 60s                 all of them, a minute each
#   bench/gallery.sh 30s fountain        one
# The pictures differ a little from run to run, since the number of samples follows the clock.
set -euo pipefail
cd "$(dirname "$0")/.."
time=${1:-60s}
shift || true
scenes=("$@")
if [ ${#scenes[@]} -eq 0 ]; then
    scenes=(varnish dew-pane dew-grass fountain skylight reflector halogen displaced)
fi
cargo build --release --quiet -p hemilux-cli
for scene in "${scenes[@]}"; do
    if [ "$scene" = displaced ]; then
        cargo run --release --quiet -p hemilux --example displaced -- docs/images/gallery-displaced.png "$time"
        continue
    fi
    target/release/hemilux render "scenes/$scene.pbrt" --size 320x240 --time "$time" -o "docs/images/gallery-$scene.png"
done
