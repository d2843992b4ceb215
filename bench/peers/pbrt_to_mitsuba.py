"""Reads a small part of the pbrt-v4 scene format and returns a Mitsuba 3 scene dictionary.

Written only from the format's public description, so that it shares nothing with hemilux's own reader. It knows what
the checked scenes use and refuses anything else: Transform, LookAt, Scale, Translate; trianglemesh, plymesh, sphere;
diffuse, conductor, dielectric, coateddiffuse (smooth coat); one-sided diffuse area luminaires.

Conventions that differ between the two programs:
- pbrt's camera space is x right, y up, z forward; Mitsuba's is x left. pbrt's field of view spans the shorter side.
- pbrt's `maxdepth` d counts scatterings, Mitsuba's `max_depth` counts edges: d + 1.
- pbrt's GGX has height-correlated masking, Mitsuba's is the product of two terms: `masking.py`.
- pbrt's BSDFs work on both sides: Mitsuba needs `twosided`.
- A mesh without normals is flat in pbrt; Mitsuba would smooth it: `face_normals`.
"""
import os
import re
import struct

import numpy as np

TOKEN = re.compile(r'#[^\n]*|"([^"]*)"|(\[)|(\])|([^\s\[\]"#]+)')


class Unsupported(Exception):
    """The scene uses something this reader does not know."""


def tokens(text):
    """(kind, value) pairs; kind is 's' for a quoted string, '[' , ']' or 'w' for a bare word."""
    for m in TOKEN.finditer(text):
        if m.group(0).startswith("#"):
            continue
        if m.group(1) is not None:
            yield "s", m.group(1)
        elif m.group(2):
            yield "[", "["
        elif m.group(3):
            yield "]", "]"
        else:
            yield "w", m.group(4)


def directives(text):
    """(name, positional values, {parameter: (type, values)}) for each directive."""
    stream = list(tokens(text))
    i = 0
    while i < len(stream):
        kind, name = stream[i]
        if kind != "w":
            raise Unsupported(f"expected a directive, found {name!r}")
        i += 1
        positional, params = [], {}
        while i < len(stream) and not (stream[i][0] == "w" and re.match("[A-Za-z]", stream[i][1])):
            if stream[i][0] == "s" and " " in stream[i][1].strip():
                kind_name, key = stream[i][1].split()
                values, i = value_list(stream, i + 1)
                params[key] = (kind_name, values)
            else:
                values, i = value_list(stream, i)
                positional += values
        yield name, positional, params


def value_list(stream, i):
    if stream[i][0] != "[":
        return [convert(stream[i])], i + 1
    values = []
    i += 1
    while stream[i][0] != "]":
        values.append(convert(stream[i]))
        i += 1
    return values, i + 1


def convert(token):
    kind, value = token
    if kind == "w":
        return {"true": True, "false": False}[value] if value in ("true", "false") else float(value)
    return {"true": True, "false": False}.get(value, value)


def look_at(eye, target, up):
    eye, target, up = map(np.asarray, (eye, target, up))
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(up / np.linalg.norm(up), forward)
    right /= np.linalg.norm(right)
    camera_to_world = np.eye(4)
    camera_to_world[:3, :3] = np.stack([right, np.cross(forward, right), forward], axis=1)
    camera_to_world[:3, 3] = eye
    return np.linalg.inv(camera_to_world)


def read_ply(path):
    """(points, normals or None, triangles) of a binary little-endian or ASCII PLY file."""
    types = {"float": "f", "float32": "f", "double": "d", "uchar": "B", "uint8": "B", "char": "b", "int8": "b",
             "short": "h", "ushort": "H", "int": "i", "int32": "i", "uint": "I", "uint32": "I"}
    with open(path, "rb") as f:
        data = f.read()
    end = data.index(b"end_header") + len(b"end_header")
    header, body = data[:end].decode("ascii").splitlines(), data[end:].lstrip(b"\r")[1:]
    form, elements = None, []
    for line in header:
        word = line.split()
        if word[0] == "format":
            form = word[1]
        elif word[0] == "element":
            elements.append((word[1], int(word[2]), []))
        elif word[0] == "property":
            elements[-1][2].append(word[1:])
    if form not in ("binary_little_endian", "ascii"):
        raise Unsupported(f"{path}: {form}")
    words, at = (body.split(), 0) if form == "ascii" else (None, 0)

    def take(code, n):
        nonlocal at
        if words is not None:
            part = [float(w) for w in words[at:at + n]]
            at += n
            return part
        part = struct.unpack_from(f"<{n}{code}", body, at)
        at += struct.calcsize(f"<{n}{code}")
        return list(part)

    points = normals = None
    triangles = []
    for name, count, properties in elements:
        rows = []
        for _ in range(count):
            row = {}
            for p in properties:
                if p[0] == "list":
                    n = int(take(types[p[1]], 1)[0])
                    row[p[3]] = take(types[p[2]], n)
                else:
                    row[p[1]] = take(types[p[0]], 1)[0]
            rows.append(row)
        if name == "vertex":
            points = np.array([[r["x"], r["y"], r["z"]] for r in rows])
            if rows and "nx" in rows[0]:
                normals = np.array([[r["nx"], r["ny"], r["nz"]] for r in rows])
        elif name == "face":
            key = "vertex_indices" if "vertex_indices" in rows[0] else "vertex_index"
            for r in rows:
                v = [int(x) for x in r[key]]
                triangles += [(v[0], v[k], v[k + 1]) for k in range(1, len(v) - 1)]
    return points, normals, np.array(triangles)


class Reader:
    """Collects a Mitsuba dictionary while it walks through the directives.

    `overrides` replaces values of every rough conductor, for hypotheses: "distribution" (ggx, beckmann),
    "specular_reflectance" (a number), "masking" (correlated, or separable: Mitsuba's own); and "luminaires": black
    makes luminaires reflect nothing, whatever material the file gives them.
    """

    def __init__(self, mi, path, overrides=None):
        self.mi, self.folder, self.overrides = mi, os.path.dirname(os.path.abspath(path)), overrides or {}
        self.scene = {"type": "scene"}
        self.named, self.stack = {}, []
        self.ctm, self.material, self.light = np.eye(4), ("diffuse", {}), None
        self.width, self.height, self.fov, self.max_depth, self.camera = 1280, 720, 90.0, 5, None
        with open(path) as f:
            text = f.read()
        for name, positional, params in directives(text):
            method = getattr(self, "on_" + name, None)
            if method is None:
                raise Unsupported(name)
            method(positional, params)

    def ignore(self, positional, params):
        pass

    on_Sampler = on_PixelFilter = on_Accelerator = ignore

    def on_Integrator(self, _, params):
        self.max_depth = int(number(params, "maxdepth", 5))

    def on_Film(self, _, params):
        self.width, self.height = int(number(params, "xresolution", 1280)), int(number(params, "yresolution", 720))

    def on_Camera(self, positional, params):
        if positional != ["perspective"]:
            raise Unsupported(f"camera {positional}")
        self.fov, self.camera = number(params, "fov", 90.0), np.linalg.inv(self.ctm)

    def on_WorldBegin(self, *_):
        self.ctm = np.eye(4)

    def on_AttributeBegin(self, *_):
        self.stack.append((self.ctm.copy(), self.material, self.light))

    def on_AttributeEnd(self, *_):
        self.ctm, self.material, self.light = self.stack.pop()

    def on_Transform(self, positional, _):
        self.ctm = np.array(positional).reshape(4, 4).T

    def on_LookAt(self, p, _):
        self.ctm = self.ctm @ look_at(p[0:3], p[3:6], p[6:9])

    def on_Scale(self, p, _):
        self.ctm = self.ctm @ np.diag([*p, 1.0])

    def on_Translate(self, p, _):
        shift = np.eye(4)
        shift[:3, 3] = p
        self.ctm = self.ctm @ shift

    def on_MakeNamedMaterial(self, positional, params):
        self.named[positional[0]] = (params["type"][1][0], params)

    def on_NamedMaterial(self, positional, _):
        self.material = self.named[positional[0]]

    def on_Material(self, positional, params):
        self.material = (positional[0], params)

    def on_AreaLightSource(self, positional, params):
        if positional != ["diffuse"] or set(params) != {"L"}:
            raise Unsupported(f"area luminaire {positional} {sorted(params)}")
        self.light = params["L"][1]

    def on_Shape(self, positional, params):
        kind = positional[0]
        if kind == "sphere":
            if set(params) - {"radius"}:
                raise Unsupported(f"sphere {sorted(params)}")
            linear = self.ctm[:3, :3]
            scale = np.cbrt(np.linalg.det(linear))
            if scale < 0 or not np.allclose(linear @ linear.T, scale**2 * np.eye(3), atol=1e-6):
                raise Unsupported("a sphere that is mirrored or not scaled evenly")
            shape = {"type": "sphere", "center": self.ctm[:3, 3].tolist(),
                     "radius": scale * number(params, "radius", 1.0)}
        elif kind in ("trianglemesh", "plymesh"):
            shape = self.mesh(kind, params)
        else:
            raise Unsupported(f"shape {kind}")
        black = self.light is not None and self.overrides.get("luminaires") == "black"
        bsdf = {"type": "diffuse", "reflectance": rgb([0.0])} if black else self.bsdf()
        emitter = {} if self.light is None else {"emitter": {"type": "area", "radiance": rgb(self.light)}}
        name = f"shape{sum(k.startswith('shape') for k in self.scene):04}"
        if isinstance(shape, dict):
            self.scene[name] = {**shape, **emitter, "bsdf": bsdf}
        else:
            self.scene[name] = self.build_mesh(name, shape, {**emitter, "bsdf": bsdf})

    def mesh(self, kind, params):
        if kind == "plymesh":
            points, normals, triangles = read_ply(os.path.join(self.folder, params["filename"][1][0]))
        else:
            points = np.array(params["P"][1]).reshape(-1, 3)
            normals = np.array(params["N"][1]).reshape(-1, 3) if "N" in params else None
            triangles = np.array(params["indices"][1], int).reshape(-1, 3)
        points = points @ self.ctm[:3, :3].T + self.ctm[:3, 3]
        if np.linalg.det(self.ctm[:3, :3]) < 0:
            raise Unsupported("a mirrored mesh")
        if normals is not None:
            normals = normals @ np.linalg.inv(self.ctm[:3, :3])
        return points, normals, triangles

    def build_mesh(self, name, mesh, parts):
        points, normals, triangles = mesh
        mi = self.mi
        props = mi.Properties()
        for key, part in parts.items():
            props[key] = mi.load_dict(part)
        if normals is None:
            props["face_normals"] = True
        built = mi.Mesh(name, len(points), len(triangles), has_vertex_normals=normals is not None, props=props)
        values = mi.traverse(built)
        values["vertex_positions"] = points.ravel().astype(np.float32)
        values["faces"] = triangles.ravel().astype(np.uint32)
        if normals is not None:
            values["vertex_normals"] = normals.ravel().astype(np.float32)
        values.update()
        return built

    def bsdf(self):
        kind, p = self.material
        if kind == "diffuse":
            inner = {"type": "diffuse", "reflectance": rgb(p["reflectance"][1] if "reflectance" in p else [0.5] * 3)}
        elif kind == "conductor":
            inner = self.conductor(p)
        elif kind == "dielectric":
            if any(number(p, k, 0.0) != 0 for k in ("roughness", "uroughness", "vroughness")):
                raise Unsupported("rough dielectric")
            return {"type": "dielectric", "int_ior": number(p, "eta", 1.5), "ext_ior": 1.0}
        elif kind == "coateddiffuse":
            if any(number(p, k, 0.0) != 0 for k in ("roughness", "uroughness", "vroughness")):
                raise Unsupported("rough coat")
            inner = {"type": "plastic", "nonlinear": True, "int_ior": number(p, "eta", 1.5), "ext_ior": 1.0,
                     "diffuse_reflectance": rgb(p["reflectance"][1])}
        else:
            raise Unsupported(f"material {kind}")
        return {"type": "twosided", "nested": inner}

    def conductor(self, p):
        if "reflectance" in p:
            r = np.array(p["reflectance"][1])
            eta, k = np.ones(3), 2 * np.sqrt(r) / np.sqrt(1 - r)
        else:
            eta, k = np.array(p["eta"][1]), np.array(p["k"][1])
        both = number(p, "roughness", 0.0)
        alpha = [number(p, key, both) for key in ("uroughness", "vroughness")]
        if "remaproughness" not in p or p["remaproughness"][1][0]:
            alpha = [np.sqrt(a) for a in alpha]
        inner = {"type": "conductor", "eta": rgb(eta), "k": rgb(k)}
        if max(alpha) > 0:
            inner |= {"type": "roughconductor", "distribution": self.overrides.get("distribution", "ggx"),
                      "alpha_u": float(alpha[0]), "alpha_v": float(alpha[1])}
        if "specular_reflectance" in self.overrides:
            inner["specular_reflectance"] = rgb([float(self.overrides["specular_reflectance"])] * 3)
        if max(alpha) > 0 and self.overrides.get("masking", "correlated") == "correlated":
            inner = {"type": "heightcorrelated", "nested": inner, "normals": inner["distribution"],
                     "alpha_u": inner["alpha_u"], "alpha_v": inner["alpha_v"]}
        return inner

    def dictionary(self, width, height):
        """The scene with a box filter (samples are averaged in their own pixel) at the given film size."""
        to_world = self.camera @ np.diag([-1.0, 1.0, 1.0, 1.0])
        to_world[:3, :3] /= np.linalg.norm(to_world[:3, :3], axis=0)
        self.scene["sensor"] = {
            "type": "perspective", "fov": self.fov, "fov_axis": "smaller", "near_clip": 1e-3, "far_clip": 1e5,
            "to_world": self.mi.ScalarTransform4f(to_world.tolist()),
            "film": {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"},
                     "pixel_format": "rgb", "component_format": "float32"},
            "sampler": {"type": "independent"},
        }
        return self.scene


def number(params, key, default):
    return float(params[key][1][0]) if key in params else default


def rgb(values):
    values = [float(v) for v in values]
    return {"type": "rgb", "value": values if len(values) == 3 else values[:1] * 3}
