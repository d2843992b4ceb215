#!/usr/bin/env python3
"""Illuminance by `hemilux sense` against Radiance's `rtrace -I`, scene by scene and sensor by sensor.

    compare.py SCENES_DIR --hemilux BINARY --radiance BIN_DIR [--lib DIR] [--only WORD]

Every X.rad in SCENES_DIR with an X.pts beside it is a case. The .pts file holds sensors (x y z nx ny nz) and, in a
comment `# rtrace: ...`, the options of rtrace that depend on the scene (the ambient bounces). rtrace is run at high
settings without ambient cache or interpolation, and every sensor is repeated in one run (the random numbers go on from
one sensor to the next, so that the answers are independent), more of them until the standard error is below the
target. Both sides give lux: 179 (0.265 R + 0.670 G + 0.065 B).

`within` asks whether the difference is less than the 95 % half-width of hemilux, widened by 1.96 standard errors of
rtrace (in quadrature). Exit code 1 if any sensor is more than the tolerance away.
"""

import argparse
import math
import os
import pathlib
import subprocess
import sys
import tempfile

SETTINGS = (
    "-h -I -faa -u+ -ad 4096 -as 0 -aa 0 -ds 0.02 -dj 1 -dt 0 -dc 1 -dr 3 -st 0 -ss 1 -lr 40 -lw 1e-12"
).split()
WEIGHTS = (179 * 0.265, 179 * 0.670, 179 * 0.065)


def sensors(path):
    """The sensors of a .pts file, as text, and the options of rtrace named in it."""
    lines = path.read_text().splitlines()
    options = [word for line in lines if line.startswith("# rtrace:") for word in line.split(":", 1)[1].split()]
    return [line for line in lines if line.strip() and not line.startswith("#")], options


def run(words, **more):
    """Standard output of a command, or the end of the script with its messages."""
    done = subprocess.run(words, capture_output=True, **more)
    if done.returncode not in (0, 4):
        sys.exit(f"{' '.join(map(str, words))}: {done.stderr.decode()}")
    return done.stdout


def mean_and_error(values):
    """Mean and its standard error."""
    mean = sum(values) / len(values)
    spread = sum((value - mean) ** 2 for value in values) / (len(values) - 1)
    return mean, math.sqrt(spread / len(values))


def rtrace(scene, points, options, args):
    """Lux by rtrace with one standard error, for each point."""
    folder = pathlib.Path(args.radiance)
    library = args.lib or folder.parent / "lib"
    environment = dict(os.environ, RAYPATH=str(library), PATH=f"{folder}:{os.environ['PATH']}")
    with tempfile.TemporaryDirectory() as temporary:
        tree = pathlib.Path(temporary, "scene.oct")
        tree.write_bytes(run([folder / "oconv", "-w", scene.resolve()], env=environment))
        answers = []
        for point in points:
            seen, repeats = [], args.repeats
            while True:
                # Every run draws the same random numbers, so a larger run replaces a smaller one.
                words = [folder / "rtrace", "-w", *SETTINGS, *options, tree]
                out = run(words, env=environment, input=f"{point}\n".encode() * repeats)
                seen = [sum(w * float(x) for w, x in zip(WEIGHTS, line.split())) for line in out.decode().splitlines()]
                mean, error = mean_and_error(seen)
                if error <= args.error / 100 * mean or repeats >= args.most:
                    break
                repeats = min(args.most, max(2 * repeats, math.ceil(1.3 * repeats * (error / mean / args.error * 100) ** 2)))
            answers.append((mean, error))
    return answers


def hemilux(scene, points, args):
    """Lux by hemilux with the 95 % half-width, for each point."""
    words = [args.hemilux, "sense", scene, "--ci", "--quiet", "--target-error", args.target, "--limit", args.limit]
    out = run(words, input="\n".join(points).encode() + b"\n").decode()
    rows = [line.split() for line in out.splitlines() if line.strip() and not line.startswith("#")]
    return [(float(row[0]), float(row[1])) for row in rows]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", type=pathlib.Path)
    parser.add_argument("--hemilux", required=True, help="the binary")
    parser.add_argument("--radiance", required=True, help="the folder that holds oconv and rtrace")
    parser.add_argument("--lib", help="RAYPATH (default: lib beside that folder)")
    parser.add_argument("--only", default="", help="only scenes whose name contains this")
    parser.add_argument("--target", default="0.3%", help="hemilux: 95 %% half-width to reach (default 0.3%%)")
    parser.add_argument("--limit", default="120s", help="hemilux: most time for a sensor (default 120s)")
    parser.add_argument("--error", type=float, default=0.1, help="rtrace: standard error to reach, percent")
    parser.add_argument("--repeats", type=int, default=8, help="rtrace: repetitions of a sensor, at first")
    parser.add_argument("--most", type=int, default=256, help="rtrace: repetitions of a sensor, at most")
    parser.add_argument("--tolerance", type=float, default=1.0, help="percent")
    args = parser.parse_args()

    print("| scene | sensor | rtrace, lux | hemilux, lux | difference, % | within |\n|---|---|---|---|---|---|")
    count = close = inside = 0
    worst = 0.0
    for scene in sorted(args.scenes.glob("*.rad")):
        if args.only not in scene.name or not scene.with_suffix(".pts").exists():
            continue
        points, options = sensors(scene.with_suffix(".pts"))
        theirs, ours = rtrace(scene, points, options, args), hemilux(scene, points, args)
        if len(ours) != len(theirs):
            sys.exit(f"{scene}: {len(ours)} answers of hemilux, {len(theirs)} of rtrace")
        for number, ((mean, error), (value, half)) in enumerate(zip(theirs, ours), 1):
            difference = 100 * (value - mean) / mean
            within = abs(value - mean) <= math.hypot(half, 1.96 * error)
            count, close, inside = count + 1, close + (abs(difference) <= args.tolerance), inside + within
            worst = max(worst, abs(difference))
            print(
                f"| {scene.stem} | {number} | {mean:.5g} ± {error:.2g} | {value:.5g} ± {half:.2g} | "
                f"{difference:+.2f} | {'yes' if within else 'no'} |",
                flush=True,
            )
    print(f"\n{count} sensors: {close} within {args.tolerance:g} %, {inside} within the interval, worst {worst:.2f} %")
    sys.exit(0 if count and close == count else 1)


if __name__ == "__main__":
    main()
