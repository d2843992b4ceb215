#!/bin/sh
# Strategy x rays x error x bias x time at one point of three scenes, each against a long run: the table of docs/strategies.md on
# standard output. Runs are timed one after another. About a minute on a quiet machine.
# Usage: bench/strategies.sh [DIR]; pictures, JSON and all levels of rays go to DIR (default: strategies).
set -eu
hemilux="${HEMILUX:-target/release/hemilux}"
dir="${1:-strategies}"
mkdir -p "$dir"
probe() {
    name="$1"; shift
    "$hemilux" probe "$@" --compare all --runs 100 --gathers 20000 --zone-budget 20000 --particles 1M \
        -o "$dir/$name.svg" -o "$dir/$name.json" > "$dir/$name.txt" 2>/dev/null
}
probe wall-mirror scenes/mirror-room.pbrt --pixel 300,60
probe dome scenes/dome.rad --point "1 0 0 0 0 1"
probe varnish scenes/varnish-table.pbrt --point "0.1 0.05 1.3 0 0 -1"
python3 bench/strategies_table.py "$dir" wall-mirror dome varnish
