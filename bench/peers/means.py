#!/usr/bin/env python3
"""Whether programs agree on how bright a scene is: picture means of hemilux over those of its peers.

    means.py SCENES_DIRECTORY [--scenes box,bulb,...] [--pixels 3072] [--seeds 4] [--spp 16] [--mitsuba-spp 4096] [--radiance BIN]

SCENES_DIRECTORY holds NAME/NAME.pbrt (and NAME.rad, NAME.vf, reference.exr), and public/NAME/scene.pbrt. Every scene is rendered small
(with the proportions of its file) by hemilux (modes zonal and corrected, `--seeds` times with zones of their own), by Mitsuba 3 (path tracing of
the same .pbrt file, 16 batches, `pbrt_to_mitsuba.py`) and by Radiance where there is a .rad file or the scene is diffuse (`pbrt_to_radiance.py`):
`rtrace` with the ambient cache (classic), and over photon maps (pmap), three times each with uncorrelated samples.
Printed: mean luminance of the picture, hemilux / peer, each with one standard error of both; of references half the difference of their
two halves where there are halves.
Films use a box filter and paths have no limit but the file's. Where path tracing has not converged its error says so (and is itself too
small where bright paths are rare).

Set-up as mitsuba_check.py; Radiance's programs: `pip install pyradiance`, --radiance .../site-packages/pyradiance/bin.
"""
import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time

import mitsuba as mi
import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

SCENES = "box,varnish,office,bulb,skylight,public/cornell-box,public/veach-mis,public/veach-bidir"
RTRACE = "-h -fff -ov -ds .1 -dj .9 -dt .02 -dc .9 -dr 2 -dp 256 -st .01 -ss 1 -lr -14 -lw 1e-5"


def arguments():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("folder")
    p.add_argument("--scenes", default=SCENES)
    p.add_argument("--pixels", type=int, default=3072)
    p.add_argument("--seeds", type=int, default=4)
    p.add_argument("--spp", type=int, default=16)
    p.add_argument("--particles", default="300k")
    p.add_argument("--modes", default="zonal,corrected")
    p.add_argument("--mitsuba-spp", type=int, default=4096)
    p.add_argument("--radiance", help="folder of Radiance's programs")
    p.add_argument("--binary", default="target/release/hemilux")
    p.add_argument("--variant", default="llvm_ad_rgb")
    return p.parse_args()


def read(path):
    bitmap = mi.Bitmap(path)
    if bitmap.pixel_format() == mi.Bitmap.PixelFormat.MultiChannel:
        names = [field.name.split(".")[-1] for field in bitmap.struct_()]
        return np.array(bitmap)[..., [names.index(c) for c in "RGB"]].astype(float)
    return np.array(bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))[..., :3].astype(float)


def luminance(picture):
    return float(picture[..., :3].mean(axis=tuple(range(picture.ndim - 1))) @ np.array([0.2126, 0.7152, 0.0722]))


def summary(values):
    values = np.array(values)
    return values.mean(), values.std(ddof=1) / np.sqrt(len(values)) if len(values) > 1 else 0.0


def hemilux(args, scene, size, mode, folder):
    means = []
    for seed in range(args.seeds):
        out = os.path.join(folder, "ours.exr")
        subprocess.run([args.binary, "render", scene, "-o", out, "--size", "x".join(map(str, size)), "--spp", str(args.spp), "--mode", mode,
                        "--particles", args.particles, "--seed", str(seed), "--quiet"], check=True)
        means.append(luminance(read(out)))
    return summary(means)


def mitsuba(args, reader, size):
    world = mi.load_dict(reader.dictionary(*size))
    depth = -1 if reader.max_depth is None else reader.max_depth + 1
    integrator = mi.load_dict({"type": "path", "max_depth": depth, "rr_depth": 5})
    spp = max(1, args.mitsuba_spp // 16)
    return summary([luminance(np.array(mi.render(world, integrator=integrator, spp=spp, seed=k))) for k in range(16)])


def reference(folder):
    whole, *halves = (os.path.join(folder, f"reference{half}.exr") for half in ("", "_a", "_b"))
    if not os.path.exists(whole):
        return None
    a, b = (luminance(read(half)) if os.path.exists(half) else 0.0 for half in halves)
    return luminance(read(whole)), abs(a - b) / 2


def radiance(args, folder, size, photons):
    """Mean of s.rad seen by s.vf in `folder`, three times."""
    env = {**os.environ, "PATH": os.path.abspath(args.radiance) + ":" + os.environ["PATH"],
           "RAYPATH": ".:" + os.path.abspath(os.path.join(args.radiance, "..", "lib"))}

    def shell(command):
        return subprocess.run(["bash", "-o", "pipefail", "-c", command], cwd=folder, env=env, capture_output=True)

    means = []
    for seed in range(3):
        shell("rm -f *.amb *.pm; oconv -f s.rad > s.oct")
        ambient, maps = "-ab 8 -aa .15 -ar 128 -ad 1024 -as 256", ""
        if photons:
            # Without casters there is no caustic map to be had.
            if shell(f"timeout 400 mkpmap -n 2 -apr {seed} -apm 200 -fo+ -apg g.pm 100k -apc c.pm 300k s.oct").returncode:
                shell(f"timeout 400 mkpmap -n 2 -apr {seed} -fo+ -apg g.pm 100k s.oct")
            maps = "-ap g.pm 50" + (" -ap c.pm 50" if os.path.exists(os.path.join(folder, "c.pm")) else "")
            ambient = "-ab 1 -aa .2 -ar 64 -ad 512 -as 128"
        width, height = size
        # Uncorrelated samples (-u+) are seeded by the second.
        options = f"-n 2 -u+ {RTRACE} {maps} {ambient} -af a.amb"
        for pixels, out in (("-c 1", "/dev/null"), ("-c 4 -pj 1", "p.raw")):
            time.sleep(1.1)
            run = shell(f"vwrays -ff -vf s.vf -pa 0 -x {width} -y {height} {pixels} | timeout 600 rtrace {options} s.oct > {out}")
            if run.returncode:
                return None
        picture = np.fromfile(os.path.join(folder, "p.raw"), np.float32)
        if picture.size != width * height * 12:
            return None
        means.append(luminance(picture.reshape(-1, 3)))
    return summary(means)


def fitted(args, reader):
    """As many pixels as asked for, in the file's proportions."""
    scale = (args.pixels / (reader.width * reader.height)) ** 0.5
    return max(8, round(reader.width * scale)), max(8, round(reader.height * scale))


def main():
    args = arguments()
    mi.set_variant(args.variant)
    mi.set_log_level(mi.LogLevel.Error)
    import masking  # noqa: F401 (registers a BSDF of the variant that was just set)
    import pbrt_to_radiance
    from mitsuba_check import with_box_filter
    from pbrt_to_mitsuba import Reader

    print("| scene | mode | hemilux | / Mitsuba | / Radiance, ambient cache | / Radiance, photon map | / reference |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for name in args.scenes.split(","):
        folder = os.path.join(args.folder, name)
        stem = os.path.join(folder, "scene" if name.startswith("public/") else name)
        reader = Reader(mi, stem + ".pbrt", {})
        size = fitted(args, reader)
        with tempfile.TemporaryDirectory() as temporary:
            scene = with_box_filter(stem + ".pbrt", temporary)
            peers = [mitsuba(args, reader, size), None, None]
            copy = os.path.join(temporary, "s")
            given = os.path.exists(stem + ".rad")
            if given:
                for suffix in (".rad", ".vf"):
                    shutil.copy(stem + suffix, copy + suffix)
            if args.radiance and (given or pbrt_to_radiance.write(stem + ".pbrt", copy, *size)):
                peers[1:] = [radiance(args, temporary, size, photons) for photons in (False, True)]
            peers.append(reference(folder))
            for mode in args.modes.split(","):
                ours = hemilux(args, scene, size, mode, temporary)
                cells = [f"{ours[0]:.5g} ± {ours[1]:.2g}"]
                for peer in peers:
                    if peer is None:
                        cells.append("–")
                        continue
                    ratio = ours[0] / peer[0]
                    error = ratio * np.hypot(ours[1] / ours[0], peer[1] / peer[0])
                    cells.append(f"{ratio:.4f} ± {error:.4f}")
                print(f"| {name} | {mode} | " + " | ".join(cells) + " |", flush=True)


main()
