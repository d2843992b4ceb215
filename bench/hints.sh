#!/bin/sh
# What a good hint is worth: scenes/sequin.pbrt with and without scenes/sequin.hints.json, 10 s each, against a long run.
# Usage: bench/hints.sh [DIR]; pictures go to DIR (default: hints). About a minute and a half on two cores.
set -eu
hemilux="${HEMILUX:-target/release/hemilux}"
dir="${1:-hints}"
mkdir -p "$dir"
scene=scenes/sequin.pbrt
"$hemilux" render "$scene" --hints scenes/sequin.hints.json --seed 99 --spp "${SPP:-64}" -q -o "$dir/reference.exr" -o "$dir/reference.png"
"$hemilux" render "$scene" --time "${TIME:-10s}" -o "$dir/without.exr" -o "$dir/without.png"
"$hemilux" render "$scene" --time "${TIME:-10s}" --hints scenes/sequin.hints.json --report "$dir/with.json" \
    -o "$dir/with.exr" -o "$dir/with.png"
for which in without with; do
    echo "## $which"
    "$hemilux" image diff "$dir/$which.exr" "$dir/reference.exr"
done
