#!/bin/sh
# Strategy x rays x error x bias x time at one point of three scenes, each against a long run: the tables of docs/strategies.md.
# Usage: bench/strategies.sh [DIR]; pictures go to DIR (default: strategies).
set -eu
hemilux="${HEMILUX:-target/release/hemilux}"
dir="${1:-strategies}"
mkdir -p "$dir"
probe() {
    name="$1"; shift
    echo "## $name"
    echo
    "$hemilux" probe "$@" --compare all --runs 100 --gathers 20000 --zone-budget 20000 --particles 1M \
        -o "$dir/$name.svg" -o "$dir/$name.json" 2>/dev/null
    echo
}
probe wall-mirror scenes/mirror-room.pbrt --pixel 300,60
probe dome scenes/dome.rad --point "1 0 0 0 0 1"
probe varnish scenes/varnish-table.pbrt --point "0.1 0.05 1.3 0 0 -1"
