#!/usr/bin/env python3
"""Kill a render (-9) at random moments, go on from its film, and compare the end with an uninterrupted run, bit for bit.

    python3 bench/kills.py [--kills 100] [--seed 1] [--binary target/release/hemilux]

One render after another (modes zonal, path, corrected in turn) is killed again and again until it ends by itself, until
there have been so many kills in all. Needs only Python; pixel data are compared by the program itself (`image diff`)
and, decoded by nobody, by the film files' own bytes: the film at the end must equal that of the uninterrupted run.
"""

import argparse
import os
import random
import subprocess
import tempfile
import time

arguments = argparse.ArgumentParser()
arguments.add_argument("--kills", type=int, default=100)
arguments.add_argument("--seed", type=int, default=1)
arguments.add_argument("--binary", default="target/release/hemilux")
arguments.add_argument("--scene", default="scenes/mirror-room.pbrt")
options = arguments.parse_args()
binary, scene = os.path.abspath(options.binary), os.path.abspath(options.scene)
random.seed(options.seed)
SMALL = ["--size", "96x72", "--zone-budget", "3000", "--particles", "100k"]
MODES = [("zonal", "24"), ("path", "300"), ("corrected", "16")]
QUIET = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}


def command(mode, spp, name, more):
    return [binary, "render", scene, *SMALL, "--mode", mode, "--spp", spp, "-o", name + ".exr", *more]


def pixels(film):
    """The sums of a film file: all but the notes about the command line, which differ."""
    data = open(film, "rb").read()
    return data[-len(data) // 2 : -4]


kills = runs = resumed = differ = none = left_over = 0
lost = []
with tempfile.TemporaryDirectory() as directory:
    os.chdir(directory)
    plain = {}
    for mode, spp in MODES:
        begin = time.time()
        subprocess.run(command(mode, spp, "plain-" + mode, ["--checkpoint", f"plain-{mode}.hlxf"]), check=True, **QUIET)
        plain[mode] = time.time() - begin
    while kills < options.kills:
        mode, spp = MODES[runs % len(MODES)]
        film = "killed.hlxf"
        if os.path.exists(film):
            os.remove(film)
        more = ["--checkpoint", film, "--checkpoint-every", "50ms"]
        while True:
            found = os.path.exists(film)
            resumed += found
            child = subprocess.Popen(command(mode, spp, "killed", more + (["--resume", film] if found else [])), **QUIET)
            limit = random.uniform(0.1, 0.7) * plain[mode] if kills < options.kills else 1e9
            try:
                code = child.wait(timeout=limit)
                assert code == 0, f"exit code {code}"
                break
            except subprocess.TimeoutExpired:
                child.kill()
                child.wait()
                kills += 1
                none += not os.path.exists(film)
        runs += 1
        same = subprocess.run([binary, "image", "diff", "killed.exr", f"plain-{mode}.exr", "--no-companions",
                               "--metric", "mae", "--tolerance", "0"], **QUIET).returncode == 0
        differ += not (same and pixels(film) == pixels(f"plain-{mode}.hlxf"))
    left_over = len([f for f in os.listdir(".") if f.endswith(".tmp")])
print(f"{kills} kills (-9) in {runs} renders; {none} before there was a film; {resumed} starts went on from one; "
      f"{differ} renders ended otherwise than uninterrupted; {left_over} temporary files left by kills while writing")
raise SystemExit(differ != 0)
