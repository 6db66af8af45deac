#!/usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Writes a forest that does not fit into memory at full detail: ten species of plants of three
individuals each and two ships, all of 1 to 3 million triangles, a ground, a lake, a million instances, and a camera that
pulls back from a leaf to the horizon (2000:1).

    scripts/make_heavy_forest.py OUT_DIR [--scale 1] [--instances 1000000] [--variants 3] [--only NAME,...]

OUT_DIR/forest.gltf   the scene; instances by EXT_mesh_gpu_instancing
OUT_DIR/NAME.gltf     each species alone; both refer to the same OUT_DIR/NAME.bin
--scale 0.01          about a hundredth of the triangles: for tests
--variants 1          so many individuals of each plant
--only oak,spruce     writes only these, and a scene of them
The same files every time for the same numpy. At scale 1 it writes 2 GB in a minute.
"""
import argparse
import json
import math
from pathlib import Path

import numpy as np

import make_demo_scene as demo

FRAMES = 121
VARIANTS = "abc"
LAKE = dict(x=-150.0, z=-190.0, radius=70.0, depth=4.0, level=-0.6)  # metres; ships lie on it


# ---------------------------------------------------------------------------------------------- vectors, many at once
def unit(a):
    return a / np.maximum(np.linalg.norm(a, axis=-1, keepdims=True), 1e-30)


def basis(axis):
    """Two unit vectors orthogonal to each axis and to each other."""
    helper = np.where(np.abs(axis[..., :1]) < 0.9, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    x = unit(np.cross(helper, axis))
    return x, np.cross(axis, x)


def tilted(axis, angle, azimuth):
    x, y = basis(axis)
    side = x * np.cos(azimuth)[..., None] + y * np.sin(azimuth)[..., None]
    return axis * np.cos(angle)[..., None] + side * np.sin(angle)[..., None]


def along(lines, line, t):
    """Points and directions at t in [0, 1] of some of the polylines."""
    at = np.clip(t, 0, 0.9999) * (lines.shape[1] - 1)
    i = at.astype(int)
    edge = lines[line, i + 1] - lines[line, i]
    return lines[line, i] + edge * (at - i)[:, None], unit(edge)


# ---------------------------------------------------------------------------------------------- meshes
class Mesh:
    """Triangles by material."""

    def __init__(self):
        self.parts = {}

    def add(self, material, points, faces):
        """points: (copies, vertices, 3); faces: (triangles, 3), the same for each copy."""
        copies, vertices = points.shape[:2]
        indices = np.asarray(faces, np.uint32)[None] + vertices * np.arange(copies, dtype=np.uint32)[:, None, None]
        self.parts.setdefault(material, []).append((points.reshape(-1, 3).astype(np.float32), indices.reshape(-1, 3)))

    def tubes(self, material, lines, radii, sides):
        """Open tubes around polylines (lines, points, 3)."""
        axis = unit(np.concatenate([lines[:, 1:2] - lines[:, :1], lines[:, 2:] - lines[:, :-2], lines[:, -1:] - lines[:, -2:-1]], 1))
        x, y = basis(axis)
        turn = 2 * math.pi * np.arange(sides) / sides
        ring = x[:, :, None] * np.cos(turn)[:, None] + y[:, :, None] * np.sin(turn)[:, None]
        points = lines[:, :, None] + ring * radii[:, :, None, None]
        self.add(material, points.reshape(len(lines), -1, 3), grid_faces(lines.shape[1], sides, is_closed=True))

    def leaves(self, material, base, rib, normal, size, widths, fold=0.2):
        """A leaf per base: cross-sections of these widths (parts of its length) on both sides of a folded rib."""
        side = unit(np.cross(rib, normal))
        up = np.cross(side, rib)
        sections = len(widths)
        points = [base]
        for k, width in enumerate(widths):
            t = (k + 1) / (sections + 1)
            middle = base + (t * size)[:, None] * rib - (0.25 * t * t * size)[:, None] * up
            for s in (-1, 0, 1):
                points.append(middle + (s * width * size)[:, None] * side + (abs(s) * fold * width * size)[:, None] * up)
        points.append(base + size[:, None] * rib - (0.25 * size)[:, None] * up)
        faces = [(0, 1, 2), (0, 2, 3)]
        for k in range(sections - 1):
            a = 1 + 3 * k
            for s in (0, 1):
                faces += [(a + s, a + s + 3, a + s + 4), (a + s, a + s + 4, a + s + 1)]
        tip, a = 3 * sections + 1, 3 * sections - 2
        faces += [(a, tip, a + 1), (a + 1, tip, a + 2)]
        self.add(material, np.stack(points, 1), faces)

    def needles(self, material, base, tip, radius):
        """Pyramids of three sides."""
        x, y = basis(unit(tip - base))
        turn = 2 * math.pi * np.arange(3) / 3
        ring = [base + radius * (x * math.cos(a) + y * math.sin(a)) for a in turn]
        self.add(material, np.stack(ring + [tip], 1), [(0, 1, 3), (1, 2, 3), (2, 0, 3)])

    def sheet(self, material, points):
        """(rows, columns, 3)"""
        self.add(material, points.reshape(1, -1, 3), grid_faces(points.shape[0], points.shape[1], is_closed=False))

    def boxes(self, material, corners):
        """(boxes, 8, 3): corner i is the upper one along axis k where bit k of i is set."""
        quads = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
        self.add(material, corners, [f for a, b, c, d in quads for f in ((a, b, c), (a, c, d))])

    def merged(self):
        for material, chunks in self.parts.items():
            first = np.cumsum([0] + [len(p) for p, _ in chunks[:-1]])
            yield (material, np.concatenate([p for p, _ in chunks]),
                   np.concatenate([i + np.uint32(f) for (_, i), f in zip(chunks, first)]))

    def triangles(self):
        return sum(len(i) for chunks in self.parts.values() for _, i in chunks)


def grid_faces(rows, columns, is_closed):
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns if is_closed else columns - 1), indexing="ij")
    a, b = i * columns + j, i * columns + (j + 1) % columns
    return np.stack([a, b, b + columns, a, b + columns, a + columns], -1).reshape(-1, 3)


# ---------------------------------------------------------------------------------------------- plants
def grow(rng, start, direction, length, radius, order):
    """Polylines from `start`, bent as the order says (the words of make_demo_scene's trees), and their radii."""
    lines, n = [start], order["segments"]
    for _ in range(n):
        bend = tilted(direction, rng.normal(0, order["wobble"], len(start)), rng.uniform(0, math.pi, len(start)))
        direction = unit(bend + (0.0, order["lift"], 0.0))
        lines.append(lines[-1] + direction * (length / n)[:, None])
    return np.stack(lines, 1), radius[:, None] * (1 - 0.75 * np.arange(n + 1) / n)


def branches(rng, lines, radii, child, scale):
    """The next order: `count` per line, around it by the golden angle."""
    count = max(2, round(child["count"] * scale))
    line = np.repeat(np.arange(len(lines)), count)
    nth = np.tile(np.arange(count), len(lines))
    t = child["from"] + (1 - child["from"]) * (nth + rng.uniform(0, 0.6, len(line))) / count
    start, axis = along(lines, line, t)
    azimuth = 2.39996 * nth + np.repeat(rng.uniform(0, 2 * math.pi, len(lines)), count) + rng.normal(0, 0.3, len(line))
    direction = tilted(axis, child["angle"] * rng.uniform(0.8, 1.2, len(line)), azimuth)
    size = child["shape"](t) * rng.uniform(0.8, 1.2, len(line))
    here = radii[line, np.minimum((t * (radii.shape[1] - 1)).astype(int), radii.shape[1] - 2)]
    return grow(rng, start, direction, child["length"] * size, np.minimum(child["radius"] * size, 0.8 * here), child)


def skeleton(mesh, rng, orders, scale, bark):
    """Bark of all orders; returns the twigs and their radii. All orders but the trunk thin out with the scale."""
    trunk = orders[0]
    one = np.ones(trunk.get("stems", 1))
    angle = 2 * math.pi * np.arange(len(one)) / len(one)
    up = unit(np.stack([trunk.get("spread", 0.0) * np.cos(angle), one, trunk.get("spread", 0.0) * np.sin(angle)], 1))
    lines, radii = grow(rng, np.array([0.0, -0.1, 0.0]) + 0.0 * up, up, trunk["length"] * one, trunk["radius"] * one, trunk)
    mesh.tubes(bark, lines, radii, trunk["sides"])
    for order in orders[1:]:
        lines, radii = branches(rng, lines, radii, order, scale ** (1 / (len(orders) - 1)))
        mesh.tubes(bark, lines, radii, order["sides"])
    return lines, radii


def on_twigs(rng, twigs, per_twig, first=0.1):
    line = np.repeat(np.arange(len(twigs)), per_twig)
    return along(twigs, line, first + (1 - first) * rng.uniform(0, 1, len(line)))


def leafy(mesh, rng, twigs, per_twig, size, widths, materials, hang=0.15):
    base, axis = on_twigs(rng, twigs, per_twig)
    n = len(base)
    rib = unit(tilted(axis, rng.uniform(0.5, 1.3, n), rng.uniform(0, 2 * math.pi, n)) + (0.0, -hang, 0.0))
    normal = unit(np.stack([rng.normal(0, 0.5, n), np.ones(n), rng.normal(0, 0.5, n)], 1))
    size, kind = size * rng.uniform(0.7, 1.25, n), rng.integers(0, len(materials), n)
    for k, material in enumerate(materials):
        of = kind == k
        mesh.leaves(material, base[of], rib[of], normal[of], size[of], widths)


def needled(mesh, rng, twigs, per_twig, length, radius, material, spread=0.9):
    base, axis = on_twigs(rng, twigs, per_twig, 0.02)
    way = tilted(axis, spread * rng.uniform(0.7, 1.1, len(base)), rng.uniform(0, 2 * math.pi, len(base)))
    mesh.needles(material, base, base + way * (length * rng.uniform(0.8, 1.2, len(base)))[:, None], radius)


def order(length, radius, segments, sides, wobble, lift, count=1, start=0.2, angle=0.8, shape=lambda t: 1.0 + 0.0 * t, **more):
    return {"length": length, "radius": radius, "segments": segments, "sides": sides, "wobble": wobble, "lift": lift,
            "count": count, "from": start, "angle": angle, "shape": shape, **more}


def round_crown(t):
    return 0.45 + 0.75 * np.sin(math.pi * np.clip((t - 0.25) / 0.75, 0, 1) ** 0.8)


def cone(t):
    return 1.12 - t


def tapering(t):
    return 1.1 - 0.5 * t


def tree(orders, bark, clothe, *how, **more):
    """clothe: what puts leaves or needles on twigs."""
    def make(rng, scale):
        mesh = Mesh()
        twigs, _ = skeleton(mesh, rng, orders, scale, bark)
        clothe(mesh, rng, twigs, *how, **more)
        return mesh
    return make


def broadleaf(orders, bark, per_twig, size, widths, materials, **more):
    return tree(orders, bark, leafy, per_twig, size, widths, materials, **more)


def needle_tree(orders, bark, per_twig, length, radius, material, **more):
    return tree(orders, bark, needled, per_twig, length, radius, material, **more)


OAK = [order(9, 0.42, 9, 16, 0.08, 0.05), order(6, 0.17, 8, 10, 0.14, 0.05, 22, 0.25, 1.0, round_crown),
       order(2.4, 0.06, 5, 6, 0.2, 0.03, 15, 0.2, 0.9, tapering), order(0.9, 0.016, 4, 4, 0.25, 0.0, 11, 0.15),
       order(0.3, 0.005, 2, 3, 0.25, 0.0, 5, 0.15)]
MAPLE = [order(10, 0.3, 9, 14, 0.05, 0.06), order(4.5, 0.12, 7, 9, 0.1, 0.12, 26, 0.22, 0.8, round_crown),
         order(1.8, 0.04, 5, 6, 0.15, 0.06, 14, 0.2, 0.8, tapering), order(0.7, 0.012, 3, 4, 0.2, 0.02, 12, 0.15),
         order(0.25, 0.004, 2, 3, 0.2, 0.0, 4, 0.2)]
BIRCH = [order(13, 0.18, 12, 12, 0.04, 0.05), order(3.6, 0.05, 8, 8, 0.1, 0.0, 42, 0.2, 0.75, tapering),
         order(1.6, 0.014, 6, 5, 0.15, -0.1, 13, 0.2, 0.7, tapering), order(0.8, 0.005, 5, 3, 0.12, -0.25, 13, 0.1)]
WILLOW = [order(6, 0.38, 8, 14, 0.08, 0.04), order(5, 0.14, 8, 10, 0.12, 0.12, 20, 0.4, 0.8, round_crown),
          order(2.2, 0.04, 6, 6, 0.15, 0.0, 12, 0.2, 0.8), order(3.2, 0.006, 14, 3, 0.05, -0.35, 13, 0.2, 0.7)]
POPLAR = [order(18, 0.3, 14, 12, 0.03, 0.05), order(3.2, 0.07, 7, 8, 0.08, 0.25, 60, 0.1, 0.6, tapering),
          order(1.2, 0.02, 4, 5, 0.15, 0.12, 14, 0.15, 0.7, tapering), order(0.4, 0.006, 3, 3, 0.2, 0.05, 11, 0.1)]
SPRUCE = [order(18, 0.24, 16, 12, 0.01, 0.02), order(3.8, 0.045, 10, 7, 0.04, -0.02, 110, 0.06, 1.55, cone),
          order(0.9, 0.01, 4, 4, 0.1, -0.03, 26, 0.1, 0.9, tapering), order(0.25, 0.004, 2, 3, 0.1, 0.0, 7, 0.1, 0.8)]
PINE = [order(15, 0.26, 12, 12, 0.05, 0.04), order(3.4, 0.08, 8, 8, 0.15, 0.06, 34, 0.45, 1.2, round_crown),
        order(1.1, 0.024, 5, 5, 0.2, 0.08, 16, 0.3, 0.9), order(0.35, 0.01, 3, 4, 0.2, 0.15, 12, 0.3, 0.8)]
HAZEL = [order(2.2, 0.03, 8, 8, 0.1, 0.05, stems=24, spread=0.45), order(1.3, 0.014, 6, 6, 0.15, 0.05, 10, 0.25, 0.7),
         order(0.6, 0.006, 4, 4, 0.2, 0.02, 9, 0.2, 0.8), order(0.22, 0.003, 2, 3, 0.2, 0.0, 8, 0.2, 0.8)]
LOBED, BROAD, SLENDER = (0.2, 0.3, 0.22), (0.3, 0.42, 0.2), (0.09, 0.12, 0.08)


def grass(rng, scale):
    """A square metre of blades, a ribbon folded along its middle each."""
    mesh, n = Mesh(), max(20, int(100000 * scale))
    x, z = rng.uniform(-0.5, 0.5, n), rng.uniform(-0.5, 0.5, n)
    lean = unit(np.stack([rng.normal(0, 0.35, n), np.ones(n), rng.normal(0, 0.35, n)], 1))
    away = unit(np.stack([rng.normal(0, 1, n), np.zeros(n), rng.normal(0, 1, n)], 1))
    size, kind = rng.uniform(0.12, 0.4, n), rng.integers(0, 2, n)
    for k, material in enumerate(("grass green", "grass straw")):
        of = kind == k
        mesh.leaves(material, np.stack([x, 0 * x, z], 1)[of], lean[of], away[of], size[of], (0.012, 0.014, 0.012, 0.008, 0.005))
    return mesh


def fern(rng, scale):
    """Fronds of pinnae of pinnules."""
    mesh, fronds = Mesh(), 26
    angle = 2.39996 * np.arange(fronds)
    out = unit(np.stack([np.cos(angle), 1.6 + 0 * angle, np.sin(angle)], 1))
    stem = order(1.1, 0.005, 14, 5, 0.03, -0.09)
    lines, radii = grow(rng, 0.03 * out, out, rng.uniform(0.8, 1.2, fronds), 0.005 + 0 * angle, stem)
    mesh.tubes("fern stem", lines, radii, 5)
    pinnae = max(6, round(64 * math.sqrt(scale)))
    line, nth = np.repeat(np.arange(fronds), pinnae), np.tile(np.arange(pinnae), fronds)
    t = 0.15 + 0.84 * nth / pinnae
    start, axis = along(lines, line, t)
    side = unit(np.cross(axis, (0.0, 1.0, 0.0))) * np.where(nth % 2, 1, -1)[:, None]
    length = 0.32 * np.sin(math.pi * np.clip(1.05 - t, 0, 1) ** 0.7) + 0.01
    lines, radii = grow(rng, start, unit(side + 0.35 * axis), length, 0.0015 + 0 * length, order(1, 1, 6, 3, 0.04, -0.05))
    mesh.tubes("fern stem", lines, radii, 3)
    pinnules = max(6, round(96 * math.sqrt(scale)))
    line, nth = np.repeat(np.arange(len(lines)), pinnules), np.tile(np.arange(pinnules), len(lines))
    t = (nth + 0.5) / pinnules
    base, axis = along(lines, line, t)
    side = unit(np.cross(axis, (0.0, 1.0, 0.0))) * np.where(nth % 2, 1, -1)[:, None]
    size = np.repeat(length, pinnules) * 0.22 * (1.08 - t)
    up = unit(np.stack([rng.normal(0, 0.2, len(t)), np.ones(len(t)), rng.normal(0, 0.2, len(t))], 1))
    mesh.leaves("fern green", base, unit(side + 0.3 * axis), up, size, (0.2, 0.22, 0.14))
    return mesh


# ---------------------------------------------------------------------------------------------- ships
def rope(mesh, a, b, radius, scale, slack=0.0):
    """Three strands twisted around each other."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    length = np.linalg.norm(b - a)
    n = max(8, int(18 * length / (12 * radius) * scale))
    t = np.arange(n + 1) / n
    line = a + (b - a) * t[:, None] - np.array([0, 4 * slack, 0]) * (t * (1 - t))[:, None]
    x, y = basis(unit(b - a))
    turns = 2 * math.pi * length / (12 * radius) * min(1.0, scale)
    strands = [line + 0.55 * radius * (np.cos(turns * t + p)[:, None] * x + np.sin(turns * t + p)[:, None] * y)
               for p in (0, 2 * math.pi / 3, 4 * math.pi / 3)]
    mesh.tubes("hemp", np.stack(strands), np.full((3, n + 1), 0.55 * radius), 6)


def ship(masts):
    """A hull of planks, decks, masts, yards, sails, shrouds with ratlines and stays."""
    def make(rng, scale):
        mesh, length, beam = Mesh(), 12.0 * masts, 3.2 + 0.6 * masts
        hull(mesh, length, beam)
        for m in range(masts):
            x, top = length * ((m + 0.6) / (masts + 0.2) - 0.5), 19.0 - 2.0 * abs(m - 0.5 * (masts - 1))
            rig_mast(mesh, x, top, beam, scale)
            rope(mesh, (x, 0.75 * top, 0), (min(x + length / masts, 0.62 * length), 2.6, 0), 0.05, scale, 0.2)
            rope(mesh, (x, 0.95 * top, 0), (min(x + length / masts, 0.62 * length), 6.0, 0), 0.04, scale, 0.2)
        bowsprit = np.array([[[0.47 * length, 2.4, 0], [0.62 * length, 3.6, 0]]])
        mesh.tubes("spar", bowsprit, np.array([[0.16, 0.08]]), 10)
        return mesh
    return make


def hull(mesh, length, beam):
    """Planks along the hull, a little apart, and deck boards."""
    def skin(u, v, out):
        """u along, in [-1, 1]; v up the side, in [0, 1]."""
        half = 0.5 * beam * np.sqrt(np.clip(1 - np.abs(u) ** 2.6, 0, 1)) * (0.35 + 0.65 * np.sqrt(v)) + out
        return np.stack([0.5 * length * u, -1.4 + 3.4 * v + 0.7 * u * u, half], -1)
    rows, pieces = 26, 90
    u = np.linspace(-0.995, 0.995, pieces + 1)
    for side in (1, -1):
        for row in range(rows):
            v = np.array([row + 0.02, row + 0.98]) / rows
            edges = [skin(u, np.full(pieces + 1, v[j]), out) * (1, 1, side) for j, out in ((0, 0.0), (0, 0.06), (1, 0.06), (1, 0.0))]
            mesh.add("plank", np.stack(edges, 1).reshape(1, -1, 3), grid_faces(pieces + 1, 4, is_closed=True))
    boards = np.arange(-0.5 * beam, 0.5 * beam, 0.16)
    reach = 0.48 * length * np.sqrt(np.clip(1 - np.abs(2 * boards / beam) ** 2, 0.01, 1))
    corners = [np.stack([sx * reach, np.full_like(boards, y), boards + dz], 1) for dz in (0.005, 0.155) for y in (1.2, 1.25)
               for sx in (-1, 1)]
    mesh.boxes("plank", np.stack(corners, 1))


def rig_mast(mesh, x, top, beam, scale):
    line = np.stack([np.full(20, x), np.linspace(-0.5, top, 20), np.zeros(20)], 1)[None]
    mesh.tubes("spar", line, np.linspace(0.28, 0.08, 20)[None], 14)
    for height, half in ((0.32 * top, 4.6), (0.56 * top, 3.8), (0.78 * top, 2.8)):
        yard = np.stack([np.full(9, x + 0.3), np.full(9, height), np.linspace(-half, half, 9)], 1)[None]
        mesh.tubes("spar", yard, 0.1 - 0.05 * np.abs(np.linspace(-1, 1, 9))[None], 10)
        n = max(4, int(60 * math.sqrt(scale)))
        s, h = np.meshgrid(np.linspace(-1, 1, n), np.linspace(0, 1, n))
        belly = 1.1 * (1 - s * s) * np.sin(math.pi * h)
        mesh.sheet("sail", np.stack([x + 0.4 + belly, height - 0.1 - 0.19 * top * h, half * (0.92 + 0.06 * h) * s], -1))
        for z in (-half, half):
            rope(mesh, (x + 0.3, height, z), (x, height + 0.16 * top, 0), 0.018, scale)
    for side in (-1, 1):
        feet = [(x - 0.9 + 0.3 * i, 1.6, side * 0.5 * beam) for i in range(7)]
        head = (x, 0.6 * top, side * 0.1)
        for foot in feet:
            rope(mesh, foot, head, 0.035, scale)
        for step in range(1, 26):  # ratlines
            t = step / 30
            a, b = ([p + t * (q - p) for p, q in zip(foot, head)] for foot in (feet[0], feet[-1]))
            rope(mesh, a, b, 0.014, scale, 0.01)


# ---------------------------------------------------------------------------------------------- what there is
SPECIES = {
    "oak": broadleaf(OAK, "oak bark", 12, 0.11, LOBED, ("oak green", "oak light")),
    "maple": broadleaf(MAPLE, "maple bark", 12, 0.12, BROAD, ("maple green", "maple gold", "maple red")),
    "birch": broadleaf(BIRCH, "birch bark", 31, 0.055, BROAD, ("birch green", "birch light"), hang=0.6),
    "willow": broadleaf(WILLOW, "willow bark", 68, 0.1, SLENDER, ("willow green",), hang=0.7),
    "poplar": broadleaf(POPLAR, "poplar bark", 24, 0.075, BROAD, ("poplar green", "poplar light")),
    "spruce": needle_tree(SPRUCE, "spruce bark", 41, 0.018, 0.0006, "spruce needle"),
    "pine": needle_tree(PINE, "pine bark", 135, 0.07, 0.0008, "pine needle", spread=0.6),
    "hazel": broadleaf(HAZEL, "hazel bark", 12, 0.075, BROAD, ("hazel green", "hazel light")),
    "fern": fern,
    "grass": grass,
    "brig": ship(2),
    "bark": ship(3),
}
# Share of the instances, and how far apart they stand at least (metres).
SHARES = {"oak": 0.008, "maple": 0.009, "birch": 0.01, "willow": 0.003, "poplar": 0.004, "spruce": 0.016, "pine": 0.01,
          "hazel": 0.05, "fern": 0.26, "grass": 0.63}
TALL = ("oak", "maple", "birch", "willow", "poplar", "spruce", "pine", "hazel")  # would stand in the camera's way
SHIPS = {"brig": 3, "bark": 2}
SQUARE_METRES_PER_INSTANCE = 1.8

LEAVES = {"oak green": ((0.08, 0.16, 0.03), (0.18, 0.32, 0.05)), "oak light": ((0.12, 0.2, 0.04), (0.26, 0.38, 0.06)),
          "maple green": ((0.1, 0.2, 0.04), (0.22, 0.38, 0.05)), "maple gold": ((0.32, 0.22, 0.03), (0.5, 0.36, 0.05)),
          "maple red": ((0.28, 0.07, 0.03), (0.45, 0.1, 0.04)), "birch green": ((0.13, 0.22, 0.05), (0.28, 0.4, 0.07)),
          "birch light": ((0.2, 0.26, 0.06), (0.36, 0.44, 0.08)), "willow green": ((0.16, 0.22, 0.1), (0.28, 0.36, 0.14)),
          "poplar green": ((0.1, 0.18, 0.05), (0.24, 0.36, 0.08)), "poplar light": ((0.2, 0.24, 0.1), (0.32, 0.4, 0.12)),
          "hazel green": ((0.09, 0.18, 0.04), (0.22, 0.36, 0.06)), "hazel light": ((0.15, 0.24, 0.06), (0.3, 0.42, 0.08)),
          "fern green": ((0.1, 0.21, 0.05), (0.24, 0.42, 0.08)), "grass green": ((0.1, 0.2, 0.04), (0.22, 0.38, 0.06)),
          "grass straw": ((0.3, 0.27, 0.12), (0.36, 0.32, 0.14)), "sail": ((0.62, 0.58, 0.48), (0.4, 0.37, 0.3))}
PLAIN = {"oak bark": (0.13, 0.1, 0.07), "maple bark": (0.17, 0.14, 0.11), "birch bark": (0.6, 0.58, 0.53),
         "willow bark": (0.16, 0.13, 0.09), "poplar bark": (0.3, 0.29, 0.25), "spruce bark": (0.15, 0.09, 0.06),
         "pine bark": (0.3, 0.15, 0.08), "hazel bark": (0.2, 0.15, 0.1), "spruce needle": (0.04, 0.1, 0.04),
         "pine needle": (0.06, 0.13, 0.06), "fern stem": (0.16, 0.17, 0.06), "plank": (0.28, 0.18, 0.1),
         "spar": (0.4, 0.28, 0.15), "hemp": (0.5, 0.42, 0.28), "ground": (0.14, 0.12, 0.07), "water": (0.03, 0.05, 0.06)}


def material_of(name):
    return demo.leaf_material(name, *LEAVES[name]) if name in LEAVES else demo.plain_material(name, PLAIN[name])


def ground_height(x, z):
    """The demo's hills, sunk where the lake is. Arrays."""
    far = np.minimum(1.0, np.hypot(x, z) / 40.0)
    hills = far * (1.6 * np.sin(0.037 * x + 0.4) * np.cos(0.031 * z) + 0.9 * np.sin(0.011 * x - 0.017 * z))
    shore = np.clip((np.hypot(x - LAKE["x"], z - LAKE["z"]) - LAKE["radius"]) / 30.0, 0, 1)
    return shore * hills - (1 - shore) * LAKE["depth"]


def ground(half_size, scale):
    x, z = np.meshgrid(*[np.linspace(-half_size, half_size, 1 + int(700 * math.sqrt(min(scale, 1.0))))] * 2)
    mesh = Mesh()
    mesh.sheet("ground", np.stack([x, ground_height(x, z), z], -1))
    return mesh


def lake():
    turn = 2 * math.pi * np.arange(96) / 96
    r = LAKE["radius"] + 30.0
    shore = np.stack([LAKE["x"] + r * np.cos(turn), LAKE["level"] + 0 * turn, LAKE["z"] + r * np.sin(turn)], 1)
    mesh = Mesh()
    mesh.add("water", np.concatenate([[[LAKE["x"], LAKE["level"], LAKE["z"]]], shore])[None],
             [(0, 1 + (i + 1) % 96, 1 + i) for i in range(96)])
    return mesh


# ---------------------------------------------------------------------------------------------- where things stand
def plant(rng, count, radius, path, is_tall):
    """(count, 3) places anywhere but in the lake and in the camera's way."""
    places = np.zeros((0, 3))
    while len(places) < count:
        r, a = radius * np.sqrt(rng.uniform(0, 1, 2 * count)), rng.uniform(0, 2 * math.pi, 2 * count)
        x, z = r * np.cos(a), r * np.sin(a)
        free = np.hypot(x - LAKE["x"], z - LAKE["z"]) > LAKE["radius"] + 12
        clear, tall = (4.0, 24.0) if is_tall else (0.8, 3.0)
        for eye, _ in path:
            if eye[1] < tall:
                free &= np.hypot(x - eye[0], z - eye[2]) > clear
        if is_tall:  # the hero stands at the origin; the line of sight from the path's middle
            free &= np.hypot(x, z) > 6.0
            free &= ~((z > 0) & (np.hypot(x, z) < 90) & (np.abs(np.arctan2(x, z) - 0.35) < 0.12))
        x, z = x[free], z[free]
        places = np.concatenate([places, np.stack([x, ground_height(x, z), z], 1)])
    return places[:count]


def places_of(species, count, rng, path, radius):
    if species in SHIPS:
        turn = 2 * math.pi * (np.arange(SHIPS[species]) / SHIPS[species] + (0.13 if species == "bark" else 0.0))
        r = 0.6 * LAKE["radius"] if species == "brig" else 0.2 * LAKE["radius"]
        return np.stack([LAKE["x"] + r * np.cos(turn), LAKE["level"] + 0 * turn, LAKE["z"] + r * np.sin(turn)], 1)
    return plant(rng, count, radius, path, species in TALL)


def instances(rng, places):
    """Turned about the vertical, of different sizes."""
    n = len(places)
    turn, size = rng.uniform(0, 2 * math.pi, n), rng.uniform(0.8, 1.25, n)
    zero = np.zeros(n)
    return places, np.stack([zero, np.sin(turn / 2), zero, np.cos(turn / 2)], 1), np.repeat(size[:, None], 3, 1)


# ---------------------------------------------------------------------------------------------- glTF
class Document:
    """A .gltf whose buffers are files of their own."""

    def __init__(self, folder):
        self.folder = folder
        self.json = {"asset": {"version": "2.0", "generator": "farfield scripts/make_heavy_forest.py"}, "scene": 0,
                     "buffers": [], "bufferViews": [], "accessors": [], "materials": [], "meshes": [], "nodes": []}
        self.material_of = {}

    def buffer(self, uri):
        self.json["buffers"].append({"uri": uri, "byteLength": 0})
        return len(self.json["buffers"]) - 1

    def accessor(self, buffer, values):
        """The accessor of the next bytes of a buffer."""
        values = np.ascontiguousarray(values)
        entry, width = self.json["buffers"][buffer], 1 if values.ndim == 1 else values.shape[1]
        self.json["bufferViews"].append({"buffer": buffer, "byteOffset": entry["byteLength"], "byteLength": values.nbytes})
        entry["byteLength"] += values.nbytes
        accessor = {"bufferView": len(self.json["bufferViews"]) - 1, "componentType": 5125 if values.dtype == np.uint32 else 5126,
                    "count": len(values), "type": {1: "SCALAR", 3: "VEC3", 4: "VEC4"}[width]}
        if width == 3:
            accessor["min"], accessor["max"] = values.min(0).tolist(), values.max(0).tolist()
        self.json["accessors"].append(accessor)
        return len(self.json["accessors"]) - 1

    def add_mesh(self, name, parts):
        buffer = self.buffer(name + ".bin")
        primitives = []
        for material, points, indices in parts:
            if material not in self.material_of:
                self.material_of[material] = len(self.json["materials"])
                self.json["materials"].append(material_of(material))
            primitives.append({"attributes": {"POSITION": self.accessor(buffer, points)},
                               "indices": self.accessor(buffer, indices.reshape(-1)), "material": self.material_of[material]})
        self.json["meshes"].append({"name": name, "primitives": primitives})
        return len(self.json["meshes"]) - 1

    def write(self, name):
        children = {child for node in self.json["nodes"] for child in node.get("children", ())}
        self.json["scenes"] = [{"nodes": [n for n in range(len(self.json["nodes"])) if n not in children]}]
        (self.folder / name).write_text(json.dumps(self.json, separators=(",", ":")))


def write_mesh(folder, scene, name, mesh):
    """NAME.bin and NAME.gltf, and the mesh in the scene; returns its number and what was written."""
    parts = list(mesh.merged())
    with open(folder / (name + ".bin"), "wb") as out:
        for _, points, indices in parts:
            points.tofile(out)
            indices.tofile(out)
    alone = Document(folder)
    alone.json["nodes"].append({"mesh": alone.add_mesh(name, parts)})
    alone.json["extensionsUsed"] = ["KHR_materials_diffuse_transmission"]
    alone.write(name + ".gltf")
    return scene.add_mesh(name, parts), parts


def add_instances(scene, buffer, out, name, mesh, transforms):
    attributes = {}
    for key, values in zip(("TRANSLATION", "ROTATION", "SCALE"), transforms):
        values = values.astype(np.float32)
        attributes[key] = scene.accessor(buffer, values)
        values.tofile(out)
    scene.json["nodes"].append({"name": name, "mesh": mesh,
                                "extensions": {"EXT_mesh_gpu_instancing": {"attributes": attributes}}})


def add_camera_and_sun(scene, buffer, out, path):
    doc = scene.json
    doc["extensions"] = {"KHR_lights_punctual": {"lights": [
        {"type": "directional", "name": "sun", "color": [1.0, 0.93, 0.82], "intensity": 3000.0}]}}
    doc["nodes"].append({"name": "sun", "extensions": {"KHR_lights_punctual": {"light": 0}},
                         "rotation": demo.look_at_quaternion((0.75, 0.85, 0.75), (0.0, 0.0, 0.0))})
    doc["cameras"] = [{"type": "perspective", "perspective": {"yfov": 0.62, "aspectRatio": 16 / 9, "znear": 0.01}}]
    eye, aim = path[0]
    doc["nodes"].append({"name": "camera", "camera": 0, "translation": list(eye),
                         "rotation": list(demo.look_at_quaternion(eye, aim))})
    keys = [np.arange(len(path)) / 24.0, np.array([e for e, _ in path]), np.array([demo.look_at_quaternion(e, a) for e, a in path])]
    times, translations, rotations = [scene.accessor(buffer, k.astype(np.float32)) for k in keys]
    doc["accessors"][times]["min"], doc["accessors"][times]["max"] = [0.0], [float(np.float32(keys[0][-1]))]
    for k in keys:
        k.astype(np.float32).tofile(out)
    camera = len(doc["nodes"]) - 1
    doc["animations"] = [{"name": "pullback", "samplers": [
        {"input": times, "output": translations, "interpolation": "LINEAR"},
        {"input": times, "output": rotations, "interpolation": "LINEAR"}],
        "channels": [{"sampler": 0, "target": {"node": camera, "path": "translation"}},
                     {"sampler": 1, "target": {"node": camera, "path": "rotation"}}]}]


def hero_leaf(parts):
    """The tip of a leaf on the camera's side of the crown, at about eye height."""
    wanted = np.array((math.sin(0.35), 0.0, math.cos(0.35)))
    points = np.concatenate([p for material, p, _ in parts if material in LEAVES] or [p for _, p, _ in parts])
    low = points[(points[:, 1] > 1.6) & (points[:, 1] < 4.5)]
    points = low if len(low) else points
    return tuple(float(x) for x in points[np.argmax(points @ wanted)])


def build(folder, scale, count, variants, names):
    folder.mkdir(parents=True, exist_ok=True)
    scene = Document(folder)
    scene.json["extensionsUsed"] = ["EXT_mesh_gpu_instancing", "KHR_lights_punctual", "KHR_materials_diffuse_transmission"]
    radius = math.sqrt(count * SQUARE_METRES_PER_INSTANCE / math.pi)
    total, hero, meshes = 0, None, []
    for number, (name, make) in enumerate(SPECIES.items()):
        if name not in names:
            continue
        for variant, letter in enumerate(VARIANTS[:1 if name in SHIPS else variants]):
            mesh = make(np.random.default_rng([number, variant]), scale)
            full_name = name + "_" + letter
            index, parts = write_mesh(folder, scene, full_name, mesh)
            hero = hero or hero_leaf(parts)
            meshes.append((name, variant, index))
            total += mesh.triangles()
            print("%-10s %9d triangles" % (full_name, mesh.triangles()), flush=True)
    path = demo.camera_path(hero, FRAMES, near=0.55, far=max(1.6 * radius, 60.0))
    for name, mesh in (("ground", ground(1.5 * radius + 60.0, scale)), ("lake", lake())):
        index, _ = write_mesh(folder, scene, name, mesh)
        scene.json["nodes"].append({"name": name, "mesh": index})
        total += mesh.triangles()

    buffer, placed = scene.buffer("instances.bin"), 0
    with open(folder / "instances.bin", "wb") as out:
        for name, variant, index in meshes:
            rng = np.random.default_rng([1000, index])
            wanted = max(1, round(count * SHARES.get(name, 0) / variants))
            transforms = instances(rng, places_of(name, wanted, rng, path, radius))
            if index == 0:  # the hero, as the camera knows it
                transforms[0][0], transforms[1][0], transforms[2][0] = 0.0, (0.0, 0.0, 0.0, 1.0), 1.0
            placed += len(transforms[0])
            add_instances(scene, buffer, out, name + "_" + VARIANTS[variant], index, transforms)
        add_camera_and_sun(scene, buffer, out, path)
    scene.write("forest.gltf")
    print("%s: %d meshes, %d triangles, %d instances, radius %.0f m" % (folder / "forest.gltf", len(meshes) + 2, total, placed, radius))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out_dir", type=Path)
    parser.add_argument("--scale", type=float, default=1.0)
    parser.add_argument("--instances", type=int, default=1_000_000)
    parser.add_argument("--variants", type=int, default=len(VARIANTS), choices=range(1, len(VARIANTS) + 1))
    parser.add_argument("--only", default=",".join(SPECIES))
    arguments = parser.parse_args()
    names = arguments.only.split(",")
    unknown = [name for name in names if name not in SPECIES]
    if unknown or not 0 < arguments.scale <= 4 or arguments.instances < 1:
        parser.error("unknown species %s" % ", ".join(unknown) if unknown else "scale must be in (0, 4], instances at least 1")
    build(arguments.out_dir, arguments.scale, arguments.instances, arguments.variants, names)


if __name__ == "__main__":
    main()
