#!/usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Makes every plant of a GLB scene move: a copy of the file in which each node that shows a mesh, but for grounds, walks
on a circle of its own and turns. For motion blur (`farfield shot --shutter`) in scenes that we have.

    scripts/make_moving_scene.py IN.glb OUT.glb [--copies 1] [--frames 121] [--speed 0.15] [--turn 3]

--copies 3    the nodes three times, side by side (grounds once)
--speed 0.15  metres a frame; --turn 3: degrees a frame about the upright axis
The same file every time. Only the standard library.
"""
import argparse
import json
import math
import random
import struct
from pathlib import Path

FRAMES_PER_SECOND = 24
KEY_FRAMES = 4  # between keys


def read_glb(path):
    data = Path(path).read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20:20 + length]), bytearray(data[20 + length + 8:])


def write_glb(path, doc, blob):
    doc["buffers"][0]["byteLength"] = len(blob)
    text = json.dumps(doc, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    blob += b"\0" * (-len(blob) % 4)
    with open(path, "wb") as f:
        f.write(struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(blob)))
        f.write(struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(blob), 0x004E4942) + blob)


def add_accessor(doc, blob, values):
    width = len(values[0])
    flat = [x for value in values for x in value]
    blob += b"\0" * (-len(blob) % 4)
    doc["bufferViews"].append({"buffer": 0, "byteOffset": len(blob), "byteLength": 4 * len(flat)})
    stored = struct.pack("<%df" % len(flat), *flat)
    blob += stored
    flat = struct.unpack("<%df" % len(flat), stored)
    doc["accessors"].append({"bufferView": len(doc["bufferViews"]) - 1, "componentType": 5126, "count": len(values),
                             "type": {1: "SCALAR", 3: "VEC3", 4: "VEC4"}[width],
                             "min": [min(flat[i::width]) for i in range(width)],
                             "max": [max(flat[i::width]) for i in range(width)]})
    return len(doc["accessors"]) - 1


def multiply(a, b):
    """Of quaternions x, y, z, w."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz)


def way(node, frames, rng, speed, turn):
    """Translations and rotations of a node at the keys."""
    x, y, z = node.get("translation", (0.0, 0.0, 0.0))
    rotation = node.get("rotation", (0.0, 0.0, 0.0, 1.0))
    radius, start, sense = rng.uniform(2, 6), rng.uniform(0, 2 * math.pi), rng.choice((-1, 1))
    places, turns = [], []
    for frame in frames:
        angle = start + sense * speed / radius * frame
        places.append((x + radius * (math.cos(angle) - math.cos(start)), y,
                       z + radius * (math.sin(angle) - math.sin(start))))
        half = 0.5 * sense * math.radians(turn) * frame
        turns.append(multiply((0.0, math.sin(half), 0.0, math.cos(half)), rotation))
    return places, turns


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("source", type=Path)
    parser.add_argument("scene", type=Path)
    parser.add_argument("--copies", type=int, default=1)
    parser.add_argument("--frames", type=int, default=121)
    parser.add_argument("--speed", type=float, default=0.15)
    parser.add_argument("--turn", type=float, default=3.0)
    options = parser.parse_args()

    doc, blob = read_glb(options.source)
    nodes = doc["nodes"]
    roots = doc["scenes"][doc.get("scene", 0)]["nodes"]
    rng = random.Random(11)
    movers = [i for i in roots if "mesh" in nodes[i] and "ground" not in nodes[i].get("name", "")]
    originals = list(movers)
    spread = max(nodes[i].get("translation", (0, 0, 0))[0] for i in movers)
    for copy in range(1, options.copies):
        for i in originals:
            node = json.loads(json.dumps(nodes[i]))
            x, y, z = node.get("translation", (0.0, 0.0, 0.0))
            node["translation"] = [x + rng.uniform(-0.5, 0.5) * spread, y, z + rng.uniform(-0.5, 0.5) * spread]
            node["name"] = "%s, copy %d" % (node.get("name", "node"), copy)
            nodes.append(node)
            roots.append(len(nodes) - 1)
            movers.append(len(nodes) - 1)

    frames = list(range(0, options.frames + KEY_FRAMES, KEY_FRAMES))
    times = add_accessor(doc, blob, [(frame / FRAMES_PER_SECOND,) for frame in frames])
    samplers, channels = [], []
    for i in movers:
        for path, values in zip(("translation", "rotation"), way(nodes[i], frames, rng, options.speed, options.turn)):
            channels.append({"sampler": len(samplers), "target": {"node": i, "path": path}})
            samplers.append({"input": times, "output": add_accessor(doc, blob, values), "interpolation": "LINEAR"})
    doc.setdefault("animations", []).append({"name": "walk", "samplers": samplers, "channels": channels})
    write_glb(options.scene, doc, blob)
    print("%s: %d of %d nodes move" % (options.scene, len(movers), len(nodes)))


if __name__ == "__main__":
    main()
