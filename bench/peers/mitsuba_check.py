#!/usr/bin/env python3
"""An arbiter for hemilux's path tracer: the same .pbrt file rendered by Mitsuba 3, compared with standard errors.

    mitsuba_check.py SCENE.pbrt --size 320x180 --depth file --spp 1024 --example PATH/TO/equal_time --ours-spp 512
    mitsuba_check.py SCENE.pbrt --size 320x180 --depth 1 --spp 256 --ours a.exr b.exr
    mitsuba_check.py SCENE.pbrt --size 320x180 --depth 1 --spp 256 --set distribution=beckmann --image REFERENCE.exr

Both sides are rendered in `--batches` independent batches (own seeds); standard errors come from the scatter of the
batches. `--spp`, `--ours-spp` are totals. `--image` is compared as well, shrunk to the size by box averaging when it
is larger by a whole factor. Mitsuba has `path`, a box filter, and this reader of .pbrt (`pbrt_to_mitsuba.py`).

Printed: mean ratios (first / second) with one standard error; the 8 x 8 grid of ratios (green) with the largest
|z| over regions and channels; relMSE, and relMSE "crossed": halves of both sides multiplied, which is free of noise
and 0 on average if both have the same expectation in every pixel.

Set-up: python3 -m venv V && V/bin/pip install mitsuba==3.9.1 numpy
The variant llvm_ad_rgb is quicker and needs LLVM (DRJIT_LIBLLVM_PATH, 19 works); scalar_rgb needs nothing.
"""
import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time

import mitsuba as mi
import numpy as np

GRID = 8


def arguments():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("scene")
    p.add_argument("--size", help="WxH; the file's film size if absent")
    p.add_argument("--depth", default="file", help="file, none or pbrt's maxdepth (scatterings)")
    p.add_argument("--spp", type=int, default=256, help="Mitsuba's samples per pixel, all batches together")
    p.add_argument("--ours-spp", type=int, default=256)
    p.add_argument("--batches", type=int, default=16)
    p.add_argument("--seed", type=int, default=1, help="other seeds on both sides; runs are independent")
    p.add_argument("--variant", default="llvm_ad_rgb")
    p.add_argument("--ours", nargs="*", default=[], help="EXR files of independent batches")
    p.add_argument("--example", help="the built example equal_time: renders our batches")
    p.add_argument("--image", action="append", default=[], help="an image to compare as well (no standard error)")
    p.add_argument("--set", nargs="*", default=[], metavar="KEY=VALUE",
                   help="distribution=ggx|beckmann, masking=correlated|separable, specular_reflectance=NUMBER, luminaires=black")
    p.add_argument("--cache", help="folder to keep Mitsuba's batches in (.npy), reused if there")
    p.add_argument("--json", help="append one line of figures to this file")
    return p.parse_args()


def load(path, size=None):
    bitmap = mi.Bitmap(path)
    if bitmap.pixel_format() == mi.Bitmap.PixelFormat.MultiChannel:
        names = [field.name.split(".")[-1] for field in bitmap.struct_()]
        a = np.array(bitmap)[..., [names.index(c) for c in "RGB"]]
    else:
        a = np.array(bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))[..., :3]
    a = a.astype(np.float64)
    if size and a.shape[:2] != size:
        fy, fx = a.shape[0] // size[0], a.shape[1] // size[1]
        if a.shape[:2] != (fy * size[0], fx * size[1]):
            sys.exit(f"{path}: {a.shape[:2]} does not shrink to {size}")
        a = a.reshape(size[0], fy, size[1], fx, 3).mean(axis=(1, 3))
    return a


def mitsuba_batches(args, reader, width, height, depth):
    """Array (batch, y, x, channel)."""
    stem = os.path.splitext(os.path.abspath(args.scene))[0].replace(os.sep, "_")[-40:]
    key = f"{stem}_{width}x{height}_{depth}_{args.spp}_{args.batches}_{args.seed}_{'_'.join(args.set)}.npy"
    if args.cache and os.path.exists(os.path.join(args.cache, key)):
        return np.load(os.path.join(args.cache, key)).astype(np.float64)
    scene = mi.load_dict(reader.dictionary(width, height))
    integrator = mi.load_dict({"type": "path", "max_depth": -1 if depth is None else depth + 1, "rr_depth": 5})
    spp = max(1, args.spp // args.batches)
    most = max(1, 8_000_000 // (width * height))
    batches, seed, start = [], 0, time.time()
    for _ in range(args.batches):
        total, done = 0, 0
        while done < spp:
            n = min(most, spp - done)
            total = total + n * np.array(mi.render(scene, integrator=integrator, spp=n, seed=1_000_000 * args.seed + seed)).astype(float)
            done, seed = done + n, seed + 1
        batches.append(total / done)
    print(f"mitsuba {args.variant}: {spp * args.batches} spp in {time.time() - start:.1f} s", flush=True)
    batches = np.array(batches)
    if args.cache:
        os.makedirs(args.cache, exist_ok=True)
        np.save(os.path.join(args.cache, key), batches.astype(np.float32))
    return batches


def with_box_filter(path, folder):
    """A copy of the scene whose pixel filter is a box one pixel wide, as Mitsuba's here; other files stay in place."""
    with open(path) as f:
        text = f.read()
    home = os.path.dirname(os.path.abspath(path))
    text = re.sub(r'^[ \t]*PixelFilter[^\n]*(\n[ \t]+"[^\n]*)*', "", text, flags=re.M)
    text = 'PixelFilter "box" "float xradius" [ 0.5 ] "float yradius" [ 0.5 ]\n' + text
    text = re.sub(r'("string filename"\s*\[?\s*")(?!/)([^"]*\.ply")', lambda m: m[1] + home + "/" + m[2], text)
    copy = os.path.join(folder, os.path.basename(path))
    with open(copy, "w") as f:
        f.write(text)
    return copy


def our_batches(args, width, height, depth, like):
    if args.ours:
        return np.array([load(p, (height, width)) for p in args.ours])
    batches = []
    with tempfile.TemporaryDirectory() as folder:
        stand_in = os.path.join(folder, "like.exr")
        mi.Bitmap(like.astype(np.float32)).write(stand_in)
        scene = with_box_filter(args.scene, folder)
        start = time.time()
        for k in range(args.batches):
            command = [args.example, scene, stand_in, "modes=path", f"spp={max(1, args.ours_spp // args.batches)}",
                       f"size={width}x{height}", f"depth={'none' if depth is None else depth}", f"seed={1000 * args.seed + k}",
                       f"save={folder}/b{k}"]
            run = subprocess.run(command, capture_output=True, text=True)
            if run.returncode:
                sys.exit(run.stderr)
            batches.append(load(f"{folder}/b{k}-path.exr", (height, width)))
        print(f"hemilux path: {args.ours_spp} spp in {time.time() - start:.1f} s", flush=True)
    return np.array(batches)


def regions(batches):
    """(batch, grid y, grid x, channel) means."""
    rows = np.array_split(batches, GRID, axis=1)
    return np.stack([np.stack([c.mean(axis=(1, 2)) for c in np.array_split(r, GRID, axis=2)], axis=1) for r in rows], 1)


def mean_and_error(batches):
    n = len(batches)
    error = batches.std(axis=0, ddof=1) / np.sqrt(n) if n > 1 else np.zeros(batches.shape[1:])
    return batches.mean(axis=0), error


def compare(name, first, second):
    """`first` over `second`, both (batch, y, x, channel)."""
    a, ea = mean_and_error(first.mean(axis=(1, 2)))
    b, eb = mean_and_error(second.mean(axis=(1, 2)))
    ratio = a / b
    error = ratio * np.hypot(ea / a, eb / b)
    print(f"\n{name}\n  mean ratio " + "  ".join(f"{r:.4f} ± {e:.4f}" for r, e in zip(ratio, error)))
    ra, rea = mean_and_error(regions(first))
    rb, reb = mean_and_error(regions(second))
    spread = np.hypot(rea, reb)
    lit = rb > 0
    grid = np.divide(ra, rb, out=np.ones_like(ra), where=lit)
    z = np.divide(ra - rb, spread, out=np.zeros_like(ra), where=spread > 0)
    for y in range(GRID):
        print("  " + " ".join(f"{g:7.4f}({s:+5.1f})" for g, s in zip(grid[y, :, 1], z[y, :, 1])))
    worst = np.unravel_index(np.abs(z).argmax(), z.shape)
    print(f"  regions: worst z {z[worst]:+.1f} at row {worst[0]}, column {worst[1]}, channel {worst[2]}; "
          f"ratio {grid[worst]:.4f}; |z| > 3: {(np.abs(z) > 3).sum()} of {z.size}; rms z {np.sqrt((z**2).mean()):.2f}; "
          f"median relative error {np.median(spread[lit] / rb[lit]):.4f}")
    reference = second.mean(axis=0)
    weight = 1 / (reference**2 + 0.01 * reference.mean() ** 2)
    plain = (first.mean(axis=0) - reference) ** 2 * weight
    figures = {"name": name, "ratio": ratio.tolist(), "error": error.tolist(), "worst_z": float(z[worst]),
               "rms_z": float(np.sqrt((z**2).mean())), "over_3": int((np.abs(z) > 3).sum()), "relmse": float(plain.mean())}
    print(f"  relMSE {plain.mean():.3e}", end="")
    if len(first) > 1 and len(second) > 1:
        d1 = first[0::2].mean(axis=0) - second[0::2].mean(axis=0)
        d2 = first[1::2].mean(axis=0) - second[1::2].mean(axis=0)
        crossed = (d1 * d2 * weight).mean(axis=2).ravel()
        figures["crossed"] = [float(crossed.mean()), float(crossed.std() / np.sqrt(crossed.size))]
        print(f", crossed {figures['crossed'][0]:+.2e} ± {figures['crossed'][1]:.1e}", end="")
    print(flush=True)
    return figures


def main():
    args = arguments()
    mi.set_variant(args.variant)
    mi.set_log_level(mi.LogLevel.Error)
    import masking  # noqa: F401 (registers a BSDF of the variant that was just set)
    from pbrt_to_mitsuba import Reader

    reader = Reader(mi, args.scene, dict(s.split("=", 1) for s in args.set))
    width, height = map(int, args.size.split("x")) if args.size else (reader.width, reader.height)
    depth = {"file": reader.max_depth, "none": None}.get(args.depth, args.depth)
    depth = None if depth is None else int(depth)
    print(f"{os.path.basename(args.scene)} {width}x{height}, depth {depth}, {' '.join(args.set)}")
    theirs = mitsuba_batches(args, reader, width, height, depth)
    figures = []
    if args.ours or args.example:
        ours = our_batches(args, width, height, depth, theirs.mean(axis=0))
        figures.append(compare("hemilux / mitsuba", ours, theirs))
    for path in args.image:
        image = load(path, (height, width))[None]
        figures.append(compare(f"mitsuba / {os.path.basename(path)}", theirs, image))
        if args.ours or args.example:
            figures.append(compare(f"hemilux / {os.path.basename(path)}", ours, image))
    if args.json:
        with open(args.json, "a") as f:
            print(json.dumps({"scene": args.scene, "size": [width, height], "depth": depth, "set": args.set,
                              "spp": args.spp, "ours_spp": args.ours_spp, "figures": figures}), file=f)


if __name__ == "__main__":
    main()
