#!/usr/bin/env bash
# Mode corrected against mode path at equal time, on scenes with references, one after the other in one run:
#   bench/corrected.sh SCENES_DIRECTORY [seconds=60] [option=value]...
# Prints relMSE (and without the worst 0.1 % of pixels) of both; corrected includes zones, particles and the study of its residuals.
set -euo pipefail
scenes=$1
shift
cd "$(dirname "$0")/.."
cargo build --release --quiet -p hemilux --example equal_time
for name in bulb varnish; do
    target/release/examples/equal_time "$scenes/$name/$name.pbrt" "$scenes/$name/reference.exr" "$@" modes=path,corrected seconds=60
done
