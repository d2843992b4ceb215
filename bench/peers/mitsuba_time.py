#!/usr/bin/env python3
"""Error against CPU time on one scene with a reference: Mitsuba's path tracer and hemilux's, taking turns.

    mitsuba_time.py SCENE.pbrt REFERENCE.exr --example PATH/TO/equal_time [--seconds 10] [--rounds 5]

Each side renders for `--seconds` of wall time at the scene's film size with unlimited depth, Mitsuba in passes of
`--pass-spp` samples per pixel. CPU seconds are of all threads: of the passes alone for Mitsuba (no import, no scene
build, no first pass), of the whole process for hemilux. On a shared machine relMSE x CPU seconds is the figure to
compare: it does not depend on how long either could run.
relMSE: mean of (img - a)(img - b) / (ref^2 + 0.01 mean(ref)^2) with the reference's halves, which does not see the
reference's own noise; pixels off in `valid.png` beside it are left out.
"""
import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time

import mitsuba as mi
import numpy as np


def load(path):
    bitmap = mi.Bitmap(path)
    if bitmap.pixel_format() == mi.Bitmap.PixelFormat.MultiChannel:
        names = [field.name.split(".")[-1] for field in bitmap.struct_()]
        return np.array(bitmap)[..., [names.index(c) for c in "RGB"]].astype(np.float64)
    rgb = bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)
    return np.array(rgb)[..., :3].astype(np.float64)


class Score:
    def __init__(self, path):
        def beside(name):
            return os.path.join(os.path.dirname(os.path.abspath(path)), name)

        self.reference = load(path)
        halves = [beside("reference_a.exr"), beside("reference_b.exr")]
        self.a, self.b = [load(h) for h in halves] if all(map(os.path.exists, halves)) else [self.reference] * 2
        self.valid = np.ones(self.reference.shape[:2], bool)
        if os.path.exists(beside("valid.png")):
            mask = np.array(mi.Bitmap(beside("valid.png"))).astype(float)
            self.valid = mask.reshape(*mask.shape[:2], -1)[..., 0] > 0

    def __call__(self, image):
        weight = 1 / (self.reference**2 + 0.01 * self.reference.mean() ** 2)
        return float(((image - self.a) * (image - self.b) * weight).mean(axis=2)[self.valid].mean())


def cpu(who):
    usage = resource.getrusage(who)
    return usage.ru_utime + usage.ru_stime


def run_mitsuba(scene, integrator, seconds, spp, seed):
    total, passes = 0, 0
    start, before = time.time(), cpu(resource.RUSAGE_SELF)
    while passes == 0 or time.time() - start + 0.5 * (time.time() - start) / passes < seconds:
        total = total + np.array(mi.render(scene, integrator=integrator, spp=spp, seed=seed + passes)).astype(float)
        passes += 1
    return total / passes, passes * spp, time.time() - start, cpu(resource.RUSAGE_SELF) - before


def run_hemilux(args, seed, folder):
    command = [args.example, args.scene, args.reference, "modes=path", f"seconds={args.seconds}", "depth=none",
               f"seed={seed}", f"save={folder}/ours"]
    start, before = time.time(), cpu(resource.RUSAGE_CHILDREN)
    run = subprocess.run(command, capture_output=True, text=True)
    if run.returncode:
        sys.exit(run.stderr)
    line = next(text for text in run.stdout.splitlines() if text.startswith("path "))
    spp = int(line.split("|")[3])
    return load(f"{folder}/ours-path.exr"), spp, time.time() - start, cpu(resource.RUSAGE_CHILDREN) - before


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("scene")
    p.add_argument("reference")
    p.add_argument("--example", required=True)
    p.add_argument("--variant", default="scalar_rgb")
    p.add_argument("--seconds", type=float, default=10)
    p.add_argument("--rounds", type=int, default=5)
    p.add_argument("--pass-spp", type=int, default=4)
    args = p.parse_args()
    mi.set_variant(args.variant)
    mi.set_log_level(mi.LogLevel.Error)
    import masking  # noqa: F401 (registers a BSDF of the variant that was just set)
    from pbrt_to_mitsuba import Reader

    reader = Reader(mi, args.scene)
    scene = mi.load_dict(reader.dictionary(reader.width, reader.height))
    integrator = mi.load_dict({"type": "path", "max_depth": -1, "rr_depth": 5})
    mi.render(scene, integrator=integrator, spp=args.pass_spp, seed=999)
    score, figures = Score(args.reference), {"mitsuba": [], "hemilux": []}
    print("round | renderer | spp | wall s | CPU s | relMSE | relMSE x CPU s")
    with tempfile.TemporaryDirectory() as folder:
        for k in range(args.rounds):
            for name in figures:
                if name == "mitsuba":
                    result = run_mitsuba(scene, integrator, args.seconds, args.pass_spp, 100_000 * (k + 1))
                else:
                    result = run_hemilux(args, k + 1, folder)
                image, spp, wall, used = result
                error = score(image)
                figures[name].append((error * used, spp / used))
                print(f"{k} | {name} | {spp} | {wall:.2f} | {used:.2f} | {error:.3e} | {error * used:.3e}", flush=True)
    middle = {name: [statistics.median(f) for f in zip(*rows)] for name, rows in figures.items()}
    for name, (work, rate) in middle.items():
        print(f"{name}: median relMSE x CPU s {work:.3e}, {rate:.2f} spp per CPU s")
    print(f"mitsuba / hemilux: {middle['mitsuba'][0] / middle['hemilux'][0]:.2f}")


main()
