#!/usr/bin/env python3
"""A grid of lux by `hemilux sense --grid` beside `rtrace -I` at the same points: a table, CSV and a false-colour PNG.

    grid.py SCENE.rad... --grid ox,oy,oz,ux,uy,uz,vx,vy,vz,columns,rows --hemilux BINARY --radiance BIN_DIR
            --ambient "-ab 20 -ad 2048" --csv OUT.csv --png OUT.png

The picture has hemilux on the left and rtrace on the right, row 1 (the smallest v) at the bottom, one common scale from
black over blue, red and yellow to white, linear from 0 to the largest value of both.
"""

import argparse
import math
import os
import pathlib
import struct
import tempfile
import zlib

from compare import SETTINGS, WEIGHTS, mean_and_error, run

RAMP = ((0, 0, 0), (40, 20, 140), (190, 30, 110), (250, 150, 30), (255, 255, 220))


def colour(fraction):
    """A colour of the ramp for a fraction of the scale."""
    place = min(max(fraction, 0.0), 1.0) * (len(RAMP) - 1)
    low = min(int(place), len(RAMP) - 2)
    return bytes(round(a + (b - a) * (place - low)) for a, b in zip(RAMP[low], RAMP[low + 1]))


def write_png(path, grids, columns, rows, cell=28, gap=20):
    """The grids side by side, with the scale as a bar at the right."""
    top = max(max(grid) for grid in grids)
    width = len(grids) * (columns * cell + gap) + cell
    data = bytearray()
    for y in range(rows * cell):
        row = rows - 1 - y // cell
        data.append(0)
        for grid in grids:
            for column in range(columns):
                data += colour(grid[row * columns + column] / top) * cell
            data += b"\xff\xff\xff" * gap
        data += colour(1 - y / (rows * cell - 1)) * cell

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    header = struct.pack(">IIBBBBB", width, rows * cell, 8, 2, 0, 0, 0)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes(data), 9)) + chunk(b"IEND", b"")
    )
    return top


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=pathlib.Path)
    parser.add_argument("--grid", required=True)
    parser.add_argument("--hemilux", required=True)
    parser.add_argument("--radiance", required=True, type=pathlib.Path)
    parser.add_argument("--ambient", default="-ab 20 -ad 2048")
    parser.add_argument("--repeats", type=int, default=6)
    parser.add_argument("--target", default="3%")
    parser.add_argument("--csv", type=pathlib.Path)
    parser.add_argument("--png", type=pathlib.Path)
    args = parser.parse_args()

    words = [args.hemilux, "sense", *args.scenes, "--grid", args.grid, "--format", "csv", "--target-error", args.target, "--limit", "120s", "-q"]
    text = run(words).decode()
    lines = [line.split(",") for line in text.splitlines() if line.strip() and line[0] not in "#x"]
    points = [" ".join(line[:6]) for line in lines]
    ours = [(float(line[6]), float(line[7])) for line in lines]

    environment = dict(os.environ, RAYPATH=str(args.radiance.parent / "lib"), PATH=f"{args.radiance}:{os.environ['PATH']}")
    with tempfile.TemporaryDirectory() as temporary:
        tree = pathlib.Path(temporary, "scene.oct")
        tree.write_bytes(run([args.radiance / "oconv", "-w", *[scene.resolve() for scene in args.scenes]], env=environment))
        asked = "".join(f"{point}\n" * args.repeats for point in points).encode()
        out = run([args.radiance / "rtrace", "-w", *SETTINGS, *args.ambient.split(), tree], env=environment, input=asked)
    seen = [sum(w * float(x) for w, x in zip(WEIGHTS, line.split())) for line in out.decode().splitlines()]
    groups = [seen[i : i + args.repeats] for i in range(0, len(seen), args.repeats)]
    theirs = [mean_and_error(group) for group in groups]

    table = "x,y,z,hemilux [lx],half-width [lx],rtrace [lx],standard error [lx],difference %,within\n"
    inside, relative = 0, []
    for point, (value, half), (mean, error) in zip(points, ours, theirs):
        difference = 100 * (value - mean) / mean
        within = abs(value - mean) <= math.hypot(half, 1.96 * error)
        inside += within
        relative.append(difference)
        table += ",".join(point.split()[:3]) + f",{value:.2f},{half:.2f},{mean:.2f},{error:.2f},{difference:+.2f},{within}\n"
    squares = sum(d * d for d in relative) / len(relative)
    mine, other = (sum(v for v, _ in side) / len(side) for side in (ours, theirs))
    if args.csv:
        args.csv.write_text(table)
    else:
        print(table)
    print(
        f"{len(points)} points: mean {mine:.2f} lx by hemilux, {other:.2f} lx by rtrace ({100 * (mine / other - 1):+.2f} %); "
        f"{inside} within the interval; rms difference {math.sqrt(squares):.2f} %, worst {max(relative, key=abs):+.2f} %"
    )
    if args.png:
        columns, rows = (int(n) for n in args.grid.split(",")[-2:])
        top = write_png(args.png, [[v for v, _ in ours], [v for v, _ in theirs]], columns, rows)
        print(f"{args.png}: white is {top:.0f} lx")


if __name__ == "__main__":
    main()
