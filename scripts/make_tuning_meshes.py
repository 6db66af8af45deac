#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the meshes that densities were tuned on besides the public tree (docs/decisions/0012), as OBJ files:

    scripts/make_tuning_meshes.py OUT_DIR

rigging.obj  ropes of 6 sides between masts and yards, and ratlines: thin, long, aligned.
planks.obj   three decks of 60 boards with gaps of a tenth of their width.
conifer.obj  a tree of needles: clumps of clumps, no leaf as wide as a voxel.
shingles.obj a ridge roof of shingles that overlap, of uneven widths (docs/decisions/0014).
slats.obj    sheets without thickness, with gaps of 4 %, in a slanted plane.
barrel.obj   a round wall of staves, with gaps of 3 %.
pickets.obj  boards apart in a slanted plane, with gaps of 60 %.
netting.obj  round wires of two directions that pass each other, on a cylinder (docs/decisions/0031).
holes.obj    a sheet without thickness, with square holes.
"""
import math
import random
import sys
from pathlib import Path


class Mesh:
    def __init__(self):
        self.points, self.faces = [], []

    def tube(self, a, b, radius, sides=6):
        """A closed rod from a to b."""
        axis = [q - p for p, q in zip(a, b)]
        length = math.sqrt(sum(x * x for x in axis))
        w = [x / length for x in axis]
        u = cross(w, (1, 0, 0) if abs(w[0]) < 0.7 else (0, 1, 0))
        u = scaled(u, 1 / math.sqrt(sum(x * x for x in u)))
        v = cross(w, u)
        first = len(self.points) + 1
        for end in (a, b):
            for i in range(sides):
                c, s = radius * math.cos(2 * math.pi * i / sides), radius * math.sin(2 * math.pi * i / sides)
                self.points.append([e + c * x + s * y for e, x, y in zip(end, u, v)])
        for i in range(sides):
            j = (i + 1) % sides
            self.faces.append([first + i, first + j, first + sides + j, first + sides + i])
        self.faces.append([first + i for i in reversed(range(sides))])
        self.faces.append([first + sides + i for i in range(sides)])

    def box(self, lower, upper):
        first = len(self.points) + 1
        for i in range(8):
            self.points.append([(upper if i >> a & 1 else lower)[a] for a in range(3)])
        for face in ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)):
            self.faces.append([first + i for i in face])

    def write(self, path):
        with open(path, "w") as out:
            out.writelines("v %.6g %.6g %.6g\n" % tuple(p) for p in self.points)
            out.writelines("f " + " ".join(map(str, f)) + "\n" for f in self.faces)


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def scaled(a, f):
    return [x * f for x in a]


def rigging():
    mesh = Mesh()
    for mast in (-4.0, 0.0, 4.0):
        mesh.tube((mast, 0, 0), (mast, 10, 0), 0.12, 8)
        for height in (4.0, 6.5, 9.0):
            mesh.tube((mast, height, -2.2), (mast, height, 2.2), 0.06)
        for side in (-1, 1):
            feet = [(mast + 0.25 * (i - 3), 0.0, side * 2.0) for i in range(7)]
            for foot in feet:
                mesh.tube(foot, (mast, 8.0, 0), 0.02)
            for step in range(1, 24):  # ratlines
                t = step / 26
                ends = [[p + t * (q - p) for p, q in zip(foot, (mast, 8.0, 0))] for foot in (feet[0], feet[-1])]
                mesh.tube(ends[0], ends[1], 0.01)
        for height in (6.0, 8.0, 9.8):  # stays
            mesh.tube((mast, height, 0), (mast + 3.6, 0.5, 0), 0.02)
    return mesh


def planks():
    mesh = Mesh()
    for deck in range(3):
        for i in range(60):
            mesh.box((-5, 1.5 * deck, -3 + 0.1 * i), (5, 1.5 * deck + 0.04, -3 + 0.1 * i + 0.09))
    return mesh


def shingles():
    """Two slopes of 25 degrees; a shingle is as thick as a tenth of its length."""
    mesh, rng = Mesh(), random.Random(11)
    rise, run = math.sin(math.radians(25)), math.cos(math.radians(25))
    for slope in (-1, 1):
        for row in range(24):
            x = -6 - rng.uniform(0, 0.5)
            while x < 6:
                width = rng.uniform(0.3, 0.6)
                corners = []
                for along, up in ((0.25 * row, 0.05), (0.25 * row + 0.4, 0.0)):
                    for dx in (0.01, width - 0.01):
                        for lift in (0.0, 0.04):
                            corners.append([x + dx, along * rise + (up + lift) * run, slope * (6 - along * run + (up + lift) * rise)])
                first = len(mesh.points) + 1
                mesh.points += corners
                for face in ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)):
                    mesh.faces.append([first + i for i in face])
                x += width
    return mesh


def slats():
    mesh = Mesh()
    for i in range(100):
        first = len(mesh.points) + 1
        for along, across in ((0, 0), (6, 0), (6, 0.096), (0, 0.096)):
            v = 0.1 * i + across
            mesh.points.append([along, 0.8 * v, 0.6 * v + 0.2 * along])
        mesh.faces.append([first + k for k in range(4)])
    return mesh


def barrel():
    mesh = Mesh()
    staves, bands = 90, 12
    for i in range(staves):
        first = len(mesh.points) + 1
        for k in range(bands + 1):
            height = k / bands
            radius = 2 + 0.5 * math.sin(math.pi * height)
            for r in (radius, radius + 0.05):
                for turn in (i, i + 0.97):
                    angle = 2 * math.pi * turn / staves
                    mesh.points.append([r * math.cos(angle), 5 * height, r * math.sin(angle)])
        for k in range(bands):
            a = first + 4 * k
            mesh.faces += [[a, a + 1, a + 5, a + 4], [a + 2, a + 6, a + 7, a + 3], [a, a + 4, a + 6, a + 2],
                           [a + 1, a + 3, a + 7, a + 5]]
        mesh.faces += [[first, first + 2, first + 3, first + 1]]
        last = first + 4 * bands
        mesh.faces += [[last, last + 1, last + 3, last + 2]]
    return mesh


def pickets():
    """80 boards of 0.1 x 0.05 with gaps of 0.15, which lean."""
    mesh = Mesh()
    for i in range(80):
        first = len(mesh.points) + 1
        for k in range(8):
            along, up, out = 0.25 * i + 0.1 * (k & 1), 8 * (k >> 1 & 1), 0.05 * (k >> 2 & 1)
            mesh.points.append([0.9 * along - 0.3 * out, up + 0.3 * along, 0.4 * along + 0.5 * up + out])
        for face in ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)):
            mesh.faces.append([first + i for i in face])
    return mesh


def netting():
    """Wires 0.05 wide, 0.2 apart, around a quarter of a cylinder."""
    mesh, radius = Mesh(), 12.0
    at = lambda turn, height, out: ((radius + out) * math.cos(turn), height, (radius + out) * math.sin(turn))
    for i in range(60):
        for k in range(36):
            mesh.tube(at(math.pi / 2 * k / 36, 0.2 * i, 0.03), at(math.pi / 2 * (k + 1) / 36, 0.2 * i, 0.03), 0.025, 8)
    for i in range(95):
        mesh.tube(at(math.pi / 2 * i / 95, 0, -0.03), at(math.pi / 2 * i / 95, 12, -0.03), 0.025, 8)
    return mesh


def holes():
    """40 x 30 holes of 0.6 at distances of 1."""
    mesh = Mesh()
    sheet = lambda x, y, w, h: ((x, y), (x + w, y), (x + w, y + h), (x, y + h))
    for i in range(40):
        for k in range(30):
            for corners in (sheet(i, k, 1, 0.4), sheet(i, k + 0.4, 0.4, 0.6)):
                first = len(mesh.points) + 1
                mesh.points += [[x, y, 0.3 * x] for x, y in corners]
                mesh.faces.append([first + c for c in range(4)])
    return mesh


def conifer(seed=3):
    mesh, rng = Mesh(), random.Random(seed)
    mesh.tube((0, 0, 0), (0, 10, 0), 0.12, 8)
    for whorl in range(28):
        height = 1.0 + 8.8 * whorl / 28
        reach = 3.0 * (1 - (height - 1) / 9.6)
        for _ in range(6):
            azimuth = rng.uniform(0, 2 * math.pi)
            out = (math.cos(azimuth), -0.25 + rng.uniform(-0.1, 0.1), math.sin(azimuth))
            length = reach * rng.uniform(0.7, 1.0)
            tip = [length * x for x in out]
            tip[1] += height
            mesh.tube((0, height, 0), tip, 0.02, 4)
            for _ in range(int(70 * length)):
                t = rng.uniform(0.15, 1)
                at = [t * length * x for x in out]
                at[1] += height
                way = [x + rng.uniform(-1.2, 1.2) for x in out]
                norm = 0.16 / math.sqrt(sum(x * x for x in way))
                mesh.tube(at, [p + norm * x for p, x in zip(at, way)], 0.006, 3)
    return mesh


def main():
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    for make in (rigging, planks, conifer, shingles, slats, barrel, pickets, netting, holes):
        make().write(out / (make.__name__ + ".obj"))


if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    main()
