#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The picture of docs/results/volumes.md: a row for each volume, the source and its levels 1 to 4 from the same place.

Usage: scripts/volume_sheet.py OUT.jpg WORK VDB[:FLAGS] ...

WORK: a folder for the assets. FLAGS: density_scale and albedo, "cloud.vdb:density_scale=4 albedo=0.99". Needs the module
farfield (PYTHONPATH=build/release/lib/python3/dist-packages, or so), numpy and OpenImageIO's (python3-openimageio)."""

import pathlib
import sys

import numpy as np
import farfield
import OpenImageIO as oiio

SIDE, MARGIN = 160, 45  # pixels of a picture, and what is cut off around it
EXPOSURE = 0.6
LEVELS = range(5)
SAMPLES = 40


def srgb(linear):
    linear = np.clip(linear, 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def row(volume, flags, work):
    asset = work / f"{volume.stem}.farfield"
    options = {name: float(value) for name, value in (flag.split("=") for flag in flags)}
    report = farfield.bake_file(volume, asset, **options)
    last = report["levels"][-1]["level"]
    pixels = SIDE + 2 * MARGIN
    pictures = [farfield.render(asset, width=pixels, height=pixels, level=min(level, last), samples=SAMPLES)
                for level in LEVELS]
    return np.concatenate([srgb(EXPOSURE * picture[MARGIN:-MARGIN, MARGIN:-MARGIN]) for picture in pictures], axis=1)


def main():
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    work = pathlib.Path(sys.argv[2])
    work.mkdir(parents=True, exist_ok=True)
    rows = []
    for word in sys.argv[3:]:
        path, _, flags = word.partition(":")
        rows.append(row(pathlib.Path(path), flags.split(), work))
    sheet = np.round(255 * np.concatenate(rows)).astype(np.uint8)
    spec = oiio.ImageSpec(sheet.shape[1], sheet.shape[0], 3, oiio.UINT8)
    spec["Compression"] = "jpeg:82"
    output = oiio.ImageOutput.create(sys.argv[1])
    if not output or not output.open(sys.argv[1], spec) or not output.write_image(sheet):
        sys.exit(f"{sys.argv[1]}: {oiio.geterror()}")
    output.close()


if __name__ == "__main__":
    main()
