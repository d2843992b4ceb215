#!/usr/bin/env python3
"""`--time`: whether renders end when they were told to, writing included, and spend the time on rendering.

    python3 bench/times.py [--time 20] [--binary target/release/hemilux] [SCENE...]

For each scene: wall time of the whole program (to be within 5 % of what was asked), and the part of the time after the
preparation (reading, building, zones) that went to rendering (pairs and pilots included), to be at least 95 %; both from
outside and from the program's own report. Without scenes, five of `scenes/`. Needs only Python.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time

arguments = argparse.ArgumentParser()
arguments.add_argument("--time", type=float, default=20)
arguments.add_argument("--binary", default="target/release/hemilux")
arguments.add_argument("--more", default="", help="more options of render, in one word")
arguments.add_argument("scenes", nargs="*")
options = arguments.parse_args()
OURS = ["varnish", "mirror-room", "skylight", "dew-pane", "reflector"]
scenes = options.scenes or [f"scenes/{name}.pbrt" for name in OURS]
PREPARATION, RENDERING = ("load", "prepare", "zones"), ("pairs", "pilot", "rates", "render")

failed = 0
print("| scene | wall | samples per pixel | preparation | of the rest rendering | |\n|---|---:|---:|---:|---:|---|")
with tempfile.TemporaryDirectory() as directory:
    report = os.path.join(directory, "report.json")
    for scene in scenes:
        view = os.path.splitext(scene)[0] + ".vf"
        parts = [scene] + ([view] if scene.endswith(".rad") and os.path.exists(view) else [])
        command = [options.binary, "render", *parts, "--time", f"{options.time}s", "-q", "--report", report,
                   "-o", os.path.join(directory, "out.exr"), *options.more.split()]
        begin = time.time()
        code = subprocess.run(command, stderr=subprocess.PIPE).returncode
        wall = time.time() - begin
        told = json.load(open(report))
        seconds = told["seconds"]
        prepared = sum(seconds.get(stage, 0) for stage in PREPARATION)
        rendered = sum(seconds.get(stage, 0) for stage in RENDERING)
        share = rendered / max(wall - prepared, 1e-9)
        good = code == 0 and abs(wall / options.time - 1) <= 0.05 and share >= 0.95
        failed += not good
        samples = told["noise"]["samples_per_pixel"]
        count = "-".join(str(n) for n in sorted({samples["least"], samples["most"]}))
        print(f"| {os.path.basename(scene)} | {wall:.2f} s | {count} | {prepared:.2f} s | {100 * share:.1f} % | "
              f"{'ok' if good else f'NOT MET (exit code {code})'} |", flush=True)
sys.exit(failed != 0)
