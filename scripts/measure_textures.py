#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Prints docs/results/textures.md from what scripts/measure_textures left, and writes docs/results/textures.png.
Usage: measure_textures.py FOLDER NAME... Needs python3-numpy."""
import json
import struct
import sys
import zlib

import numpy as np

from make_textured_scenes import png

CAMERAS = ("close", "middle", "far")


def read_png(path):
    """An 8-bit RGB PNG as an array."""
    data, at, packed = open(path, "rb").read(), 8, b""
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        chunk = data[at + 8:at + 8 + size]
        at += 12 + size
        if kind == b"IHDR":
            width, height, depth, color = struct.unpack(">IIBB", chunk[:10])
            channels = {2: 3, 6: 4}[color]
            assert depth == 8
        elif kind == b"IDAT":
            packed += chunk
    raw = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, width * channels + 1)
    rows = np.zeros((height + 1, width + 1, channels), np.int32)  # a border of zeros above and left
    for y in range(height):
        kind, line = raw[y, 0], raw[y, 1:].reshape(width, channels).astype(np.int32)
        if kind == 2:
            rows[y + 1, 1:] = (line + rows[y, 1:]) & 255
            continue
        if kind == 0:
            rows[y + 1, 1:] = line
            continue
        for x in range(width):
            left, up, corner = rows[y + 1, x], rows[y, x + 1], rows[y, x]
            if kind == 1:
                guess = left
            elif kind == 3:
                guess = (left + up) // 2
            else:
                p = left + up - corner
                a, b, c = abs(p - left), abs(p - up), abs(p - corner)
                guess = np.where((a <= b) & (a <= c), left, np.where(b <= c, up, corner))
            rows[y + 1, x + 1] = (line[x] + guess) & 255
    return rows[1:, 1:, :3].astype(np.uint8)


def linear(image):
    c = image.astype(float) / 255
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def percent(x, digits=1):
    return "%+.*f %%" % (digits, 100 * x)


def level_table(folder, name):
    manifest = json.load(open(f"{folder}/{name}.farfield/manifest.json"))
    textures = sum(t["cache_bytes"] for t in manifest.get("textures", []))
    source = manifest["levels"][0]
    print(f"## {name}\n\nLevel 0: {source['triangles']} triangles, {source['resident_bytes'] / 1024:.0f} KiB, and "
          f"{len(manifest.get('textures', []))} textures of {textures / 2**20:.1f} MiB in memory.\n")
    print("| grid | triangles | voxels | resident, KiB | occlusion error | colour error | bias r, g, b |\n" + "|---" * 7 + "|")
    for level in json.load(open(f"{folder}/{name}.evaluate.json"))["levels"]:
        print("| %d | %d | %d | %.0f | %s | %s | %s |" % (
            level["grid"], level["triangles"], level["voxels"], level["bytes_resident"] / 1024, percent(level["occlusion_error"], 2),
            "unknown" if level["color_error"] is None else percent(level["color_error"]), ", ".join(percent(b) for b in level["color_bias"])))
    print()


def frame_table(folder, name):
    print("| camera | budget | taken, MiB | RSS growth, MiB | mean against full detail r, g, b | mean of the difference |\n"
          + "|---" * 6 + "|")
    rows = []
    for camera in CAMERAS:
        full = None
        for kind in ("full", "levels", "paged"):
            shot = f"{folder}/{name}.{camera}.{kind}"
            record = json.load(open(shot + "/shot.json"))
            image = read_png(shot + "/frame_0000.png")
            if kind != "paged":
                rows.append(image)
            if full is None:
                full = linear(image)
            light = linear(image)
            growth = record["peak_rss_bytes"] - record["baseline_rss_bytes"]
            ratio = light.mean((0, 1)) / full.mean((0, 1)) - 1
            print("| %s | %s | %.1f | %.1f | %s | %s |" % (
                camera, {"full": "1 GiB, full detail", "levels": "1 GiB", "paged": "16 MiB"}[kind],
                record["peak_accounted_bytes"] / 2**20, growth / 2**20,
                ", ".join(percent(r, 2) for r in ratio), percent(np.abs(light - full).mean() / full.mean(), 2)))
    print()
    return rows


def main():
    folder, names = sys.argv[1], sys.argv[2:]
    print("# Textured assets up close, mid-way and far\n\nMade by `scripts/measure_textures OUT COW.obj TEXTURE.png` (the cow: "
          "spot, by Keenan Crane; the ship: ours). Errors of levels as `docs/error_metric.md` defines them, 12 views. Frames: 480 x 320, 64 samples; "
          "*full detail* is level 0 alone; 16 MiB holds the textures of the ship only in part, so they are paged. What two frames "
          "of the same picture differ by is noise: the samples are the same only where the levels are.\n")
    sheet = []
    for name in names:
        level_table(folder, name)
        rows = frame_table(folder, name)
        sheet += [np.concatenate([rows[i] for i in (0, 2, 4)], 1), np.concatenate([rows[i] for i in (1, 3, 5)], 1)]
    with open("docs/results/textures.png", "wb") as out:
        out.write(png(np.ascontiguousarray(np.concatenate(sheet, 0)[::2, ::2])))
    print("![each asset: full detail above, levels below](textures.png)\n\nEach asset from close up, mid-way and far: full detail above, "
          "levels below.")


main()
