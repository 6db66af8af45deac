#!/usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Writes an oak as production files have trees: bark of its own, and four kinds of twigs with their leaves that stand in
thousands of places (EXT_mesh_gpu_instancing), marked as one asset.

    scripts/make_tree_of_twigs.py OUT_DIR [--scale 1] [--trees 1]

OUT_DIR/oak_of_twigs.gltf   trees in rows, the first at the origin, and a camera under its crown; a twig has 156 triangles, a tree of scale 1 about
                            2.9 million
--scale 0.01                about a hundredth of the triangles: for tests
The same file every time for the same numpy.
"""
import argparse
import math
from pathlib import Path

import numpy as np

import make_heavy_forest as forest

KINDS = 4
LEAVES_PER_TWIG = 12


def twig(rng, order):
    """One twig from the origin up."""
    mesh = forest.Mesh()
    lines, radii = forest.grow(rng, np.zeros((1, 3)), np.array([[0.0, 1.0, 0.0]]), np.array([order["length"]]),
                               np.array([order["radius"]]), order)
    mesh.tubes("oak bark", lines, radii, order["sides"])
    forest.leafy(mesh, rng, lines, LEAVES_PER_TWIG, 0.11, forest.LOBED, ("oak green", "oak light"))
    return mesh


def places(rng, lines, radii, order, scale):
    """Where twigs stand: translations, rotations (from +y, turned about it) and scales."""
    of_twigs, _ = forest.branches(rng, lines, radii, order, scale)
    axis = forest.unit(of_twigs[:, 1] - of_twigs[:, 0])
    length = np.linalg.norm(np.diff(of_twigs, axis=1), axis=-1).sum(1)
    half = np.stack([axis[:, 2], 0 * length, -axis[:, 0], 1 + axis[:, 1]], 1)  # the shortest turn from +y
    half = forest.unit(np.where(half[:, 3:] > 1e-6, half, (1.0, 0.0, 0.0, 0.0)))
    spin = rng.uniform(0, math.pi, len(axis))
    x, y, z, w = half.T
    s, c = np.sin(spin), np.cos(spin)
    turned = np.stack([x * c - z * s, y * c + w * s, z * c + x * s, w * c - y * s], 1)  # half * (0, s, 0, c)
    return of_twigs[:, 0], turned, np.repeat((length / order["length"])[:, None], 3, 1)


def build(folder, scale, trees):
    folder.mkdir(parents=True, exist_ok=True)
    rng, (*boughs, last) = np.random.default_rng(7), forest.OAK
    bark, thinned = forest.Mesh(), scale ** (1 / len(boughs))  # per order
    lines, radii = forest.skeleton(bark, rng, boughs, thinned ** (len(boughs) - 1), "oak bark")
    transforms = places(rng, lines, radii, last, thinned)

    document, triangles = forest.Document(folder), bark.triangles()
    document.json["extensionsUsed"] = ["EXT_mesh_gpu_instancing", "KHR_materials_diffuse_transmission"]
    nodes = document.json["nodes"]
    nodes.append({"name": "bark", "mesh": forest.write_mesh(folder, document, "bark", bark)[0]})
    buffer = document.buffer("places.bin")
    with open(folder / "places.bin", "wb") as out:
        for kind in range(KINDS):
            mesh, name = twig(np.random.default_rng([8, kind]), last), "twig_%d" % kind
            index, _ = forest.write_mesh(folder, document, name, mesh)
            of_kind = [values[kind::KINDS] for values in transforms]
            forest.add_instances(document, buffer, out, name, index, of_kind)
            triangles += len(of_kind[0]) * mesh.triangles()
    add_trees(document, trees)
    nodes.append({"name": "under the crown", "camera": 0, "translation": [1.0, 5.0, 7.0]})
    document.json["cameras"] = [{"type": "perspective", "perspective": {"yfov": 0.7, "aspectRatio": 16 / 9, "znear": 0.01}}]
    document.write("oak_of_twigs.gltf")
    print("%s: %d twigs of %s triangles, bark %d: %d triangles in all places" % (
        folder / "oak_of_twigs.gltf", len(transforms[0]), mesh.triangles(), bark.triangles(), triangles))


def add_trees(document, trees):
    """Rows of trees of the nodes that there are, which become the first one's."""
    nodes = document.json["nodes"]
    of_tree, columns = list(nodes), max(1, math.isqrt(trees))
    for tree in range(trees):
        if tree > 0:
            nodes += [dict(node) for node in of_tree]
        nodes.append({"name": "oak", "translation": [14.0 * (tree % columns), 0.0, -14.0 * (tree // columns)],
                      "extras": {"farfield_asset": True}, "children": list(range(len(nodes) - len(of_tree), len(nodes)))})


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out_dir", type=Path)
    parser.add_argument("--scale", type=float, default=1.0)
    parser.add_argument("--trees", type=int, default=1)
    arguments = parser.parse_args()
    if not 0 < arguments.scale <= 4 or not 1 <= arguments.trees <= 100000:
        parser.error("scale must be in (0, 4], trees from 1 to 100000")
    build(arguments.out_dir, arguments.scale, arguments.trees)


if __name__ == "__main__":
    main()
