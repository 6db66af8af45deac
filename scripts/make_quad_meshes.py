#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the generated quad meshes of docs/results/surfaces.md as OBJ files with MTL: a capped cylinder, a torus, a
cube and a ship's hull.

    scripts/make_quad_meshes.py FOLDER
"""
import math
import pathlib
import sys


class Mesh:
    def __init__(self):
        self.points, self.faces, self.number = [], [], {}

    def point(self, p):
        """Points that coincide up to rounding are one."""
        key = tuple(round(x, 9) for x in p)
        if key not in self.number:
            self.number[key] = len(self.points) + 1
            self.points.append(p)
        return self.number[key]

    def patch(self, nu, nv, at, material):
        """nu x nv faces over at(u, v), u and v in [0, 1]; where sides coincide, faces are triangles or nothing."""
        for j in range(nv):
            for i in range(nu):
                corners = []
                for u, v in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)):
                    n = self.point(at(u / nu, v / nv))
                    if n not in corners:
                        corners.append(n)
                if len(corners) > 2:
                    self.faces.append((material(i, j), corners))

    def write(self, path):
        colours = {"light": (0.8, 0.75, 0.6), "dark": (0.1, 0.15, 0.3), "red": (0.7, 0.1, 0.05)}
        with open(path.with_suffix(".mtl"), "w") as mtl:
            for name, colour in colours.items():
                mtl.write(f"newmtl {name}\nKd {colour[0]} {colour[1]} {colour[2]}\n")
        with open(path, "w") as obj:
            obj.write(f"mtllib {path.with_suffix('.mtl').name}\n")
            for p in self.points:
                obj.write("v %.9g %.9g %.9g\n" % tuple(p))
            used = None
            for material, corners in self.faces:
                if material != used:
                    obj.write(f"usemtl {material}\n")
                    used = material
                obj.write("f " + " ".join(map(str, corners)) + "\n")
        quads = sum(len(corners) == 4 for _, corners in self.faces)
        print(f"{path}: {len(self.points)} points, {quads} quads, {len(self.faces) - quads} triangles")


def turn(x):
    """Points of equal angles are equal."""
    return (math.cos(2 * math.pi * (x % 1)), math.sin(2 * math.pi * (x % 1)))


def stripes(width):
    return lambda i, j: "dark" if i // width % 2 else "light"


def cylinder():
    """128 around, 96 along; caps are fans of rings with triangles in the middle."""
    mesh = Mesh()
    mesh.patch(128, 96, lambda u, v: (*turn(u), 3 * v - 1.5), stripes(8))
    for z in (-1.5, 1.5):
        mesh.patch(128, 24, lambda u, v: (turn(u)[0] * (1 - v), turn(u)[1] * (1 - v), z), stripes(8))
    return mesh


def torus():
    mesh = Mesh()

    def at(u, v):
        (c, s), (x, z) = turn(u), turn(v)
        return (c * (1 + 0.35 * x), s * (1 + 0.35 * x), 0.35 * z)

    mesh.patch(192, 64, at, stripes(12))
    return mesh


def cube():
    """A rounded cube of six grids: eight poles where three of them meet."""
    mesh = Mesh()
    for axis in range(3):
        for side in (-1, 1):

            def at(u, v):
                p = [0.0, 0.0, 0.0]
                p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3] = side, 2 * u - 1, 2 * v - 1
                near = [max(-0.8, min(0.8, x)) for x in p]
                away = [x - n for x, n in zip(p, near)]
                length = math.sqrt(sum(a * a for a in away))
                return [n + 0.2 * a / length for n, a in zip(near, away)]

            mesh.patch(40, 40, at, stripes(8))
    return mesh


def hull():
    """Open at the deck; finer at bow, keel and rail, as modellers do it; with a deck house of its own."""
    mesh = Mesh()

    def fine_at_ends(x):
        return 0.5 - 0.5 * math.cos(math.pi * x)

    def at(u, v):
        x, around = fine_at_ends(u), 2 * v - 1  # from stern to bow; from rail over the keel to rail
        beam = 0.9 * (1 - max(0, 2 * x - 1) ** 2.5) * (0.75 + 0.25 * min(1, 4 * x))
        draught = 1.0 * (1 - max(0, 2.5 * x - 1.5) ** 3 * 0.7)
        a = abs(around)
        y = math.copysign(beam * min(1, 1.15 * math.sin(0.5 * math.pi * a)) if a < 0.66 else beam, around)
        z = -draught * math.cos(0.5 * math.pi * a) + 0.35 * max(0, 2 * x - 1) ** 2 * a
        return (8 * x - 4, y, z)

    mesh.patch(160, 72, at, lambda i, j: "red" if 14 < j < 57 else "dark")

    def wall(u, v):
        ring = [(-2.6, -0.45), (-0.8, -0.45), (-0.8, 0.45), (-2.6, 0.45)]
        side = int(4 * u) % 4
        t = 4 * u - int(4 * u)
        a, b = ring[side], ring[(side + 1) % 4]
        return (a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), 0.1 + 0.7 * v)

    mesh.patch(64, 12, wall, stripes(4))
    mesh.patch(16, 16, lambda u, v: (-2.6 + 1.8 * u, -0.45 + 0.9 * v, 0.8), stripes(4))
    return mesh


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for make in (cylinder, torus, cube, hull):
        make().write(folder / f"{make.__name__}.obj")
