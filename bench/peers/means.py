#!/usr/bin/env python3
"""Whether programs agree on how bright a scene is: picture means of hemilux over those of its peers.

    means.py SCENES_DIRECTORY [--scenes box,bulb,...] [--size 80x60] [--seeds 8] [--spp 16] [--mitsuba-spp 2048] [--radiance BIN]

SCENES_DIRECTORY holds NAME/NAME.pbrt (and NAME.rad, NAME.vf, reference.exr), and public/NAME/scene.pbrt. Every scene is rendered small
by hemilux (modes zonal and corrected, `--seeds` times with zones of their own), by Mitsuba 3 (path tracing of the same .pbrt file, 16 batches,
`pbrt_to_mitsuba.py`) and, where there is a .rad file, by Radiance: `rtrace` with the ambient cache (classic), and over photon maps (pmap).
Printed: mean over the picture (green), hemilux / peer with one standard error of both (Radiance and the references have none).
Films use a box filter and paths have no limit but the file's. Where path tracing has not converged its error says so.

Set-up as mitsuba_check.py; Radiance's programs: `pip install pyradiance`, --radiance .../site-packages/pyradiance/bin.
"""
import argparse
import os
import shutil
import subprocess
import sys
import tempfile

import mitsuba as mi
import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

SCENES = "box,varnish,office,bulb,skylight,public/cornell-box,public/veach-mis,public/veach-bidir"
RTRACE = "-h -fff -ov -ds .1 -dj .9 -dt .02 -dc .9 -dr 2 -dp 256 -st .01 -ss 1 -lr -14 -lw 1e-5"


def arguments():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("folder")
    p.add_argument("--scenes", default=SCENES)
    p.add_argument("--size", default="80x60")
    p.add_argument("--seeds", type=int, default=8)
    p.add_argument("--spp", type=int, default=16)
    p.add_argument("--particles", default="300k")
    p.add_argument("--modes", default="zonal,corrected")
    p.add_argument("--mitsuba-spp", type=int, default=2048)
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


def summary(values):
    values = np.array(values)
    return values.mean(), values.std(ddof=1) / np.sqrt(len(values)) if len(values) > 1 else 0.0


def hemilux(args, scene, mode, folder):
    means = []
    for seed in range(args.seeds):
        out = os.path.join(folder, "ours.exr")
        subprocess.run([args.binary, "render", scene, "-o", out, "--size", args.size, "--spp", str(args.spp), "--mode", mode,
                        "--particles", args.particles, "--seed", str(seed), "--quiet"], check=True)
        means.append(read(out)[..., 1].mean())
    return summary(means)


def mitsuba(args, scene, size):
    from pbrt_to_mitsuba import Reader

    reader = Reader(mi, scene, {})
    world = mi.load_dict(reader.dictionary(*size))
    depth = -1 if reader.max_depth is None else reader.max_depth + 1
    integrator = mi.load_dict({"type": "path", "max_depth": depth, "rr_depth": 5})
    spp = max(1, args.mitsuba_spp // 16)
    return summary([np.array(mi.render(world, integrator=integrator, spp=spp, seed=k))[..., 1].mean() for k in range(16)])


def radiance(args, stem, size, photons, folder):
    env = {**os.environ, "PATH": os.path.abspath(args.radiance) + ":" + os.environ["PATH"],
           "RAYPATH": ".:" + os.path.abspath(os.path.join(args.radiance, "..", "lib"))}

    def shell(command):
        return subprocess.run(["bash", "-o", "pipefail", "-c", command], cwd=folder, env=env, capture_output=True)

    for suffix in (".rad", ".vf"):
        shutil.copy(stem + suffix, os.path.join(folder, "s" + suffix))
    shell("rm -f *.amb *.pm; oconv -f s.rad > s.oct")
    ambient, maps = "-ab 5 -aa .2 -ar 64 -ad 512 -as 128", ""
    if photons:
        # Without casters there is no caustic map to be had.
        if shell("timeout 200 mkpmap -n 2 -apm 200 -fo+ -apg g.pm 100k -apc c.pm 300k s.oct").returncode:
            shell("timeout 200 mkpmap -n 2 -fo+ -apg g.pm 100k s.oct")
        maps = "-ap g.pm 50" + (" -ap c.pm 50" if os.path.exists(os.path.join(folder, "c.pm")) else "")
        ambient = "-ab 1 -aa .2 -ar 64 -ad 512 -as 128"
    width, height = size
    options = f"-n 2 {RTRACE} {maps} {ambient} -af a.amb"
    for pixels, out in (("-c 1", "/dev/null"), ("-c 4 -pj 1", "p.raw")):
        run = shell(f"vwrays -ff -vf s.vf -x {width} -y {height} {pixels} | timeout 300 rtrace {options} s.oct > {out}")
        if run.returncode:
            return None
    picture = np.fromfile(os.path.join(folder, "p.raw"), np.float32)
    return (picture.reshape(-1, 3)[:, 1].mean(), 0.0) if picture.size == width * height * 12 else None


def main():
    args = arguments()
    mi.set_variant(args.variant)
    mi.set_log_level(mi.LogLevel.Error)
    import masking  # noqa: F401 (registers a BSDF of the variant that was just set)
    from mitsuba_check import with_box_filter

    print("scene | mode | hemilux's mean | / Mitsuba | / Radiance classic | / Radiance pmap | / reference")
    for name in args.scenes.split(","):
        size = tuple(map(int, args.size.split("x")))
        folder = os.path.join(args.folder, name)
        stem = os.path.join(folder, "scene" if name.startswith("public/") else name)
        with tempfile.TemporaryDirectory() as temporary:
            scene = with_box_filter(stem + ".pbrt", temporary)
            peers = [mitsuba(args, stem + ".pbrt", size)]
            has_rad = args.radiance and os.path.exists(stem + ".rad")
            peers += [radiance(args, stem, size, photons, temporary) if has_rad else None for photons in (False, True)]
            reference = os.path.join(folder, "reference.exr")
            peers.append((read(reference)[..., 1].mean(), 0.0) if os.path.exists(reference) else None)
            for mode in args.modes.split(","):
                ours = hemilux(args, scene, mode, temporary)
                cells = [f"{ours[0]:.5g} ± {ours[1]:.2g}"]
                for peer in peers:
                    if peer is None:
                        cells.append("–")
                        continue
                    ratio = ours[0] / peer[0]
                    error = ratio * np.hypot(ours[1] / ours[0], peer[1] / peer[0])
                    cells.append(f"{ratio:.4f} ± {error:.4f}")
                print(f"{name} | {mode} | " + " | ".join(cells), flush=True)


main()
