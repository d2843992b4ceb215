#!/usr/bin/env python3
"""Illuminance by `hemilux sense` against Radiance's `rtrace -I`, scene by scene and sensor by sensor.

    compare.py SCENES_DIR --hemilux BINARY --radiance BIN_DIR [--lib DIR] [--only WORD]
        [--save FILE | --stored FILE]

Every X.rad in SCENES_DIR with an X.pts beside it is a case. The .pts file holds sensors (x y z nx ny nz) and, in a
comment `# rtrace: ...`, the options of rtrace that depend on the scene (the ambient bounces). rtrace is run at high
settings without ambient cache or interpolation, and every sensor is repeated in one run (the random numbers go on from
one sensor to the next, so that the answers are independent), more of them until the standard error is below the
target. Both sides give lux: 179 (0.265 R + 0.670 G + 0.065 B).

`within` asks whether the difference is less than the 95 % half-widths of both, in quadrature. t is the difference over the
standard errors of both, in quadrature; its p-value is Student's with Welch's degrees of freedom (hemilux: 15, rtrace: its
repetitions less one). The smallest p of all sensors is judged as the smallest of so many (Sidak). Exit code 1 if any sensor
is more than the tolerance away, or the smallest p is below 0.05 so corrected.

rtrace takes most of the time and does not depend on hemilux: `--save FILE` keeps its answers, `--stored FILE` takes them.
"""

import argparse
import csv
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


def two_sided(t, degrees):
    """Probability that Student's t is farther from 0 than `t`: the density by Simpson's rule, over t = tan(x)."""
    density = math.exp(math.lgamma((degrees + 1) / 2) - math.lgamma(degrees / 2)) / math.sqrt(degrees * math.pi)
    low, high, steps = math.atan(abs(t)), math.pi / 2, 2000
    value = 0.0
    for i in range(steps):
        x = low + (high - low) * i / steps
        tangent = math.tan(x)
        weight = 1 if i == 0 else 4 if i % 2 else 2
        value += weight * density * (1 + tangent * tangent / degrees) ** (-(degrees + 1) / 2) * (1 + tangent * tangent)
    # At the upper end the integrand is 0 (degrees > 1).
    return min(1.0, 2 * value * (high - low) / steps / 3)


def quantile(degrees):
    """Student's t that is exceeded on either side with probability 5 %."""
    low, high = 1.0, 20.0
    while high - low > 1e-6:
        middle = (low + high) / 2
        low, high = (middle, high) if two_sided(middle, degrees) > 0.05 else (low, middle)
    return low


def judge(theirs, ours):
    """Whether within both intervals, t and its p-value."""
    (mean, error, repeats), (value, half) = theirs, ours
    # hemilux: Student over 16 groups; what the half-width holds beyond that is taken for error, too.
    a, b = (half / quantile(15)) ** 2, error**2
    degrees = (a + b) ** 2 / (a * a / 15 + b * b / max(repeats - 1, 1))
    t = (value - mean) / math.sqrt(a + b)
    within = abs(value - mean) <= math.hypot(half, quantile(max(repeats - 1, 2)) * error)
    return within, t, two_sided(t, degrees)


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
            answers.append((mean, error, repeats))
    return answers


def hemilux(scene, points, args):
    """Lux by hemilux with the 95 % half-width, for each point."""
    words = [args.hemilux, "sense", scene, "--ci", "--quiet", "--target-error", args.target, "--limit", args.limit, "--seed", args.seed]
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
    parser.add_argument("--seed", default="0", help="hemilux: seed (default 0)")
    parser.add_argument("--save", help="file to keep rtrace's answers in (CSV)")
    parser.add_argument("--stored", help="file to take rtrace's answers from")
    parser.add_argument("--tolerance", type=float, default=1.0, help="percent")
    args = parser.parse_args()

    cases = [s for s in sorted(args.scenes.glob("*.rad")) if args.only in s.name and s.with_suffix(".pts").exists()]
    stored = {}
    if args.stored:
        with open(args.stored, newline="") as file:
            for row in csv.DictReader(file):
                answer = (float(row["lux"]), float(row["standard error"]), int(row["repetitions"]))
                stored.setdefault(row["scene"], []).append(answer)
    kept = []
    print("| scene | sensor | rtrace, lux | hemilux, lux | difference, % | within | t | p |\n|---|---|---|---|---|---|---|---|")
    count = close = inside = 0
    worst, least = 0.0, 1.0
    for scene in cases:
        points, options = sensors(scene.with_suffix(".pts"))
        theirs = stored[scene.stem] if args.stored else rtrace(scene, points, options, args)
        ours = hemilux(scene, points, args)
        if len(ours) != len(theirs):
            sys.exit(f"{scene}: {len(ours)} answers of hemilux, {len(theirs)} of rtrace")
        for number, (a, b) in enumerate(zip(theirs, ours), 1):
            (mean, error, repeats), (value, half) = a, b
            kept.append((scene.stem, number, mean, error, repeats))
            difference = 100 * (value - mean) / mean
            within, t, p = judge(a, b)
            count, close, inside = count + 1, close + (abs(difference) <= args.tolerance), inside + within
            worst, least = max(worst, abs(difference)), min(least, p)
            print(
                f"| {scene.stem} | {number} | {mean:.5g} ± {error:.2g} | {value:.5g} ± {half:.2g} | "
                f"{difference:+.2f} | {'yes' if within else 'no'} | {t:+.2f} | {p:.2g} |",
                flush=True,
            )
    if args.save:
        with open(args.save, "w", newline="") as file:
            csv.writer(file).writerows([("scene", "sensor", "lux", "standard error", "repetitions"), *kept])
    corrected = 1 - (1 - least) ** max(count, 1)
    print(
        f"\n{count} sensors: {close} within {args.tolerance:g} %, {inside} within both intervals ({0.95 * count:.0f} expected), "
        f"worst {worst:.2f} %; smallest p {least:.2g}, of so many {corrected:.2g}"
    )
    sys.exit(0 if count and close == count and corrected >= 0.05 else 1)


if __name__ == "__main__":
    main()
