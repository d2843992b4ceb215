#!/usr/bin/env python3
"""How far Mitsuba's rays start off the surfaces they leave, and what that does to images of a tiny luminaire.

    V/bin/python bench/peers/ray_offset.py SCENE.xml --point X,Y,Z --ball X,Y,Z,R [--ball ...] [--rays N]

SCENE: mirrors that reflect 90 % and a small luminaire. Rays leave POINT (on a floor that faces up) evenly into the
cones around the balls (around the caster and its images by flat mirrors), follow mirrors, and count what they meet:
the irradiance by those images, with a standard error. Once with rays that start where Mitsuba starts them,
(1 + largest coordinate) x 8.9e-5 off the surface, and once 5e-6 off.
"""
import argparse

import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant('llvm_ad_rgb')
REFLECTANCE = 0.9
LONGEST = 5


def arrived(scene, point, ball, n, seed, offset):
    """Sum and sum of squares of what n rays towards the ball bring."""
    rng = mi.PCG32(size=n, initstate=seed)
    to = mi.Point3f(*ball[:3]) - mi.Point3f(*point)
    distance = dr.norm(to)
    height = 1 - dr.sqrt(1 - (ball[3] / distance) ** 2)
    u, phi = rng.next_float32(), 2 * dr.pi * rng.next_float32()
    z = 1 - u * height
    r = dr.sqrt(dr.abs(1 - z * z))
    w = mi.Frame3f(to / distance).to_world(mi.Vector3f(r * dr.cos(phi), r * dr.sin(phi), z))
    beta = dr.select(w.z > 0, w.z, 0) * 2 * dr.pi * height
    ray = mi.Ray3f(mi.Point3f(*point) + mi.Vector3f(0, 0, 5e-6), w)
    active, found = mi.Bool(True), dr.zeros(mi.Float, n)
    for _ in range(LONGEST):
        si = scene.ray_intersect(ray, active)
        shines = mi.luminance(si.emitter(scene).eval(si, active))
        found += dr.select(active & si.is_valid(), beta * shines, 0)
        active &= si.is_valid() & mi.has_flag(si.bsdf().flags(), mi.BSDFFlags.DeltaReflection)
        beta *= REFLECTANCE
        d = si.to_world(mi.reflect(si.wi))
        ray = si.spawn_ray(d) if offset is None else mi.Ray3f(si.p + si.n * dr.mulsign(mi.Float(offset), dr.dot(si.n, d)), d)
    return np.array([dr.sum(found)[0], dr.sum(found * found)[0]], float)


def main():
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument('scene')
    ap.add_argument('--point', required=True)
    ap.add_argument('--ball', action='append', required=True)
    ap.add_argument('--rays', type=int, default=1 << 26)
    a = ap.parse_args()
    scene = mi.load_file(a.scene, optimize=False)
    point = [float(x) for x in a.point.split(',')]
    n = 1 << 22
    runs = max(a.rays // n, 1)
    for name, offset in (('as Mitsuba has it', None), ('5e-6', 5e-6)):
        mean = variance = 0.0
        for ball in a.ball:
            s = sum(arrived(scene, point, [float(x) for x in ball.split(',')], n, 1 + k, offset) for k in range(runs))
            m = s / (n * runs)
            mean += m[0]
            variance += (m[1] - m[0] ** 2) / (n * runs)
        print(f'rays start off surfaces by {name}: irradiance {mean:.5f} +- {variance ** 0.5:.5f}', flush=True)


if __name__ == '__main__':
    main()
