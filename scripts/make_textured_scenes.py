#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Usage: scripts/make_textured_scenes.py OUT_DIR [COW.obj TEXTURE.png]

Writes OUT_DIR/ship.glb, a ship of few triangles and many texels (2048^2 colour, normal and mask textures, smooth
normals, a lantern that shines and a pane of glass), made here from nothing; with an OBJ of a textured mesh also
OUT_DIR/cow.glb, its normals smoothed, and OUT_DIR/cow_fine.glb, the same in 64 times as many triangles. Each has the cameras `close`, `middle` and `far`. Needs python3-numpy."""
import json
import math
import struct
import sys
import zlib
from pathlib import Path

import numpy as np

# ---- textures: arrays of rows from the top, 0 to 255


def noise(size, cells, seed):
    """Smooth periodic noise in [0, 1]."""
    values = np.random.default_rng(seed).random((cells, cells))
    at = np.arange(size) * cells / size
    low = at.astype(int)
    t = at - low
    t = t * t * (3 - 2 * t)
    high = (low + 1) % cells
    rows = values[low] * (1 - t)[:, None] + values[high] * t[:, None]
    return rows[:, low] * (1 - t)[None, :] + rows[:, high] * t[None, :]


def planks(size, count, seed):
    """Colour and tangent-space normals of `count` planks along u."""
    rng = np.random.default_rng(seed)
    v = np.arange(size) / size * count
    plank = v.astype(int)
    across = v - plank
    u = np.arange(size) / size
    shade = 0.75 + 0.25 * rng.random(count)
    grain = 0.8 + 0.2 * noise(size, 64, seed)
    seam = np.minimum(across, 1 - across) < 0.04
    butt = (np.abs((u[None, :] * 4 + rng.random(count)[plank][:, None]) % 1 - 0.5) > 0.495)
    wood = np.array([0.42, 0.26, 0.13])
    color = wood[None, None, :] * (shade[plank][:, None] * grain)[:, :, None]
    color[seam | np.zeros((size, 1), bool)[:, 0]] *= 0.25
    color[butt] *= 0.35
    height = np.clip(np.minimum(across, 1 - across) / 0.08, 0, 1)[:, None] + 0.15 * grain
    return to_srgb(color), normals_of(height * size / 200)


def normals_of(height):
    dx = (np.roll(height, -1, 1) - np.roll(height, 1, 1)) / 2
    dy = (np.roll(height, -1, 0) - np.roll(height, 1, 0)) / 2
    n = np.stack([-dx, dy, np.ones_like(height)], -1)  # green points up the image
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    return np.round((n * 0.5 + 0.5) * 255).astype(np.uint8)


def to_srgb(linear):
    c = np.clip(linear, 0, 1)
    return np.round(255 * np.where(c <= 0.0031308, 12.92 * c, 1.055 * c ** (1 / 2.4) - 0.055)).astype(np.uint8)


def emblem(size):
    """Canvas with a red ring, a star, and thin stripes that only a close-up resolves."""
    y, x = np.mgrid[0:size, 0:size] / size - 0.5
    radius, angle = np.hypot(x, y), np.arctan2(y, x)
    color = np.ones((size, size, 3)) * np.array([0.78, 0.72, 0.58]) * (0.85 + 0.15 * noise(size, 128, 5))[:, :, None]
    color[(np.abs(y * 64) % 1 < 0.12)] *= 0.8
    color[(radius > 0.3) & (radius < 0.36)] = [0.55, 0.03, 0.02]
    star = radius < 0.15 + 0.1 * np.cos(5 * (angle + math.pi / 2))
    color[star] = [0.02, 0.05, 0.25]
    fine = star & ((x * 200).astype(int) % 2 == 0)
    color[fine] = [0.5, 0.42, 0.1]
    return to_srgb(color)


def ratlines(size):
    """RGBA: ropes that cross, the rest see-through."""
    y, x = np.mgrid[0:size, 0:size] / size
    rope = (np.abs((x * 6) % 1 - 0.5) > 0.46) | (np.abs((y * 12) % 1 - 0.5) > 0.45)
    image = np.zeros((size, size, 4), np.uint8)
    twist = 0.5 + 0.5 * (((x + y) * 160) % 1)
    image[..., :3] = to_srgb(np.array([0.3, 0.22, 0.12]) * twist[..., None])
    image[..., 3] = np.where(rope, 255, 0)
    return image


def png(image):
    height, width, channels = image.shape
    rows = np.concatenate([np.zeros((height, 1), np.uint8), image.reshape(height, width * channels)], 1)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 2 if channels == 3 else 6, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows.tobytes(), 6)) + chunk(b"IEND", b"")


# ---- shapes: dictionaries of position, normal, uv (per vertex) and triangles


def grid(columns, rows, place):
    """place(u, v) -> point, for arrays u and v; normals from differences, v points down the image."""
    v, u = np.mgrid[0:rows + 1, 0:columns + 1]
    u, v = u / columns, v / rows
    points = place(u, v)
    step = 1e-4
    du = place(u + step, v) - place(u - step, v)
    dv = place(u, v + step) - place(u, v - step)
    normals = np.cross(dv, du)
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    normals = np.where(length > 1e-12, normals / np.maximum(length, 1e-12), [0, 1, 0])
    at = np.arange((rows + 1) * (columns + 1)).reshape(rows + 1, columns + 1)
    a, b, c, d = at[:-1, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, 1:].ravel(), at[1:, :-1].ravel()
    return {"position": points.reshape(-1, 3), "normal": normals.reshape(-1, 3),
            "uv": np.stack([u, v], -1).reshape(-1, 2),
            "triangles": np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])}


def stack(x, y, z):
    x, y, z = np.broadcast_arrays(x, y, z)
    return np.stack([x, y, z], -1).astype(float)


def hull(u, v):
    along = 2 * u - 1
    beam = 1.2 * np.clip(1 - np.abs(along) ** 2.5, 0, None) ** 0.7
    angle = math.pi * (v - 0.5)
    keel = 1.3 - 0.5 * along ** 2
    return stack(4 * along, 0.25 * along ** 2 - keel * np.cos(angle), -beam * np.sin(angle))


def deck(u, v):
    along = 2 * u - 1
    beam = 1.2 * np.clip(1 - np.abs(along) ** 2.5, 0, None) ** 0.7
    return stack(4 * along, 0.25 * along ** 2 - 0.02, (2 * v - 1) * beam * 0.98)


def pole(bottom, top, radius):
    bottom, top = np.array(bottom, float), np.array(top, float)

    def place(u, v):
        a = 2 * math.pi * u
        axis = (top - bottom) / np.linalg.norm(top - bottom)
        side = np.cross(axis, [0.3, 0.1, 1])
        side /= np.linalg.norm(side)
        other = np.cross(axis, side)
        return (top + (bottom - top) * v[..., None] + radius * (np.cos(a)[..., None] * side + np.sin(a)[..., None] * other))

    return place


def sail(x, low, high, half, belly):
    def place(u, v):
        bulge = belly * np.sin(math.pi * np.clip(u, 0, 1)) * np.sin(math.pi * (0.15 + 0.8 * np.clip(v, 0, 1)))
        width = half * (0.8 + 0.2 * v)
        return stack(x + bulge, high + (low - high) * v, (2 * u - 1) * width)

    return place


def ball(center, radius):
    def place(u, v):
        a, b = 2 * math.pi * u, math.pi * v
        return stack(center[0] + radius * np.sin(b) * np.cos(a), center[1] + radius * np.cos(b),
                     center[2] - radius * np.sin(b) * np.sin(a))

    return place


def ship_parts():
    parts = [("hull", grid(48, 16, hull)), ("deck", grid(24, 8, deck))]
    for x, top in ((-1.4, 4.2), (1.2, 5.0)):
        parts.append(("mast", grid(10, 1, pole((x, 0, 0), (x, top, 0), 0.09))))
        parts.append(("mast", grid(8, 1, pole((x + 0.1, top - 0.7, -1.7), (x + 0.1, top - 0.7, 1.7), 0.05))))
        parts.append(("sail", grid(12, 12, sail(x + 0.12, 1.0, top - 0.75, 1.7, 0.5))))
        for side in (-1, 1):
            def shroud(u, v, x=x, top=top, side=side):
                width = 0.5 * (1 - 0.85 * (1 - v))
                return stack(x + (2 * u - 1) * width, (top - 0.2) * (1 - v), side * 1.05 * v)

            parts.append(("ratlines", grid(1, 1, shroud)))
    parts.append(("lantern", grid(16, 8, ball((-3.8, 0.75, 0), 0.14))))
    parts.append(("pane", grid(1, 1, lambda u, v: stack(-3.3 + 0 * u, 0.2 + 0.6 * (1 - v), (u - 0.5) * 0.8))))
    return parts


# ---- glb


class Glb:
    def __init__(self):
        self.blob = bytearray()
        self.json = {"asset": {"version": "2.0", "generator": "farfield scripts/make_textured_scenes.py"}, "scene": 0,
                     "scenes": [{"nodes": []}], "nodes": [], "meshes": [], "materials": [], "textures": [],
                     "images": [], "samplers": [{}], "accessors": [], "bufferViews": [], "cameras": []}

    def view(self, data):
        self.blob += b"\0" * (-len(self.blob) % 4)
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.blob), "byteLength": len(data)})
        self.blob += data
        return len(self.json["bufferViews"]) - 1

    def accessor(self, array, kind, component):
        entry = {"bufferView": self.view(array.tobytes()), "componentType": component, "count": len(array), "type": kind}
        if kind == "VEC3":
            entry |= {"min": array.min(0).tolist(), "max": array.max(0).tolist()}
        self.json["accessors"].append(entry)
        return len(self.json["accessors"]) - 1

    def texture(self, png_bytes):
        self.json["images"].append({"bufferView": self.view(png_bytes), "mimeType": "image/png"})
        self.json["textures"].append({"source": len(self.json["images"]) - 1, "sampler": 0})
        return {"index": len(self.json["textures"]) - 1}

    def material(self, **fields):
        self.json["materials"].append(fields)
        return len(self.json["materials"]) - 1

    def primitive(self, shape, material):
        real = np.float32
        return {"attributes": {"POSITION": self.accessor(shape["position"].astype(real), "VEC3", 5126),
                               "NORMAL": self.accessor(shape["normal"].astype(real), "VEC3", 5126),
                               "TEXCOORD_0": self.accessor(shape["uv"].astype(real), "VEC2", 5126)},
                "indices": self.accessor(shape["triangles"].astype(np.uint32).reshape(-1), "SCALAR", 5125),
                "material": material}

    def node(self, **fields):
        self.json["nodes"].append(fields)
        self.json["scenes"][0]["nodes"].append(len(self.json["nodes"]) - 1)

    def camera(self, name, eye, target):
        eye, target = np.array(eye, float), np.array(target, float)
        z = (eye - target) / np.linalg.norm(eye - target)
        x = np.cross([0, 1, 0], z)
        x /= np.linalg.norm(x)
        y = np.cross(z, x)
        m = np.eye(4)
        m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = x, y, z, eye
        self.json["cameras"].append({"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.01, "aspectRatio": 1.5}})
        self.node(name=name, camera=len(self.json["cameras"]) - 1, matrix=m.T.reshape(-1).tolist())

    def write(self, path):
        self.json = {key: value for key, value in self.json.items() if value != []}
        self.json["buffers"] = [{"byteLength": len(self.blob)}]
        text = json.dumps(self.json).encode()
        text += b" " * (-len(text) % 4)
        blob = bytes(self.blob) + b"\0" * (-len(self.blob) % 4)
        path.write_bytes(struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(blob)) + struct.pack("<II", len(text), 0x4E4F534A)
                         + text + struct.pack("<II", len(blob), 0x004E4942) + blob)


def write_ship(path):
    glb = Glb()
    size = 2048
    wood, grooves = planks(size, 24, 1)
    floor, _ = planks(size, 40, 2)
    wood_map, groove_map = glb.texture(png(wood)), glb.texture(png(grooves))

    def pbr(roughness=1.0, **more):
        return {"metallicFactor": 0, "roughnessFactor": roughness, **more}

    materials = {
        "hull": glb.material(name="hull", pbrMetallicRoughness=pbr(0.5, baseColorTexture=wood_map), normalTexture=groove_map,
                             doubleSided=True),
        "deck": glb.material(name="deck", pbrMetallicRoughness=pbr(baseColorTexture=glb.texture(png(floor))), doubleSided=True),
        "mast": glb.material(name="mast", pbrMetallicRoughness=pbr(baseColorFactor=[0.25, 0.15, 0.08, 1])),
        "sail": glb.material(name="sail", pbrMetallicRoughness=pbr(baseColorTexture=glb.texture(png(emblem(size)))),
                             doubleSided=True),
        "ratlines": glb.material(name="ratlines", pbrMetallicRoughness=pbr(baseColorTexture=glb.texture(png(ratlines(size)))),
                                 alphaMode="MASK", doubleSided=True),
        "lantern": glb.material(name="lantern", pbrMetallicRoughness=pbr(baseColorFactor=[0.8, 0.8, 0.8, 1]),
                                emissiveFactor=[1, 0.6, 0.2], extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 8}}),
        "pane": glb.material(name="pane", pbrMetallicRoughness=pbr(0.0, baseColorFactor=[0.9, 1, 0.95, 1]), doubleSided=True,
                             extensions={"KHR_materials_transmission": {"transmissionFactor": 0.9}}),
    }
    glb.json["extensionsUsed"] = ["KHR_materials_emissive_strength", "KHR_materials_transmission"]
    glb.json["meshes"].append({"name": "ship", "primitives": [glb.primitive(shape, materials[name]) for name, shape in ship_parts()]})
    glb.node(name="ship", mesh=0)
    glb.camera("close", (4.2, 2.6, 3.2), (1.3, 2.1, 0))
    glb.camera("middle", (14, 6, 15), (0, 1.5, 0))
    glb.camera("far", (70, 30, 75), (0, 1.5, 0))
    glb.write(path)


def read_obj(path):
    """A mesh of v, vt and f, with smooth normals: the angle-weighted mean of the faces at a vertex."""
    positions, uvs, faces = [], [], []
    for line in path.read_text().splitlines():
        word, *rest = line.split() or [""]
        if word == "v":
            positions.append([float(x) for x in rest[:3]])
        elif word == "vt":
            uvs.append([float(rest[0]), 1 - float(rest[1])])
        elif word == "f":
            corners = [tuple(int(i) - 1 for i in corner.split("/")[:2]) for corner in rest]
            faces += [(corners[0], corners[k], corners[k + 1]) for k in range(1, len(corners) - 1)]
    positions = np.array(positions)
    normals = np.zeros_like(positions)
    for face in faces:
        a, b, c = (positions[p] for p, _ in face)
        normal = np.cross(b - a, c - a)
        for p, _ in face:
            normals[p] += normal
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    vertices = {}
    triangles = [[vertices.setdefault(corner, len(vertices)) for corner in face] for face in faces]
    order = list(vertices)
    return {"position": np.array([positions[p] for p, _ in order]), "normal": np.array([normals[p] for p, _ in order]),
            "uv": np.array([uvs[t] for _, t in order]), "triangles": np.array(triangles)}


def subdivide(shape):
    """Each triangle becomes four of the same plane; normals in between are interpolated."""
    t = shape["triangles"]
    edges = np.sort(np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1)
    unique, inverse = np.unique(edges, axis=0, return_inverse=True)
    count = len(shape["position"])
    middle = (inverse.reshape(3, len(t)) + count).T
    out = {key: np.concatenate([shape[key], shape[key][unique].mean(1)]) for key in ("position", "normal", "uv")}
    out["normal"] /= np.linalg.norm(out["normal"], axis=1, keepdims=True)
    ab, bc, ca = middle[:, 0], middle[:, 1], middle[:, 2]
    out["triangles"] = np.concatenate([np.stack(f, -1) for f in ((t[:, 0], ab, ca), (ab, t[:, 1], bc), (ca, bc, t[:, 2]), (ab, bc, ca))])
    return out


def write_cow(obj, texture, path, subdivisions=0):
    glb = Glb()
    shape = read_obj(obj)
    for _ in range(subdivisions):
        shape = subdivide(shape)
    material = glb.material(name="cow", pbrMetallicRoughness={"metallicFactor": 0, "roughnessFactor": 0.6,
                                                             "baseColorTexture": glb.texture(texture.read_bytes())})
    glb.json["meshes"].append({"name": "cow", "primitives": [glb.primitive(shape, material)]})
    glb.node(name="cow", mesh=0)
    low, high = shape["position"].min(0), shape["position"].max(0)
    middle, size = (low + high) / 2, np.linalg.norm(high - low)
    head = middle + np.array([0, 0.25, -0.33]) * size
    glb.camera("close", head + np.array([0.25, 0.08, -0.3]) * size, head)
    glb.camera("middle", middle + np.array([1.0, 0.4, -0.9]) * size, middle)
    glb.camera("far", middle + np.array([10, 4, -9]) * size, middle)
    glb.write(path)


def main():
    if len(sys.argv) not in (2, 4) or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    write_ship(out / "ship.glb")
    if len(sys.argv) == 4:
        write_cow(Path(sys.argv[2]), Path(sys.argv[3]), out / "cow.glb")
        write_cow(Path(sys.argv[2]), Path(sys.argv[3]), out / "cow_fine.glb", subdivisions=3)


if __name__ == "__main__":
    main()
