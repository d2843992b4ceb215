#!/bin/sh
# Fuzz each importer for the given number of seconds (default 60) on stable Rust. Finds land in fuzz/artifacts.
# Needs a C++ compiler: libfuzzer-sys builds libFuzzer from source.
set -eu
cd "$(dirname "$0")"
seconds=${1:-60}
export RUSTFLAGS="-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
-Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
-Cllvm-args=-sanitizer-coverage-trace-compares --cfg fuzzing -Ccodegen-units=1"
# The target triple keeps the flags away from build scripts.
host=$(rustc -vV | sed -n 's/^host: //p')
cargo build --release --target "$host" -j "${JOBS:-2}"
for target in ${TARGETS:-pbrt ply rad vf}; do
    mkdir -p "corpus/$target" "artifacts/$target"
    dict=""
    [ -f "seeds/$target.dict" ] && dict="-dict=seeds/$target.dict"
    # shellcheck disable=SC2086
    "target/$host/release/$target" "corpus/$target" "seeds/$target" $dict \
        -max_total_time="$seconds" -max_len=4096 -timeout=10 -rss_limit_mb=2048 -print_final_stats=1 \
        -artifact_prefix="artifacts/$target/"
done
