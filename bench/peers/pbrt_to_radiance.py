"""Writes a pbrt-v4 scene of diffuse surfaces and area luminaires as Radiance's .rad and .vf.

Reads with `pbrt_to_mitsuba.Reader`, so it shares nothing with hemilux either. What Radiance has no equal for (GGX, coats, meshes
with normals of their own) is refused: ratios to another material would say nothing.
"""
import numpy as np

from pbrt_to_mitsuba import Reader, Unsupported, number, rgb


class Diffuse(Reader):
    """Collects primitives in Radiance's words."""

    def __init__(self, path):
        self.words = []
        super().__init__(None, path)

    def on_Shape(self, positional, params):
        kind, p = self.material
        if kind != "diffuse":
            raise Unsupported(f"{kind} in Radiance")
        name = f"m{len(self.words)}"
        if self.light is not None:
            value = rgb(self.light)["value"]
            self.words.append(f"void light {name} 0 0 3 " + " ".join(map(str, value)))
        else:
            value = rgb(p["reflectance"][1] if "reflectance" in p else [0.5])["value"]
            self.words.append(f"void plastic {name} 0 0 5 " + " ".join(map(str, value)) + " 0 0")
        if positional[0] == "sphere":
            scale = np.cbrt(np.linalg.det(self.ctm[:3, :3]))
            place = [*self.ctm[:3, 3], scale * number(params, "radius", 1.0)]
            self.words.append(f"{name} sphere {name}s 0 0 4 " + " ".join(map(repr, map(float, place))))
            return
        points, normals, triangles = self.mesh(positional[0], params)
        for k, corners in enumerate(points[triangles]):
            flat = np.cross(corners[1] - corners[0], corners[2] - corners[0])
            if normals is not None:
                given = normals[triangles[k]]
                sides = given @ flat / np.linalg.norm(given, axis=1) / np.linalg.norm(flat)
                if np.any(np.abs(sides) < 0.999):
                    raise Unsupported("a smoothed mesh in Radiance")
                # Given normals decide to which side a luminaire shines.
                corners = corners if sides[0] > 0 else corners[::-1]
            self.words.append(f"{name} polygon {name}p{k} 0 0 9 " + " ".join(repr(float(x)) for x in corners.ravel()))

    def view(self, width, height):
        """The view with the file's field of view along the shorter side."""
        half = np.tan(np.radians(self.fov) / 2)
        wide, high = (np.degrees(2 * np.arctan(half * side / min(width, height))) for side in (width, height))
        place, towards, up = self.camera[:3, 3], self.camera[:3, 2], self.camera[:3, 1]
        words = [f"-{key} " + " ".join(repr(float(x)) for x in v) for key, v in (("vp", place), ("vd", towards), ("vu", up))]
        return f"rvu -vtv {' '.join(words)} -vh {wide} -vv {high}\n"


def write(path, stem, width, height):
    """`path` as stem.rad and stem.vf; False where Radiance has no equal for it."""
    try:
        scene = Diffuse(path)
    except Unsupported as why:
        print(f"# {path}: {why}: not for Radiance")
        return False
    with open(stem + ".rad", "w") as f:
        f.write("\n".join(scene.words) + "\n")
    with open(stem + ".vf", "w") as f:
        f.write(scene.view(width, height))
    return True
