#!/usr/bin/env python3
"""The table of docs/strategies.md from what `hemilux probe --compare all -o NAME.json` wrote.

Usage: bench/strategies_table.py DIR wall-mirror dome varnish
Rays, error and time are those of 256 and 1024 gather rays asked for; bias that of 1024, with its 95 % interval.
"""

import json
import sys


def percent(x, signed=False):
    digits = 0 if abs(x) >= 0.2 and not signed else 1
    return f"{100 * x:{'+' if signed else ''}.{digits}f} %"


def cells(compared):
    levels = {level["asked"]: level for level in compared["levels"]}
    a, b = levels[256], levels[1024]
    rays = f"{a['rays']:.0f} / {b['rays']:.0f}"
    error = f"{percent(a['relative_rmse'])} / {percent(b['relative_rmse'])}"
    bias = f"{100 * b['relative_bias']:+.1f} ± {196 * b['bias_standard_error']:.1f} %"
    time = f"{1e3 * a['time_s']:.2f} / {1e3 * b['time_s']:.2f} ms"
    return [rays, error, bias, time]


def main():
    directory, names = sys.argv[1], sys.argv[2:]
    found = [json.load(open(f"{directory}/{name}.json"))["compared"] for name in names]
    heads = [f"{name}: rays | error | bias | time" for name in names]
    print("| strategy | biased | " + " | ".join(heads) + " |")
    print("| --- | --- |" + " --- |" * (4 * len(names)))
    for rows in zip(*found):
        run = rows[0]["run"]
        row = [f"`{run['strategy']}`", "yes" if run["biased"] else "no"]
        print("| " + " | ".join(row + [c for r in rows for c in cells(r)]) + " |")


main()
