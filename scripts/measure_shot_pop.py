#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How much a shot changes from frame to frame, against the same shot of full detail: pops stand out.

usage: scripts/measure_shot_pop.py SCENE OUTPUT_FOLDER [--frames 0-120] [--size 96x54] [--spp 64] [--budget 64M]
                                   [--finest-grid 128]

Renders every frame at full detail, and with levels that dissolve, that morph, and that change at once (a blend window
of a thousandth). Change of frame n: sum of |I(n+1) - I(n)| over sums of 4x4 pixels, over the sum of I(n); the noise of
frames is in all of them alike. Prints a table and leaves change.svg (all frames) and strip.png (morph, each tenth).
Needs python3-openimageio and python3-numpy."""
import argparse
import os
import subprocess
import sys

import numpy
import OpenImageIO as oiio

FARFIELD = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "build", "release", "bin", "farfield")
SETTINGS = {
    "full detail": ["--full-detail"],
    "at once": ["--blend-window", "0.001"],
    "dissolve": [],
    "morph": ["--blend", "morph"],
}
COLORS = {"full detail": "#888888", "at once": "#cc3311", "dissolve": "#0077bb", "morph": "#009988"}


def render(arguments, setting):
    folder = os.path.join(arguments.output, setting.replace(" ", "_"))
    budget = "16GiB" if setting == "full detail" else arguments.budget
    subprocess.run([FARFIELD, "shot", arguments.scene, "--frames", arguments.frames, "--size", arguments.size, "--spp",
                    str(arguments.spp), "--budget", budget, "--finest-grid", str(arguments.finest_grid), "--assets",
                    os.path.join(arguments.output, "assets"), "-o", folder] + SETTINGS[setting], check=True)
    return folder


def read_frames(folder):
    names = sorted(name for name in os.listdir(folder) if name.endswith(".exr"))
    if not names:
        sys.exit(f"measure_shot_pop.py: no EXR in {folder}")
    return [oiio.ImageBuf(os.path.join(folder, name)).get_pixels(oiio.FLOAT)[:, :, :3] for name in names]


def block_sums(image, side=4):
    height, width = (size // side * side for size in image.shape[:2])
    return image[:height, :width].reshape(height // side, side, width // side, side, 3).sum(axis=(1, 3))


def changes(frames):
    sums = [block_sums(frame) for frame in frames]
    return numpy.array([numpy.abs(b - a).sum() / a.sum() for a, b in zip(sums, sums[1:])])


def plot(curves, path):
    width, height, top = 900, 300, max(max(curve) for curve in curves.values())
    lines = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="-60 -20 {width + 80} {height + 60}" '
             'font-family="sans-serif" font-size="12">', f'<rect width="{width}" height="{height}" fill="#fafafa"/>']
    for tick in range(6):
        y = height - height * tick / 5
        lines.append(f'<text x="-8" y="{y + 4}" text-anchor="end">{100 * top * tick / 5:.1f} %</text>')
    for i, (name, curve) in enumerate(curves.items()):
        points = " ".join(f"{width * n / max(1, len(curve) - 1):.1f},{height * (1 - value / top):.1f}"
                          for n, value in enumerate(curve))
        lines.append(f'<polyline points="{points}" fill="none" stroke="{COLORS[name]}" stroke-width="1.5"/>')
        lines.append(f'<text x="{20 + 120 * i}" y="{height + 30}" fill="{COLORS[name]}">{name}</text>')
    with open(path, "w") as file:
        file.write("\n".join(lines + ["</svg>\n"]))


def write_strip(frames, path, exposure=1.0):
    strip = numpy.concatenate(frames[::10], axis=1)
    image = numpy.clip(strip * exposure, 0, 1) ** (1 / 2.2)
    buffer = oiio.ImageBuf(oiio.ImageSpec(image.shape[1], image.shape[0], 3, oiio.UINT8))
    buffer.set_pixels(oiio.ROI(), image.astype(numpy.float32))
    buffer.write(path)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("output")
    parser.add_argument("--frames", default="0-120")
    parser.add_argument("--size", default="96x54")
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--budget", default="64M")
    parser.add_argument("--finest-grid", type=int, default=128)
    arguments = parser.parse_args()
    frames = {setting: read_frames(render(arguments, setting)) for setting in SETTINGS}
    curves = {setting: changes(images) for setting, images in frames.items()}
    full = curves["full detail"]
    print("| setting | largest change | at frame | beyond full detail's at that frame, largest | mean change |")
    print("|---|---|---|---|---|")
    for setting, curve in curves.items():
        beyond = curve - full
        print(f"| {setting} | {100 * curve.max():.2f} % | {curve.argmax()} | {100 * beyond.max():+.2f} % "
              f"(frame {beyond.argmax()}) | {100 * curve.mean():.2f} % |")
    plot(curves, os.path.join(arguments.output, "change.svg"))
    write_strip(frames["morph"], os.path.join(arguments.output, "strip.png"))


if __name__ == "__main__":
    main()
