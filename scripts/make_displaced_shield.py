#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the displaced shield of docs/results/surfaces.md: a round shield as a cage of quads with creases (a sharp rim, a
boss with an edge that is sharp for ever), hammered and engraved by a displacement map of 16 bits, and a shot that
pulls back from it.

    scripts/make_displaced_shield.py FOLDER      shield.obj, shield.mtl, shield_heights.png, shield.glb

farfield bake FOLDER/shield.obj -o shield.farfield --subdivide catmull-clark
farfield shot FOLDER/shield.glb -o frames --frames 0-72      (the scene says that the shield is a cage)"""
import json
import math
import pathlib
import random
import struct
import sys
import zlib

SIDE = 6  # faces of the grid that becomes the round front
THICKNESS, DOME = 0.12, 0.35
BASE, GAIN = -0.03, 0.08  # heights of black, and of white above black
MAP_SIDE = 1024
FRONT, BACK, BOSS = (0.25, 0.25, 0.22), (0.75, 0.25, 0.22), (0.25, 0.75, 0.20)  # islands: middle u, v and radius


class Cage:
    def __init__(self):
        self.points, self.uvs, self.faces, self.creases = [], [], [], []

    def point(self, x, y, z):
        self.points.append((x, y, z))
        return len(self.points) - 1

    def face(self, material, corners, uv):
        first = len(self.uvs)
        self.uvs += uv
        self.faces.append((material, [(c, first + i) for i, c in enumerate(corners)]))

    def crease(self, ring, sharpness):
        self.creases += [(a, b, sharpness) for a, b in zip(ring, ring[1:] + ring[:1])]


def on_disk(i, j):
    u, v = 2 * i / SIDE - 1, 2 * j / SIDE - 1
    return u * math.sqrt(1 - v * v / 2), v * math.sqrt(1 - u * u / 2)


def island(place, x, y):
    u, v, radius = place
    return (u + radius * x, v + radius * y)


def boundary(low, high):
    """Grid points around a square of the grid, counter-clockwise."""
    side = range(low, high)
    return ([(i, low) for i in side] + [(high, j) for j in side] + [(i, high) for i in reversed(range(low + 1, high + 1))]
            + [(low, j) for j in reversed(range(low + 1, high + 1))])


def make_cage():
    cage = Cage()
    grid = [(i, j) for j in range(SIDE + 1) for i in range(SIDE + 1)]
    height = lambda x, y: DOME * (1 - (x * x + y * y))
    front = {g: cage.point(*on_disk(*g), height(*on_disk(*g))) for g in grid}
    back = {g: cage.point(*on_disk(*g), height(*on_disk(*g)) - THICKNESS) for g in grid}
    low, high = SIDE // 2 - 1, SIDE // 2 + 1
    middle = [g for g in grid if low <= g[0] <= high and low <= g[1] <= high]
    boss = {g: cage.point(*(0.8 * c for c in on_disk(*g)), height(*on_disk(*g)) + 0.18) for g in middle}
    for j in range(SIDE):
        for i in range(SIDE):
            square = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
            at = [on_disk(*g) for g in square]
            cage.face("bronze", [back[g] for g in reversed(square)], [island(BACK, x, y) for x, y in reversed(at)])
            if low <= i < high and low <= j < high:
                cage.face("enamel", [boss[g] for g in square], [island(BOSS, 2 * x, 2 * y) for x, y in at])
            else:
                cage.face("bronze", [front[g] for g in square], [island(FRONT, x, y) for x, y in at])

    def band(material, below, above, ring, v):
        for k, g in enumerate(ring):
            h = ring[(k + 1) % len(ring)]
            u0, u1 = k / len(ring), (k + 1) / len(ring)
            cage.face(material, [below[g], below[h], above[h], above[g]], [(u0, v), (u1, v), (u1, v + 0.03), (u0, v + 0.03)])

    rim, foot = boundary(0, SIDE), boundary(low, high)
    band("bronze", back, front, rim, 0.50)
    band("bronze", front, boss, foot, 0.96)
    cage.crease([front[g] for g in rim], 2.5)
    cage.crease([back[g] for g in rim], 2.5)
    cage.crease([front[g] for g in foot], "inf")
    cage.crease([boss[g] for g in foot], 2)
    return cage


def relief(x, y):
    """On the front, of radius 1: a rope around and a star."""
    r, angle = math.hypot(x, y), math.atan2(y, x)
    if r >= 0.98:
        return 0
    rope = math.exp(-((r - 0.8) / 0.04) ** 4) * (0.03 + 0.012 * math.cos(48 * angle + 60 * (r - 0.8)))
    star = 0.025 * min(max(2 * math.cos(8 * angle) - 8 * abs(r - 0.56), 0), 1) if 0.42 < r < 0.70 else 0
    return rope + star


def make_heights():
    """Dents of a hammer all over, and the relief; rows of texels in [0, 1]."""
    numbers = random.Random(5)
    height = [[0.0] * MAP_SIDE for _ in range(MAP_SIDE)]
    reach = MAP_SIDE // 64
    dent = [(i, j, -0.012 * (1 - (i * i + j * j) / reach ** 2) ** 2) for j in range(-reach, reach) for i in range(-reach, reach)
            if i * i + j * j < reach ** 2]
    for _ in range(4000):
        column, row = numbers.randrange(MAP_SIDE), numbers.randrange(MAP_SIDE)
        for i, j, depth in dent:
            line = height[(row + j) % MAP_SIDE]
            at = (column + i) % MAP_SIDE
            if depth < line[at]:
                line[at] = depth
    for row, line in enumerate(height):
        y = ((row + 0.5) / MAP_SIDE - FRONT[1]) / FRONT[2]
        for column in range(MAP_SIDE):
            line[column] += relief(((column + 0.5) / MAP_SIDE - FRONT[0]) / FRONT[2], y)
    return [[min(max((h - BASE) / GAIN, 0), 1) for h in line] for line in height]


def write_png(path, rows):
    raw = b"".join(b"\0" + struct.pack(f">{len(row)}H", *(round(65535 * value) for value in row)) for row in rows)
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    header = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 16, 0, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(raw, 6)) + chunk(b"IEND", b""))


def write_obj(folder, cage):
    with open(folder / "shield.mtl", "w") as mtl:
        mtl.write(f"newmtl bronze\nKd 0.72 0.45 0.20\nPr 0.35\nPm 1\ndisp -mm {BASE} {GAIN} shield_heights.png\n")
        mtl.write("newmtl enamel\nKd 0.45 0.03 0.03\nPr 0.2\nPm 0\n")
    with open(folder / "shield.obj", "w") as obj:
        obj.write("mtllib shield.mtl\n")
        for p in cage.points:
            obj.write("v %.9g %.9g %.9g\n" % p)
        for u, v in cage.uvs:
            obj.write("vt %.9g %.9g\n" % (u, 1 - v))
        used = None
        for material, corners in cage.faces:
            if material != used:
                obj.write(f"usemtl {material}\n")
                used = material
            obj.write("f " + " ".join(f"{p + 1}/{uv + 1}" for p, uv in corners) + "\n")
        for a, b, sharpness in cage.creases:
            obj.write(f"t crease 2/1/0 {a} {b} {sharpness}\n")


def write_scene(path, frames=72):
    """The camera starts a tenth of the shield away and leaves it by the same factor in every frame."""
    times = [f / 24 for f in range(frames + 1)]
    direction = (0.25, -0.55, 0.80)
    pitch = math.acos(direction[2] / math.dist(direction, (0, 0, 0)))
    yaw = math.atan2(direction[0], -direction[1])
    places = []
    for f in range(frames + 1):
        distance = 1.0 * 80 ** (f / frames)
        places += [0.15 + direction[0] * distance, -0.35 + direction[1] * distance, 0.25 + direction[2] * distance]
    half = lambda a: (math.cos(a / 2), math.sin(a / 2))
    (cy, sy), (cp, sp) = half(yaw), half(pitch)
    rotation = [cy * sp, sy * sp, sy * cp, cy * cp]  # about z, after about x
    data = struct.pack(f"<{len(times)}f", *times) + struct.pack(f"<{len(places)}f", *places)
    scene = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"name": "shield", "extras": {"farfield_mesh": {"file": "shield.obj", "subdivision": "catmull-clark"}}},
                  {"name": "camera", "camera": 0, "rotation": rotation, "translation": places[:3]}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.01}}],
        "animations": [{"channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}}],
                        "samplers": [{"input": 0, "output": 1}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": len(times), "type": "SCALAR", "min": [0], "max": [times[-1]]},
                      {"bufferView": 1, "componentType": 5126, "count": len(times), "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 4 * len(times)},
                        {"buffer": 0, "byteOffset": 4 * len(times), "byteLength": 4 * len(places)}],
        "buffers": [{"byteLength": len(data)}],
    }
    text = json.dumps(scene).encode()
    text += b" " * (-len(text) % 4)
    data += b"\0" * (-len(data) % 4)
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(data)) + struct.pack("<I4s", len(text), b"JSON")
                     + text + struct.pack("<I4s", len(data), b"BIN\0") + data)


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    write_obj(folder, make_cage())
    write_png(folder / "shield_heights.png", make_heights())
    write_scene(folder / "shield.glb")


if __name__ == "__main__":
    main()
