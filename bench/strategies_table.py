#!/usr/bin/env python3
"""The table of docs/strategies.md from what `hemilux probe --compare all -o NAME.json` wrote.

Usage: bench/strategies_table.py [--no-time] [--into FILE] DIR wall-mirror dome varnish
Rays, error and time are those of 256 and 1024 gather rays asked for; bias that of 1024, with its 95 % interval.
--into replaces the table in FILE (the one that begins with "| strategy | biased |") instead of printing it.
"""

import argparse
import json


def percent(x):
    return f"{100 * x:.{0 if x >= 0.2 else 1}f} %"


def cells(compared, timed):
    levels = {level["asked"]: level for level in compared["levels"]}
    a, b = levels[256], levels[1024]
    rays = f"{a['rays']:.0f} / {b['rays']:.0f}"
    error = f"{percent(a['relative_rmse'])} / {percent(b['relative_rmse'])}"
    bias = f"{100 * b['relative_bias']:+.1f} ± {196 * b['bias_standard_error']:.1f} %"
    time = f"{1e3 * a['time_s']:.2f} / {1e3 * b['time_s']:.2f} ms"
    return [rays, error, bias] + ([time] if timed else [])


def table(directory, names, timed):
    found = [json.load(open(f"{directory}/{name}.json"))["compared"] for name in names]
    heads = [f"{name}: rays | error | bias" + (" | time" if timed else "") for name in names]
    lines = ["| strategy | biased | " + " | ".join(heads) + " |"]
    lines.append("| --- | --- |" + " --- |" * ((4 if timed else 3) * len(names)))
    for rows in zip(*found):
        run = rows[0]["run"]
        row = [f"`{run['strategy']}`", "yes" if run["biased"] else "no"]
        lines.append("| " + " | ".join(row + [c for r in rows for c in cells(r, timed)]) + " |")
    return lines


def main():
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("--no-time", action="store_true")
    words.add_argument("--into")
    words.add_argument("directory")
    words.add_argument("names", nargs="+")
    args = words.parse_args()
    lines = table(args.directory, args.names, not args.no_time)
    if not args.into:
        print("\n".join(lines))
        return
    old = open(args.into).read().split("\n")
    first = next(i for i, line in enumerate(old) if line.startswith("| strategy | biased |"))
    last = next(i for i in range(first, len(old)) if not old[i].startswith("|"))
    with open(args.into, "w") as out:
        out.write("\n".join(old[:first] + lines + old[last:]))


main()
