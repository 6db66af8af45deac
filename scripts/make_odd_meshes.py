#!/usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Writes meshes of kinds that no other script has: built, woven, heaped, stacked and grown things, for docs/results/fidelity-misses.md.

Usage: scripts/make_odd_meshes.py FOLDER [NAME...]     without names: all
"""
import math
import random

import make_fidelity_assets
from make_fidelity_assets import Mesh, cross, direction, frame, material, normalized, sub

MATERIALS = {
    **make_fidelity_assets.MATERIALS,
    "stone": material(0.45, 0.43, 0.4), "paint": material(0.6, 0.08, 0.05), "green": material(0.1, 0.3, 0.08),
    "petal": material(0.7, 0.7, 0.68, through=[0.5, 0.5, 0.45]), "yellow": material(0.7, 0.5, 0.05), "paper": material(0.8, 0.78, 0.72),
    "straw": material(0.6, 0.5, 0.25), "gold": material(0.9, 0.65, 0.25, metal=1.0),
}


def turned_box(mesh, middle, size, normal, name):
    axes = (*frame(normal), normal)
    points = []
    for i in range(8):
        offset = [(0.5 if i >> axis & 1 else -0.5) * size[axis] for axis in range(3)]
        points.append(tuple(middle[j] + sum(o * axis[j] for o, axis in zip(offset, axes)) for j in range(3)))
    mesh.cuboid(points, name)


def ball(mesh, middle, radius, name, rings=8):
    around = 2 * rings
    points = []
    for i in range(rings + 1):
        for k in range(around):
            theta, phi = math.pi * i / rings, math.pi * k / rings
            unit = (math.sin(theta) * math.cos(phi), math.cos(theta), math.sin(theta) * math.sin(phi))
            points.append(tuple(m + radius * u for m, u in zip(middle, unit)))
    faces = []
    for i in range(rings):
        for k in range(around):
            a, b = i * around + k, i * around + (k + 1) % around
            faces.append((a, b, b + around, a + around))
    mesh.add(points, faces, name)


def wicker():
    """A basket: rods woven around stakes."""
    mesh, stakes = Mesh(), 24
    for row in range(30):
        steps, radius = 8 * stakes, 4 + 0.06 * row
        path = []
        for k in range(steps + 1):
            turn = 2 * math.pi * k / steps
            r = radius + 0.12 * math.cos(stakes * turn + math.pi * row)
            path.append((r * math.cos(turn), 0.33 * row, r * math.sin(turn)))
        mesh.tube(path, 0.14, "straw")
    for k in range(stakes):
        c, s = math.cos(2 * math.pi * k / stakes), math.sin(2 * math.pi * k / stakes)
        mesh.tube([((4 + 0.06 * t) * c, 0.33 * t, (4 + 0.06 * t) * s) for t in range(31)], 0.1, "straw")
    return mesh


def scaffold():
    """Poles, bars and decks of planks, all along the axes."""
    mesh = Mesh()
    for i in range(7):
        for k in range(4):
            mesh.tube([(2 * i, 0.5 * t, 2 * k) for t in range(41)], 0.04, "steel", 8)
    for floor in range(1, 10):
        y = 2 * floor
        for k in range(4):
            mesh.tube([(0.5 * t, y, 2 * k) for t in range(25)], 0.04, "steel", 8)
        for i in range(7):
            mesh.tube([(2 * i, y, 0.5 * t) for t in range(13)], 0.04, "steel", 8)
            if i < 6:
                mesh.tube([(2 * i + 0.2 * t, y - 2 + 0.2 * t, 0) for t in range(11)], 0.03, "steel", 8)
        for plank in range(9):
            mesh.box((0, y + 0.05, 0.22 * plank), (12, y + 0.1, 0.22 * plank + 0.2), "wood")
    return mesh


def cactus():
    """A ball with thorns."""
    mesh, rng = Mesh(), random.Random(3)
    ball(mesh, (0, 3, 0), 3, "green", 24)
    for _ in range(2500):
        out = direction(rng)
        other = direction(rng)
        along = normalized(tuple(o + 0.5 * d for o, d in zip(out, other)))
        foot = (3 * out[0], 3 + 3 * out[1], 3 * out[2])
        mesh.tube([tuple(f + t * a for f, a in zip(foot, along)) for t in (0, 0.5, 1)], lambda t: 0.015 * (1.1 - t), "straw", 5)
    return mesh


def gravel():
    """A heap of stones that reach into one another."""
    mesh, rng = Mesh(), random.Random(4)
    for _ in range(4000):
        r, turn = 8 * math.sqrt(rng.random()), 2 * math.pi * rng.random()
        middle = (r * math.cos(turn), rng.random() * 3 * (1 - r / 8), r * math.sin(turn))
        size = [rng.uniform(0.2, 0.5) for _ in range(3)]
        turned_box(mesh, middle, size, direction(rng), "stone" if rng.random() < 0.8 else "wall")
    return mesh


def bricks():
    """Bricks whose mortar is one box that runs through them all."""
    mesh = Mesh()
    for row in range(40):
        for column in range(24):
            x, y = column + 0.5 * (row % 2), 0.35 * row
            mesh.box((x + 0.03, y + 0.03, 0), (x + 0.97, y + 0.32, 0.45), "clay")
    mesh.box((0.2, 0, 0.05), (24.3, 14, 0.4), "wall")
    return mesh


def palm():
    """Fronds of narrow leaflets."""
    mesh, rng = Mesh(), random.Random(6)
    trunk = [(0.3 * math.sin(t / 8), 0.5 * t, 0) for t in range(21)]
    mesh.tube(trunk, lambda t: 0.35 - 0.1 * t, "bark", 12)
    for frond in range(26):
        turn, rise = 2 * math.pi * frond / 26 + rng.uniform(-0.1, 0.1), rng.uniform(-0.2, 1.0)
        path = []
        for k in range(41):
            s = 0.125 * k
            path.append((trunk[-1][0] + s * math.cos(turn), 10 + rise * s - 0.16 * s * s, s * math.sin(turn)))
        mesh.tube(path, lambda t: 0.05 * (1.1 - t), "bark", 5)
        for k in range(2, 40):
            rib = normalized(sub(path[k + 1], path[k - 1]))
            aside = normalized(cross(rib, (0, 1, 0)))
            for sign in (-1, 1):
                along = normalized(tuple(sign * a + 0.5 * r - (0.25 if j == 1 else 0) for j, (a, r) in enumerate(zip(aside, rib))))
                normal = normalized(cross(along, rib) if sign > 0 else cross(rib, along))
                mesh.leaf(path[k], along, normal, 1.1 * (1 - 0.015 * k), 0.1, "leaf")
    return mesh


def books():
    """A pile of sheets with and without air between them."""
    mesh, rng, y = Mesh(), random.Random(7), 0.0
    for _ in range(260):
        thick, x, z = rng.uniform(0.02, 0.05), rng.uniform(-0.2, 0.2), rng.uniform(-0.2, 0.2)
        mesh.box((x, y, z), (6 + x, y + thick, 4 + z), "paper")
        y += thick + rng.uniform(0, 0.03)
    return mesh


def wheat():
    """Stalks with ears."""
    mesh, rng = Mesh(), random.Random(8)
    for _ in range(2200):
        x, z = rng.uniform(0, 10), rng.uniform(0, 10)
        lean_x, lean_z, height = rng.uniform(-0.2, 0.2), rng.uniform(-0.2, 0.2), rng.uniform(1.2, 1.7)
        stalk = [(x + lean_x * t * t / 25, height * t / 5, z + lean_z * t * t / 25) for t in range(6)]
        mesh.tube(stalk, 0.012, "straw", 4)
        ear = [tuple(p + d for p, d in zip(stalk[-1], (lean_x * t, up, lean_z * t))) for t, up in ((0, 0), (0.1, 0.08), (0.2, 0.2))]
        mesh.tube(ear, lambda t: 0.035 * (1.05 - 0.5 * abs(2 * t - 0.8)), "yellow")
    return mesh


def mail():
    """Rings that hold one another."""
    mesh = Mesh()
    for i in range(36):
        for k in range(36):
            lean = 0.35 if (i + k) % 2 else -0.35
            ring = []
            for step in range(13):
                c, s = 0.55 * math.cos(math.pi * step / 6), 0.55 * math.sin(math.pi * step / 6)
                ring.append((0.75 * i + c * math.cos(lean), 0.75 * k + s, c * math.sin(lean)))
            mesh.tube(ring, 0.08, "gold")
    return mesh


def daisies():
    """White petals that light goes through, on stalks."""
    mesh, rng = Mesh(), random.Random(10)
    for _ in range(350):
        x, z, height = rng.uniform(0, 8), rng.uniform(0, 8), rng.uniform(0.5, 1.1)
        up = normalized((rng.uniform(-0.6, 0.6), 1, rng.uniform(-0.6, 0.6)))
        mesh.tube([(x, height * t / 4, z) for t in range(5)], 0.012, "green", 5)
        ball(mesh, (x, height, z), 0.06, "yellow", 4)
        u, v = frame(up)
        for k in range(14):
            c, s = math.cos(2 * math.pi * k / 14), math.sin(2 * math.pi * k / 14)
            along = normalized(tuple(c * a + s * b + 0.1 * n for a, b, n in zip(u, v, up)))
            mesh.leaf((x, height, z), along, up, 0.28, 0.09, "petal")
        for _ in range(3):
            d = direction(rng)
            mesh.leaf((x, 0.3 * height, z), normalized((d[0], 0.6, d[2])), normalized((-0.5 * d[0], 1, -0.5 * d[2])), 0.3, 0.08, "leaf")
    return mesh


def berries():
    """Closed balls among twigs."""
    mesh, rng = Mesh(), random.Random(11)
    for _ in range(700):
        d, r = direction(rng), 4 * rng.random() ** (1 / 3)
        ball(mesh, tuple(r * x for x in d), 0.22, "paint", 6)
    for _ in range(60):
        d = direction(rng)
        mesh.tube([tuple(t * x for x in d) for t in (0, 2, 4)], 0.03, "bark")
    return mesh


def stairs():
    """Spiral stairs with a railing."""
    mesh = Mesh()
    for i in range(60):
        turn, y = 0.3 * i, 0.25 * i
        c, s = math.cos(turn), math.sin(turn)
        low, high = ([(r * c - aside * s, y + up, r * s + aside * c) for r, aside in ((0.2, -0.15), (2.2, -0.42), (2.2, 0.42), (0.2, 0.15))]
                     for up in (0, 0.06))
        mesh.slab(low, high, "wood")
        mesh.tube([(2.1 * c, y + 0.5 * t, 2.1 * s) for t in range(3)], 0.025, "paint", 8)
    mesh.tube([(2.1 * math.cos(0.1 * k), 1 + k / 12, 2.1 * math.sin(0.1 * k)) for k in range(178)], 0.04, "paint", 8)
    mesh.tube([(0, 0.25 * k, 0) for k in range(64)], 0.2, "steel", 12)
    return mesh


ASSETS = {"wicker": wicker, "scaffold": scaffold, "cactus": cactus, "gravel": gravel, "bricks": bricks, "palm": palm, "books": books,
          "wheat": wheat, "mail": mail, "daisies": daisies, "berries": berries, "stairs": stairs}


if __name__ == "__main__":
    make_fidelity_assets.write_assets(ASSETS, MATERIALS, __doc__, turned=True)
