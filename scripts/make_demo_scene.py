#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes samples/data/pullback.glb: two kinds of trees, a rolling ground, a sun, and a camera that pulls back from a
leaf to the forest. Only the standard library; same file every time.

Usage: scripts/make_demo_scene.py [OUT.glb]
"""
import argparse
import json
import math
import random
import struct
from pathlib import Path


# ---------------------------------------------------------------------------------------------- vectors
def add(a, b): return (a[0] + b[0], a[1] + b[1], a[2] + b[2])
def mul(a, s): return (a[0] * s, a[1] * s, a[2] * s)
def sub(a, b): return add(a, mul(b, -1.0))
def dot(a, b): return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
def cross(a, b): return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
def unit(a): return mul(a, 1.0 / math.sqrt(dot(a, a)))


def basis(axis):
    """Two unit vectors orthogonal to axis and to each other."""
    helper = (1.0, 0.0, 0.0) if abs(axis[0]) < 0.9 else (0.0, 1.0, 0.0)
    x = unit(cross(helper, axis))
    return x, cross(axis, x)


def tilted(axis, angle, azimuth):
    """axis, tilted by angle towards the azimuth around it."""
    x, y = basis(axis)
    side = add(mul(x, math.cos(azimuth)), mul(y, math.sin(azimuth)))
    return add(mul(axis, math.cos(angle)), mul(side, math.sin(angle)))


# ---------------------------------------------------------------------------------------------- trees
class Part:
    """Triangles of one material."""

    def __init__(self):
        self.positions = []
        self.indices = []

    def tube(self, points, radii, sides):
        """An open tube around a polyline; rings share vertices."""
        first = len(self.positions)
        for i, point in enumerate(points):
            axis = unit(sub(points[min(i + 1, len(points) - 1)], points[max(i - 1, 0)]))
            x, y = basis(axis)
            for s in range(sides):
                a = 2 * math.pi * s / sides
                self.positions.append(add(point, mul(add(mul(x, math.cos(a)), mul(y, math.sin(a))), radii[i])))
        for i in range(len(points) - 1):
            for s in range(sides):
                a, b = first + i * sides + s, first + i * sides + (s + 1) % sides
                self.indices += [a, b, b + sides, a, b + sides, a + sides]


class Tree:
    """Bark plus three kinds of leaves, grown from a list of parameters per order of branch."""

    def __init__(self, seed, levels, leaf_length, leaf_width, leaves_per_twig):
        self.rng = random.Random(seed)
        self.bark = Part()
        self.leaves = [Part(), Part(), Part()]
        self.levels = levels
        self.leaf_length, self.leaf_width, self.leaves_per_twig = leaf_length, leaf_width, leaves_per_twig
        self.branch((0.0, -0.1, 0.0), (0.0, 1.0, 0.0), levels[0]["length"], levels[0]["radius"], 0)

    def branch(self, start, direction, length, radius, depth):
        rng, level = self.rng, self.levels[depth]
        points, radii = [start], [radius]
        for i in range(1, level["segments"] + 1):
            bend = tilted(direction, rng.gauss(0, level["wobble"]), rng.uniform(0, math.pi))
            direction = unit(add(bend, (0.0, level["lift"], 0.0)))
            points.append(add(points[-1], mul(direction, length / level["segments"])))
            radii.append(radius * (1 - 0.75 * i / level["segments"]))
        self.bark.tube(points, radii, level["sides"])
        if depth + 1 == len(self.levels):
            self.grow_leaves(points)
        else:
            self.grow_children(points, radii, depth)

    @staticmethod
    def along(points, t):
        t = min(max(t, 0.0), 0.9999) * (len(points) - 1)
        i = int(t)
        edge = sub(points[i + 1], points[i])
        return add(points[i], mul(edge, t - i)), unit(edge)

    def grow_children(self, points, radii, depth):
        rng, child = self.rng, self.levels[depth + 1]
        azimuth = rng.uniform(0, 2 * math.pi)
        for c in range(child["count"]):
            t = child["from"] + (1.0 - child["from"]) * (c + rng.uniform(0, 0.6)) / child["count"]
            start, axis = self.along(points, t)
            azimuth += 2.39996 + rng.gauss(0, 0.3)
            direction = tilted(axis, child["angle"] * rng.uniform(0.8, 1.2), azimuth)
            scale = child["shape"](t) * rng.uniform(0.8, 1.2)
            here = radii[min(int(t * (len(radii) - 1)), len(radii) - 2)]
            self.branch(start, direction, child["length"] * scale, min(child["radius"] * scale, 0.8 * here), depth + 1)

    def grow_leaves(self, points):
        """Each leaf: two triangles folded along the midrib, hanging a little."""
        rng = self.rng
        part = rng.choice(self.leaves)
        for n in range(self.leaves_per_twig):
            base, axis = self.along(points, 0.25 + 0.75 * n / self.leaves_per_twig)
            rib = unit(add(tilted(axis, rng.uniform(0.5, 1.3), rng.uniform(0, 2 * math.pi)), (0.0, -0.15, 0.0)))
            side = unit(cross(rib, unit((rng.gauss(0, 0.5), 1.0, rng.gauss(0, 0.5)))))
            fold = mul(cross(side, rib), 0.25 * self.leaf_width)
            size = rng.uniform(0.7, 1.25)
            middle = add(base, mul(rib, 0.45 * size * self.leaf_length))
            tip = add(base, mul(rib, size * self.leaf_length))
            left = add(add(middle, mul(side, 0.5 * size * self.leaf_width)), fold)
            right = add(add(middle, mul(side, -0.5 * size * self.leaf_width)), fold)
            first = len(part.positions)
            part.positions += [base, right, tip, left]
            part.indices += [first, first + 1, first + 2, first, first + 2, first + 3]


def broadleaf():
    def round_crown(t):
        return 0.45 + 0.75 * math.sin(math.pi * min(1.0, max(0.0, (t - 0.25) / 0.75)) ** 0.8)

    return Tree(1, [
        dict(length=4.6, radius=0.17, segments=7, sides=9, wobble=0.05, lift=0.05),
        dict(length=2.5, radius=0.075, segments=5, sides=6, wobble=0.10, lift=0.06, count=16, **{"from": 0.3},
             angle=1.0, shape=round_crown),
        dict(length=1.05, radius=0.026, segments=3, sides=4, wobble=0.15, lift=0.03, count=8, **{"from": 0.2},
             angle=0.8, shape=lambda t: 1.1 - 0.5 * t),
        dict(length=0.42, radius=0.009, segments=2, sides=3, wobble=0.2, lift=0.0, count=6, **{"from": 0.15},
             angle=0.8, shape=lambda t: 1.0),
    ], leaf_length=0.15, leaf_width=0.11, leaves_per_twig=9)


def poplar():
    return Tree(2, [
        dict(length=6.5, radius=0.13, segments=8, sides=8, wobble=0.03, lift=0.05),
        dict(length=1.5, radius=0.045, segments=4, sides=5, wobble=0.08, lift=0.22, count=26, **{"from": 0.15},
             angle=0.75, shape=lambda t: 1.15 - 0.75 * t),
        dict(length=0.55, radius=0.014, segments=2, sides=3, wobble=0.15, lift=0.1, count=9, **{"from": 0.15},
             angle=0.7, shape=lambda t: 1.0),
    ], leaf_length=0.11, leaf_width=0.09, leaves_per_twig=14)


# ---------------------------------------------------------------------------------------------- ground and forest
def ground_height(x, z):
    far = min(1.0, math.hypot(x, z) / 40.0)
    return far * (1.6 * math.sin(0.037 * x + 0.4) * math.cos(0.031 * z) + 0.9 * math.sin(0.011 * x - 0.017 * z))


def ground(half_size=320.0, cells=80):
    part = Part()
    side = cells + 1
    for j in range(side):
        for i in range(side):
            x, z = (2 * i / cells - 1) * half_size, (2 * j / cells - 1) * half_size
            part.positions.append((x, ground_height(x, z), z))
    for j in range(cells):
        for i in range(cells):
            a = j * side + i
            part.indices += [a, a + side, a + 1, a + 1, a + side, a + side + 1]
    return part


def camera_path(target, frames, near=0.55, far=240.0):
    """From `near` metres before the leaf to `far`, evenly in log distance, rising while it goes."""
    path = []
    for n in range(frames):
        t = n / (frames - 1)
        distance = near * (far / near) ** t
        rise = math.radians(4.0 + 15.0 * t * t)
        direction = (math.sin(0.35) * math.cos(rise), math.sin(rise), math.cos(0.35) * math.cos(rise))
        aim = add(mul(target, 1 - t ** 3), mul((0.0, 2.5, 0.0), t ** 3))
        path.append((add(aim, mul(direction, distance)), aim))
    return path


def plant(rng, path, count):
    """Positions at least 4.2 m apart that leave the camera's way free."""
    places = [(0.0, 0.0)]
    while len(places) < count:
        radius = 210.0 * math.sqrt(rng.random())
        angle = rng.uniform(0, 2 * math.pi)
        x, z = radius * math.cos(angle), radius * math.sin(angle)
        if any((x - px) ** 2 + (z - pz) ** 2 < 4.2 ** 2 for px, pz in places):
            continue
        if any(math.hypot(x - eye[0], z - eye[2]) < 4.0 and eye[1] < 11.0 for eye, _ in path):
            continue
        if z > 0 and math.hypot(x, z) < 60 and abs(math.atan2(x, z) - 0.35) < 0.12:
            continue  # the line of sight from the middle of the path
        places.append((x, z))
    return places


# ---------------------------------------------------------------------------------------------- glTF
class Glb:
    def __init__(self):
        self.blob = bytearray()
        self.json = {"asset": {"version": "2.0", "generator": "farfield scripts/make_demo_scene.py"}, "scene": 0,
                     "buffers": [], "bufferViews": [], "accessors": []}

    def accessor(self, values, width, component):
        code = {5126: "f", 5125: "I"}[component]
        flat = [x for v in values for x in v] if width > 1 else list(values)
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.blob), "byteLength": 4 * len(flat)})
        self.blob += struct.pack("<%d%s" % (len(flat), code), *flat)
        accessor = {"bufferView": len(self.json["bufferViews"]) - 1, "componentType": component,
                    "count": len(flat) // width, "type": {1: "SCALAR", 3: "VEC3", 4: "VEC4"}[width]}
        if component == 5126:
            stored = [struct.unpack("<f", struct.pack("<f", x))[0] for x in flat]
            accessor["min"] = [min(stored[i::width]) for i in range(width)]
            accessor["max"] = [max(stored[i::width]) for i in range(width)]
        self.json["accessors"].append(accessor)
        return len(self.json["accessors"]) - 1

    def primitive(self, part, material):
        return {"attributes": {"POSITION": self.accessor(part.positions, 3, 5126)},
                "indices": self.accessor(part.indices, 1, 5125), "material": material}

    def write(self, path):
        self.json["buffers"] = [{"byteLength": len(self.blob)}]
        text = json.dumps(self.json, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        self.blob += b"\0" * (-len(self.blob) % 4)
        with open(path, "wb") as f:
            f.write(struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(self.blob)))
            f.write(struct.pack("<II", len(text), 0x4E4F534A) + text)
            f.write(struct.pack("<II", len(self.blob), 0x004E4942) + self.blob)


def leaf_material(name, color, transmitted):
    return {"name": name, "doubleSided": True,
            "pbrMetallicRoughness": {"baseColorFactor": [*color, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.45},
            "extensions": {"KHR_materials_diffuse_transmission": {
                "diffuseTransmissionFactor": 0.35, "diffuseTransmissionColorFactor": list(transmitted)}}}


def plain_material(name, color):
    return {"name": name, "doubleSided": True,
            "pbrMetallicRoughness": {"baseColorFactor": [*color, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0}}


def look_at_quaternion(eye, aim):
    """Rotation of a glTF camera (looks along -z, y up) at eye that looks at aim."""
    z = unit(sub(eye, aim))
    x = unit(cross((0.0, 1.0, 0.0), z))
    y = cross(z, x)
    m = [[x[0], y[0], z[0]], [x[1], y[1], z[1]], [x[2], y[2], z[2]]]
    w = math.sqrt(max(0.0, 1 + m[0][0] + m[1][1] + m[2][2])) / 2
    qx = math.copysign(math.sqrt(max(0.0, 1 + m[0][0] - m[1][1] - m[2][2])) / 2, m[2][1] - m[1][2])
    qy = math.copysign(math.sqrt(max(0.0, 1 - m[0][0] + m[1][1] - m[2][2])) / 2, m[0][2] - m[2][0])
    qz = math.copysign(math.sqrt(max(0.0, 1 - m[0][0] - m[1][1] + m[2][2])) / 2, m[1][0] - m[0][1])
    return (qx, qy, qz, w)


def hero_leaf(tree):
    """A leaf on the camera's side of the crown, at about eye height."""
    wanted = (math.sin(0.35), 0.0, math.cos(0.35))
    leaves = [part.positions[i + 2] for part in tree.leaves for i in range(0, len(part.positions), 4)]
    return max((p for p in leaves if 1.6 < p[1] < 3.2), key=lambda p: dot(p, wanted))


def build(path):
    rng = random.Random(7)
    trees = [broadleaf(), poplar()]
    frames = 121
    way = camera_path(hero_leaf(trees[0]), frames)

    glb = Glb()
    doc = glb.json
    doc["extensionsUsed"] = ["KHR_lights_punctual", "KHR_materials_diffuse_transmission"]
    doc["materials"] = [
        plain_material("ground", (0.16, 0.13, 0.07)),
        plain_material("broadleaf bark", (0.14, 0.10, 0.07)),
        leaf_material("broadleaf green", (0.09, 0.19, 0.035), (0.22, 0.38, 0.05)),
        leaf_material("broadleaf light", (0.14, 0.23, 0.04), (0.30, 0.42, 0.06)),
        leaf_material("broadleaf autumn", (0.30, 0.16, 0.03), (0.48, 0.26, 0.04)),
        plain_material("poplar bark", (0.32, 0.30, 0.26)),
        leaf_material("poplar green", (0.12, 0.20, 0.06), (0.26, 0.38, 0.08)),
        leaf_material("poplar yellow", (0.30, 0.26, 0.05), (0.50, 0.42, 0.07)),
        leaf_material("poplar dark", (0.07, 0.14, 0.04), (0.18, 0.30, 0.06)),
    ]
    doc["meshes"] = [{"name": "ground", "primitives": [glb.primitive(ground(), 0)]}]
    for name, tree, bark in (("broadleaf", trees[0], 1), ("poplar", trees[1], 5)):
        parts = [glb.primitive(tree.bark, bark)]
        parts += [glb.primitive(part, bark + 1 + i) for i, part in enumerate(tree.leaves)]
        doc["meshes"].append({"name": name, "primitives": parts})

    doc["nodes"] = [{"name": "ground", "mesh": 0}]
    for i, (x, z) in enumerate(plant(rng, way, 1500)):
        turn = rng.uniform(0, 2 * math.pi) if i else 0.0
        scale = rng.uniform(0.8, 1.3) if i else 1.0
        doc["nodes"].append({"name": "tree %d" % i, "mesh": 1 if i == 0 or rng.random() < 0.6 else 2,
                             "translation": [round(x, 4), round(ground_height(x, z), 4), round(z, 4)],
                             "rotation": [0.0, math.sin(turn / 2), 0.0, math.cos(turn / 2)],
                             "scale": [scale, scale, scale]})
    doc["nodes"].append({"name": "sun", "extensions": {"KHR_lights_punctual": {"light": 0}},
                         "rotation": look_at_quaternion((0.75, 0.85, 0.75), (0.0, 0.0, 0.0))})
    doc["extensions"] = {"KHR_lights_punctual": {"lights": [
        {"type": "directional", "name": "sun", "color": [1.0, 0.93, 0.82], "intensity": 3000.0}]}}
    camera = len(doc["nodes"])
    doc["cameras"] = [{"type": "perspective", "perspective": {"yfov": 0.62, "aspectRatio": 16 / 9, "znear": 0.01}}]
    eye, aim = way[0]
    doc["nodes"].append({"name": "camera", "camera": 0, "translation": list(eye),
                         "rotation": list(look_at_quaternion(eye, aim))})
    times = glb.accessor([n / 24.0 for n in range(frames)], 1, 5126)
    translations = glb.accessor([eye for eye, _ in way], 3, 5126)
    rotations = glb.accessor([look_at_quaternion(eye, aim) for eye, aim in way], 4, 5126)
    doc["animations"] = [{"name": "pullback", "samplers": [
        {"input": times, "output": translations, "interpolation": "LINEAR"},
        {"input": times, "output": rotations, "interpolation": "LINEAR"}],
        "channels": [{"sampler": 0, "target": {"node": camera, "path": "translation"}},
                     {"sampler": 1, "target": {"node": camera, "path": "rotation"}}]}]
    doc["scenes"] = [{"nodes": list(range(len(doc["nodes"])))}]
    glb.write(path)
    for mesh in doc["meshes"]:
        triangles = sum(doc["accessors"][p["indices"]]["count"] // 3 for p in mesh["primitives"])
        print("%-10s %d triangles" % (mesh["name"], triangles))
    print("%s: %d bytes, %d nodes" % (path, Path(path).stat().st_size, len(doc["nodes"])))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="?", type=Path,
                        default=Path(__file__).parent.parent / "samples/data/pullback.glb")
    build(parser.parse_args().scene)
