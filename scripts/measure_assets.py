#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Prints docs/results/assets.md from the JSON that scripts/measure_assets left. Usage: measure_assets.py FOLDER NAME..."""
import json
import sys

# Thesis, figures 10.1 to 10.3: occlusion error in % at 512^3 ... 16^3 of its willow, vessel and maple.
THESIS = {512: (0.90, 1.3, -2.4), 256: (1.7, 0.94, -1.35), 128: (2.1, 2.8, 0.75), 64: (2.8, 0.63, 2.86),
          32: (4.4, 1.3, 5.11), 16: (8.3, 7.3, 7.97)}


def percent(x, digits=2):
    return "-" if x is None else "%+.*f %%" % (digits, 100 * x)


def color_error(level):
    if level["color_error_low"] > 0:
        return percent(level["color_error"])
    return "lost in noise (with it %.0f %%)" % (100 * level["color_error_raw"])


def table(folder, name):
    evaluated = json.load(open("%s/%s.evaluate.json" % (folder, name)))
    baked = json.load(open("%s/%s.bake.json" % (folder, name)))
    print("## %s\n" % name)
    print("Baked in %.0f s.\n" % baked["total_seconds"])
    print("| grid | triangles | voxels | on disk, KiB | resident, KiB | occlusion error | rms | colour error | bias r, g, b "
          "| thesis: willow, vessel, maple |")
    print("|---" * 10 + "|")
    for level in evaluated["levels"]:
        thesis = THESIS.get(level["grid"])
        print("| %d | %d | %d | %.0f | %.0f | %s | %s | %s | %s | %s |" % (
            level["grid"], level["triangles"], level["voxels"], level["bytes_disk"] / 1024,
            level["bytes_resident"] / 1024, percent(level["occlusion_error"]), percent(level["occlusion_rms"]),
            color_error(level), ", ".join(percent(b, 1) for b in level["color_bias"]),
            ", ".join("%+.2f" % t for t in thesis) if thesis else "-"))
    print("\n![source, level, difference](%s.png)\n" % name)


def main():
    folder, names = sys.argv[1], sys.argv[2:]
    print("# Levels against their sources\n\nMade by `scripts/measure_assets OUT FILES...`. Errors as `docs/error_metric.md` defines them; "
          "the thesis's occlusion errors (figures 10.1 to 10.3, its own assets) beside. Levels that would not be smaller than "
          "a finer one are not stored and have no row.\n")
    for name in names:
        table(folder, name)


main()
