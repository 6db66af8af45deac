#!/usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Writes the generated assets of docs/results/fidelity.md, each of a kind that levels of detail get wrong easily.

Usage: scripts/make_fidelity_assets.py FOLDER [--turned] [NAME...]     without names: all

--turned: every tube is turned about its axis by a random angle; without it all tubes along a direction have the same few normals.
"""
import json
import math
import random
import struct
import sys
from pathlib import Path


class Mesh:
    """Vertices and faces by material; written as .glb."""
    turns = None  # of tubes about their axes, random numbers

    def __init__(self):
        self.points, self.faces = [], []

    def add(self, points, faces, material):
        first = len(self.points)
        self.points += points
        self.faces += [(material, [first + i for i in face]) for face in faces]

    def quad(self, a, b, c, d, material):
        self.add([a, b, c, d], [(0, 1, 2, 3)], material)

    def box(self, low, high, material):
        points = [tuple((low, high)[i >> axis & 1][axis] for axis in range(3)) for i in range(8)]
        self.cuboid(points, material)

    def cuboid(self, points, material):
        """Eight corners, as bits of their number say."""
        self.add(points, [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)], material)

    def slab(self, low, high, material):
        """Between two quads."""
        self.add(low + high, [(3, 2, 1, 0), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)], material)

    def tube(self, path, radius, material, sides=6):
        """Along points; radius: a number, or a function of the place in [0, 1]. Open at its ends."""
        points, faces = [], []
        turn = self.turns.uniform(0, 2 * math.pi) if self.turns else 0.0
        for i, p in enumerate(path):
            along = normalized(sub(path[min(i + 1, len(path) - 1)], path[max(i - 1, 0)]))
            u, v = frame(along)
            r = radius(i / (len(path) - 1)) if callable(radius) else radius
            for k in range(sides):
                angle = turn + 2 * math.pi * k / sides
                c, s = math.cos(angle) * r, math.sin(angle) * r
                points.append(tuple(p[j] + c * u[j] + s * v[j] for j in range(3)))
        for i in range(len(path) - 1):
            for k in range(sides):
                a, b = i * sides + k, i * sides + (k + 1) % sides
                faces.append((a, b, b + sides, a + sides))
        self.add(points, faces, material)

    def leaf(self, at, along, normal, length, width, material):
        """A folded leaf: two quads along a rib."""
        side = cross(normal, along)
        place = lambda x, y, z: tuple(at[j] + x * along[j] + y * side[j] + z * normal[j] for j in range(3))
        fold = 0.15 * width
        a, b = place(0, 0, 0), place(length, 0, 0)
        for s in (-1, 1):
            c, d = place(0.65 * length, s * width / 2, fold), place(0.25 * length, s * width / 2, fold)
            self.quad(*((a, b, c, d) if s > 0 else (a, d, c, b)), material)

    def write(self, path, materials):
        names = sorted({material for material, _ in self.faces})
        views, accessors, primitives, data = [], [], [], b""

        def put(numbers, code, **accessor):
            nonlocal data
            packed = struct.pack("<%d%s" % (len(numbers), code), *numbers)
            views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(packed)})
            accessors.append({"bufferView": len(views) - 1, **accessor})
            data += packed
            return len(accessors) - 1

        bounds = {"min": [min(p[k] for p in self.points) for k in range(3)],
                  "max": [max(p[k] for p in self.points) for k in range(3)]}
        positions = put([x for p in self.points for x in p], "f", componentType=5126, count=len(self.points), type="VEC3",
                        **bounds)
        for i, name in enumerate(names):
            triangles = [corner for material, f in self.faces if material == name
                         for k in range(1, len(f) - 1) for corner in (f[0], f[k], f[k + 1])]
            indices = put(triangles, "I", componentType=5125, count=len(triangles), type="SCALAR")
            primitives.append({"attributes": {"POSITION": positions}, "indices": indices, "material": i})
        document = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
                    "meshes": [{"primitives": primitives}], "materials": [materials[name] for name in names],
                    "extensionsUsed": ["KHR_materials_diffuse_transmission"], "bufferViews": views,
                    "accessors": accessors, "buffers": [{"byteLength": len(data)}]}
        text = json.dumps(document).encode()
        text += b" " * (-len(text) % 4)
        path.write_bytes(b"glTF" + struct.pack("<III", 2, 28 + len(text) + len(data), len(text)) + b"JSON" + text +
                         struct.pack("<I", len(data)) + b"BIN\0" + data)


def sub(a, b):
    return tuple(x - y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def normalized(a):
    length = math.sqrt(sum(x * x for x in a)) or 1.0
    return tuple(x / length for x in a)


def frame(n):
    u = normalized(cross(n, (0, 1, 0) if abs(n[1]) < 0.9 else (1, 0, 0)))
    return u, cross(n, u)


def direction(rng):
    z, phi = 2 * rng.random() - 1, 2 * math.pi * rng.random()
    r = math.sqrt(1 - z * z)
    return (r * math.cos(phi), r * math.sin(phi), z)


def material(*color, metal=0.0, through=None):
    """through: colour of the half of the light that goes through."""
    result = {"doubleSided": True, "pbrMetallicRoughness": {"baseColorFactor": [*color, 1], "metallicFactor": metal,
                                                            "roughnessFactor": 0.5}}
    if through:
        result["extensions"] = {"KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": 0.5,
                                                                       "diffuseTransmissionColorFactor": through}}
    return result


MATERIALS = {
    "wood": material(0.42, 0.28, 0.16), "clay": material(0.55, 0.25, 0.16), "steel": material(0.5, 0.5, 0.5, metal=1.0),
    "hemp": material(0.55, 0.47, 0.33), "needle": material(0.06, 0.14, 0.05), "feather": material(0.75, 0.72, 0.68),
    "ivy": material(0.09, 0.2, 0.05), "wall": material(0.5, 0.45, 0.4), "hair": material(0.35, 0.22, 0.12),
    "bark": material(0.2, 0.14, 0.09), "leaf": material(0.2, 0.4, 0.08, through=[0.24, 0.5, 0.1]),
}


def planks(gap):
    """A wall of 60 planks; gap: share of a plank's width."""
    mesh = Mesh()
    for i in range(60):
        mesh.box((i, 0, 0), (i + 1 - gap, 40, 0.5), "wood")
    return mesh


def tiles():
    """A roof of overlapping tiles at 35 degrees."""
    mesh = Mesh()
    rise, run = math.sin(math.radians(35)), math.cos(math.radians(35))
    for row in range(40):
        for column in range(50):
            x, s = column + 0.5 * (row % 2), 0.6 * row
            at = lambda dx, along, up: (x + dx, (s + along) * rise + up * run, (s + along) * run - up * rise)
            low = [at(0.03, 0, 0.15), at(0.97, 0, 0.15), at(0.97, 1, 0.05), at(0.03, 1, 0.05)]
            high = [at(0.03, 0, 0.25), at(0.97, 0, 0.25), at(0.97, 1, 0.15), at(0.03, 1, 0.15)]
            mesh.slab(low, high, "clay")
    return mesh


def fence():
    """Chain link: zigzag wires that cross."""
    mesh = Mesh()
    for i in range(40):
        for sign in (1, -1):
            path = [(i + 0.5 + sign * 0.5 * (1 - 2 * (k % 2)), 0.5 * k, 0.04 * sign * (1 - 2 * (k % 2))) for k in range(49)]
            mesh.tube(path, 0.04, "steel", 5)
    return mesh


def ropes():
    """Shrouds: ropes at an angle, with ratlines across."""
    mesh = Mesh()
    for side in (-1, 1):
        for i in range(8):
            foot, head = (side * 8, 0, i * 1.5 - 6), (side * 0.5, 30, i * 0.15)
            mesh.tube([tuple(f + (h - f) * t / 20 for f, h in zip(foot, head)) for t in range(21)], 0.08, "hemp")
        for k in range(1, 28):
            t = k / 30
            ends = [tuple(f + (h - f) * t for f, h in zip((side * 8, 0, z * 1.5 - 6), (side * 0.5, 30, z * 0.15))) for z in (0, 7)]
            mesh.tube([tuple(a + (b - a) * j / 6 for a, b in zip(*ends)) for j in range(7)], 0.04, "hemp", 5)
    mesh.tube([(0, y, 0.5) for y in range(33)], lambda t: 0.6 - 0.3 * t, "wood", 16)
    return mesh


def conifer():
    """Twigs with needles all around."""
    mesh, rng = Mesh(), random.Random(5)
    mesh.tube([(0, 0.25 * y, 0) for y in range(41)], lambda t: 0.18 * (1 - 0.9 * t), "bark", 8)
    for _ in range(140):
        height = rng.uniform(1.2, 9.8)
        turn, length = rng.uniform(0, 2 * math.pi), 0.32 * (10.6 - height)
        out = (math.cos(turn), -0.25, math.sin(turn))
        path = [tuple((0, height, 0)[j] + out[j] * length * k / 6 for j in range(3)) for k in range(7)]
        mesh.tube(path, lambda t: 0.02 * (1.2 - t), "bark", 4)
        for k in range(int(60 * length)):
            t = rng.random()
            base = tuple((0, height, 0)[j] + out[j] * length * t for j in range(3))
            tip = normalized(tuple(a + 0.9 * b for a, b in zip(normalized(out), direction(rng))))
            end = tuple(b + 0.16 * d for b, d in zip(base, tip))
            mesh.tube([base, end], lambda t: 0.006 * (1 - 0.6 * t), "needle", 3)
    return mesh


def feathers():
    """Overlapping blades in rows, each of barbs."""
    mesh, rng = Mesh(), random.Random(6)
    for row in range(14):
        for column in range(18):
            x, y = column * 0.8 + 0.4 * (row % 2), row * 0.9
            lift = 0.25 + 0.1 * rng.random()
            for k in range(24):
                t = (k + 0.5) / 24
                width = 0.55 * math.sin(math.pi * (0.15 + 0.8 * t))
                for side in (-1, 1):
                    a = (x, y - 2.2 * t, lift * t)
                    b = (x + side * width, y - 2.2 * t - 0.35, lift * t + 0.02)
                    mesh.quad(a, (a[0], a[1] - 0.07, a[2]), (b[0], b[1] - 0.05, b[2]), b, "feather")
    return mesh


def ivy():
    """Leaves close to a wall."""
    mesh, rng = Mesh(), random.Random(7)
    mesh.box((0, 0, -1), (20, 14, 0), "wall")
    for _ in range(6000):
        x, y = 20 * rng.random(), 14 * rng.random()
        if y > 7 + 4 * math.sin(0.7 * x) + 2 * math.sin(1.9 * x):
            continue
        tilt = normalized((0.5 * (rng.random() - 0.5), 0.6 * rng.random(), 1))
        along = normalized(cross(tilt, normalized((1, 0.5 * (rng.random() - 0.5), 0))))
        mesh.leaf((x, y, 0.1 + 0.25 * rng.random()), tuple(-a for a in along), tilt, 0.4, 0.35, "ivy")
    return mesh


def hair():
    """A ball with hairs that curl."""
    mesh, rng = Mesh(), random.Random(8)
    for _ in range(5000):
        d, curl = direction(rng), direction(rng)
        path = [tuple(d[j] * (1 + 0.16 * k) + 0.025 * k * k * curl[j] for j in range(3)) for k in range(6)]
        mesh.tube(path, 0.006, "hair", 3)
    return mesh


def leaves():
    """A shrub of thin leaves that the sun shines through."""
    mesh, rng = Mesh(), random.Random(9)
    for _ in range(260):
        d = direction(rng)
        path = [tuple(d[j] * 0.4 * k + (0.05 * k * k if j == 1 else 0) for j in range(3)) for k in range(8)]
        mesh.tube(path, lambda t: 0.03 * (1.1 - t), "bark", 5)
        for p in path[2:]:
            for _ in range(6):
                along, up = direction(rng), normalized(tuple(a + b for a, b in zip((0, 0.8, 0), direction(rng))))
                side = normalized(cross(up, along))
                mesh.leaf(p, along, cross(along, side), 0.35, 0.2, "leaf")
    return mesh


ASSETS = {"planks_00": lambda: planks(0), "planks_02": lambda: planks(0.02), "planks_10": lambda: planks(0.1),
          "planks_50": lambda: planks(0.5), "tiles": tiles, "fence": fence, "ropes": ropes, "conifer": conifer,
          "feathers": feathers, "ivy": ivy, "hair": hair, "leaves": leaves}


def write_assets(assets, materials, usage, turned):
    """What the command line asks for: FOLDER [NAME...]. turned: every tube about its axis by a random angle."""
    arguments = [argument for argument in sys.argv[1:] if argument != "--turned"]
    if not arguments or arguments[0].startswith("-"):
        sys.exit(usage)
    folder, names = Path(arguments[0]), arguments[1:] or list(assets)
    unknown = [name for name in names if name not in assets]
    if unknown:
        sys.exit("%s: no asset %s; there are %s" % (Path(sys.argv[0]).stem, ", ".join(unknown), ", ".join(assets)))
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        Mesh.turns = random.Random(1) if turned else None
        mesh = assets[name]()
        mesh.write(folder / (name + ".glb"), materials)
        print("%s: %d faces" % (folder / (name + ".glb"), len(mesh.faces)))


if __name__ == "__main__":
    write_assets(ASSETS, MATERIALS, __doc__, "--turned" in sys.argv)
