#!/usr/bin/env bash
# The scenes of docs/failures.md, each read at one point by gathering and by path tracing: bench/failures.sh [TIME]
# TIME (default 20s) is spent on every reading. One line each: irradiance (W/m2) and 95 % half-width.
set -euo pipefail
cd "$(dirname "$0")/.."
time=${1:-20s}
cargo build --release --quiet -p hemilux-cli
read_point() {
    local scene=$1 point=$2
    for mode in zonal path; do
        printf '%-20s %-6s ' "$scene" "$mode"
        echo "$point" | target/release/hemilux sense "bench/failures/$scene.pbrt" --mode "$mode" --quantity irradiance --ci \
            --time "$time" --quiet
    done
}
read_point glitter "0 0.6 0.01 0 0 1"
read_point caustic-of-caustic "0 0.6 0.01 0 0 1"
read_point keyhole "0.34 0.5 0.01 0 0 1"
read_point bumpy-mirror "0 0.6 0.01 0 0 1"
read_point texels "0 0 0.01 0 0 1"
read_point frosted "0 0.2 0.01 0 0 1"
read_point shadow-edge "0 0 0.05 0 0 -1"
read_point range "0.6 -0.3 0.01 0 0 1"
