#!/usr/bin/env python3
"""A lamp under a mirrored dome, by `hemilux sense`, against an oracle that shares nothing with hemilux.

    python3 bench/dome.py [--seeds 100] [--few 5] [--binary target/release/hemilux] [--only sphere,ellipsoid,...]

Lamps of radius 0.1, 0.01 and 0.003 m and equal flux, at (0, 0, 2) under a dome of reflectance 0.9; sensors at x = 1, 1.001 and
1.02 m face up; everything else is black. The truth is a sum over directions in double precision: rays on a square
grid of (dx/dz, dy/dz) are reflected until they meet the lamp or the floor, and cells where the ray passes near the lamp are cut up
again and again, until the lamp's image is some hundred cells across. Straight light is the closed form pi L r^2 / d^2 cos.

sphere: nine cases, `--seeds` seeds each; *covers* counts intervals that hold the truth (pooled: 93 to 97 % is asked for).
moved, turned, scaled: the same dome moved by (10, 20, 5) m, turned by 40 degrees about x and 30 about z, 100 times as large.
ellipsoid: semi-axes 3.3, 2.8 and 2.7 m, a pbrt conductor (Fresnel; 0.9 at normal incidence). `--few` seeds each.

Needs numpy. Times are of the command, start included (three sensors).
"""
import argparse
import math
import os
import subprocess
import tempfile
import time

import numpy as np

RADII = [(0.1, 100.0), (0.01, 10_000.0), (0.003, 1e6 / 9)]
XS = [1.0, 1.001, 1.02]
LAMP = np.array([0.0, 0.0, 2.0])
FLOOR = -0.01
BOUNCES = 8


def constant(cos):
    return np.full_like(cos, 0.9)


def fresnel(cos):
    """Unpolarised reflectance of a conductor with index 1 and k = 2 sqrt(r) / sqrt(1 - r), r = 0.9, as pbrt-v4 has it."""
    k2 = 4 * 0.9 / (1 - 0.9)
    s2 = 1 - cos**2
    t0 = 1 - k2 - s2
    a2b2 = np.sqrt(t0**2 + 4 * k2)
    a = np.sqrt(np.maximum(0.5 * (a2b2 + t0), 0))
    rs = (a2b2 + cos**2 - 2 * a * cos) / (a2b2 + cos**2 + 2 * a * cos)
    rp = rs * (cos**2 * a2b2 + s2**2 - 2 * a * cos * s2) / (cos**2 * a2b2 + s2**2 + 2 * a * cos * s2)
    return 0.5 * (rs + rp)


def chains(origin, d, axes, radius, reflectance):
    """Throughput of rays that meet the lamp after at least one reflection, and how near to it each came (m)."""
    n = len(d)
    o = np.broadcast_to(origin, d.shape).copy()
    weight, alive = np.ones(n), np.arange(n)
    result, nearest = np.zeros(n), np.full(n, np.inf)
    for bounce in range(BOUNCES):
        # The dome from inside: |(o + t d) / axes| = 1, the far root.
        p, q = o / axes, d / axes
        a, b, c = (q * q).sum(1), (p * q).sum(1), (p * p).sum(1) - 1
        t = (-b + np.sqrt(np.maximum(b * b - a * c, 0))) / a
        to_floor = np.where(d[:, 2] < 0, (FLOOR - o[:, 2]) / np.where(d[:, 2] < 0, d[:, 2], 1), np.inf)
        along = ((LAMP - o) * d).sum(1)
        miss = np.linalg.norm(LAMP - o - along[:, None] * d, axis=1)
        ahead = (along > 0) & (along < np.minimum(t, to_floor))
        hit = ahead & (miss < radius)
        if bounce > 0:
            result[alive[hit]] = weight[hit]
            nearest[alive[ahead]] = np.minimum(nearest[alive[ahead]], miss[ahead])
        on = ~hit & (to_floor > t)
        if not on.any():
            break
        alive, o, d, weight = alive[on], o[on] + t[on, None] * d[on], d[on], weight[on]
        normal = o / axes**2
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        cos = (d * normal).sum(1)
        weight = weight * reflectance(np.abs(cos))
        d = d - 2 * cos[:, None] * normal
    return result, nearest


def mirrored(x, axes, radius, radiance, reflectance):
    """Irradiance by way of the dome, over the plane (dx/dz, dy/dz): cos dw = dU dV cos^4."""
    origin = np.array([x, 0.0, 0.0])
    half, side = 40.0, 500
    edge = (np.arange(side) + 0.5) / side * 2 - 1
    # Cells grow outwards; beyond dx/dz = 40 no more than 1 in 1000 of a hemisphere's irradiance is left.
    u = np.stack(np.meshgrid(edge, edge), -1).reshape(-1, 2)
    size = 2.0 / side

    def rays(s):
        k = half * np.abs(s) ** 3 * np.sign(s) * 0.98 + 0.02 * half * s
        jacobian = half**2 * np.prod(3 * s**2 * 0.98 + 0.02, axis=1)
        d = np.concatenate([k, np.ones((len(s), 1))], 1)
        length = np.linalg.norm(d, axis=1)
        return d / length[:, None], jacobian / length**4

    level = 0
    while True:
        d, weight = rays(u)
        value, nearest = chains(origin, d, axes, radius, reflectance)
        cells = (value > 0).sum()
        if cells > 100_000 or level > 24:
            return radiance * (value * weight).sum() * size**2, cells
        # How fast the closest approach changes over a cell: twice what its neighbours differ by, as met in this level.
        e = 0.5 * size
        slope = 0
        for shift in ([e, 0], [0, e]):
            _, moved = chains(origin, rays(u + np.array(shift))[0], axes, radius, reflectance)
            both = np.isfinite(moved) & np.isfinite(nearest)
            slope = slope + np.where(both, np.abs(moved - np.where(both, nearest, 0)), np.inf)
        keep = (nearest < radius + 6 * slope + 1e-9) & np.isfinite(nearest)
        if level == 0:
            # Cells at the rim of what is met are kept whatever they say.
            keep |= np.isfinite(nearest) & ~np.isfinite(slope)
        u, step = u[keep], size / 2
        offsets = (np.arange(2) - 0.5) * step
        u = (u[:, None, :] + np.stack(np.meshgrid(offsets, offsets), -1).reshape(1, -1, 2)).reshape(-1, 2)
        size, level = step, level + 1


def truth(x, axes, radius, radiance, reflectance):
    to = LAMP - np.array([x, 0.0, 0.0])
    direct = math.pi * radiance * radius**2 / (to @ to) * to[2] / np.linalg.norm(to)
    by_dome, _ = mirrored(x, axes, radius, radiance, reflectance)
    return direct + by_dome


def rotation(about_x, about_z):
    a, b = math.radians(about_x), math.radians(about_z)
    rx = np.array([[1, 0, 0], [0, math.cos(a), -math.sin(a)], [0, math.sin(a), math.cos(a)]])
    rz = np.array([[math.cos(b), -math.sin(b), 0], [math.sin(b), math.cos(b), 0], [0, 0, 1]])
    return rz @ rx


def rad(radius, radiance, turn=np.eye(3), scale=1.0, move=(0.0, 0.0, 0.0)):
    """A Radiance scene, and where a point and a direction of the plain dome lie in it."""
    place = lambda p: scale * (turn @ np.asarray(p)) + np.asarray(move)
    words = lambda v: " ".join(f"{c:.9g}" for c in v)
    up = turn @ np.array([0.0, 0.0, 1.0])
    text = f"""void light lamp 0 0 3 {radiance} {radiance} {radiance}
lamp sphere bulb 0 0 4 {words(place(LAMP))} {scale * radius}
void metal shiny 0 0 5 .9 .9 .9 1 0
shiny bubble dome 0 0 4 {words(place([0, 0, 0]))} {scale * 3}
void plastic black 0 0 5 0 0 0 0 0
black ring floor 0 0 8 {words(place([0, 0, FLOOR]))} {words(up)} 0 {scale * 2.9995}
"""
    return text, place, up


def pbrt(radius, radiance, axes):
    return f"""LookAt 0 -2 1  0 0 1  0 0 1
Camera "perspective" "float fov" [ 60 ]
WorldBegin
AttributeBegin
  Material "conductor" "rgb reflectance" [ 0.9 0.9 0.9 ] "float roughness" [ 0 ]
  Scale {axes[0]} {axes[1]} {axes[2]}
  Shape "sphere" "float radius" [ 1 ]
AttributeEnd
AttributeBegin
  Material "diffuse" "rgb reflectance" [ 0 0 0 ]
  Shape "bilinearmesh" "point3 P" [ -4 -4 {FLOOR}  4 -4 {FLOOR}  -4 4 {FLOOR}  4 4 {FLOOR} ]
AttributeEnd
AttributeBegin
  Material "diffuse" "rgb reflectance" [ 0 0 0 ]
  AreaLightSource "diffuse" "rgb L" [ {radiance} {radiance} {radiance} ]
  Translate 0 0 2
  Shape "sphere" "float radius" [ {radius} ]
AttributeEnd
"""


def read(binary, scene, sensors, seed):
    begin = time.time()
    lines = "".join(" ".join(f"{c:.9g}" for c in (*p, *n)) + "\n" for p, n in sensors)
    run = subprocess.run([binary, "sense", scene, "--ci", "--quantity", "irradiance", "--quiet", "--seed", str(seed)],
                         input=lines, capture_output=True, text=True)
    if run.returncode not in (0, 4):
        raise SystemExit(run.stderr)
    return [tuple(map(float, line.split())) for line in run.stdout.splitlines()], time.time() - begin


def series(name, options, scene, sensors, truths, seeds, totals):
    for (radius, radiance), row in zip(RADII, truths):
        text, suffix, at = scene(radius, radiance)
        path = os.path.join(options.folder, f"{name}-{radius}{suffix}")
        with open(path, "w") as f:
            f.write(text)
        found, times = [], []
        for seed in range(seeds):
            values, spent = read(options.binary, path, [at(x) for x in XS], seed)
            found.append(values)
            times.append(spent)
        found = np.array(found)
        for k, x in enumerate(XS):
            value, half = found[:, k, 0], found[:, k, 1]
            covers = int((np.abs(value - row[k]) <= half).sum())
            worst = np.abs(value / row[k] - 1).max()
            error = value.std(ddof=1) / math.sqrt(seeds) / row[k] if seeds > 1 else float("nan")
            print(f"{name:9} | {radius} | {x} | {row[k]:.5f} | {value.mean() / row[k] - 1:+.5f} ± {error:.5f} | "
                  f"{half.mean() / row[k]:.4f} | {worst:.4f} | {covers} of {seeds} | {np.median(times):.2f}", flush=True)
            totals.append((name, covers, seeds, worst))


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--seeds", type=int, default=100)
    p.add_argument("--few", type=int, default=5)
    p.add_argument("--binary", default="target/release/hemilux")
    p.add_argument("--only", default="sphere,moved,turned,scaled,ellipsoid")
    options = p.parse_args()
    only = options.only.split(",")
    sphere, ellipsoid = np.array([3.0, 3.0, 3.0]), np.array([3.3, 2.8, 2.7])
    round_truth = [[truth(x, sphere, r, l, constant) for x in XS] for r, l in RADII]
    stretched = [[truth(x, ellipsoid, r, l, fresnel) for x in XS] for r, l in RADII]
    totals = []
    print("dome | lamp radius | x | truth W/m2 | mean value / truth - 1 | half-width | worst | covers | s (median)")
    ways = {
        "sphere": {},
        "moved": {"move": (10.0, 20.0, 5.0)},
        "turned": {"turn": rotation(40, 30)},
        "scaled": {"scale": 100.0},
    }
    with tempfile.TemporaryDirectory() as options.folder:
        for name, how in ways.items():
            if name not in only:
                continue

            def scene(radius, radiance):
                text, place, up = rad(radius, radiance, **how)
                return text, ".rad", lambda x: (place([x, 0, 0]), up)

            series(name, options, scene, XS, round_truth, options.seeds if name == "sphere" else options.few, totals)
        if "ellipsoid" in only:
            series("ellipsoid", options, lambda r, l: (pbrt(r, l, ellipsoid), ".pbrt", lambda x: ([x, 0, 0], [0, 0, 1])),
                   XS, stretched, options.few, totals)
    for name in only:
        rows = [t for t in totals if t[0] == name]
        covers, seeds = sum(t[1] for t in rows), sum(t[2] for t in rows)
        if seeds:
            print(f"{name}: {covers} of {seeds} intervals cover ({100 * covers / seeds:.1f} %), worst value {100 * max(t[3] for t in rows):.2f} % off")


main()
