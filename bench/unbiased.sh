#!/usr/bin/env bash
# Whether gathers over frozen zones have the right mean in every pixel, with a control that must be found out:
#   bench/unbiased.sh SCENES_DIRECTORY [option=value]...
# 200 renders of 32 x 24 pixels of each scene against a long run; see crates/hemilux/examples/unbiased.rs. Where plain points converge they
# make the long run; where they do not (bulb, skylight), gathers led by other particles do.
set -euo pipefail
scenes=$1
shift
cd "$(dirname "$0")/.."
cargo build --release --quiet -p hemilux --features wrong-physics --example unbiased
for name in box office varnish; do
    target/release/examples/unbiased "$scenes/$name/$name.pbrt" by=sobol "$@"
done
for name in bulb skylight; do
    target/release/examples/unbiased "$scenes/$name/$name.pbrt" by=other "$@"
done
