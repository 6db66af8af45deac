#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Prints docs/results/assets.md from the JSON that scripts/measure_assets left. Usage: measure_assets.py FOLDER NAME..."""
import json
import sys

from thesis_figures import occlusion_text


def percent(x, digits=2):
    return "-" if x is None else "%+.*f %%" % (digits, 100 * x)


def size(figures, name):
    """An error's size; where noise hides it, its bounds."""
    if figures[name] is not None:
        return "%.2f %%" % (100 * figures[name])
    return "unknown, %.2f to %.2f %%" % tuple(100 * bound for bound in figures["bounds"][name])


def bias(figures):
    return ", ".join(percent(b, 1) for b in figures["color_bias"])


def table(folder, name):
    evaluated = json.load(open("%s/%s.evaluate.json" % (folder, name)))
    baked = json.load(open("%s/%s.bake.json" % (folder, name)))
    print("## %s\n" % name)
    print("Baked in %.0f s.\n" % baked["total_seconds"])
    print("| grid | triangles | voxels | on disk, KiB | resident, KiB | occlusion error | rms | colour error | bias r, g, b "
          "| thesis: willow, vessel, maple |")
    print("|---" * 10 + "|")
    for level in evaluated["levels"]:
        print("| %d | %d | %d | %.0f | %.0f | %s | %s | %s | %s | %s |" % (
            level["grid"], level["triangles"], level["voxels"], level["bytes_disk"] / 1024,
            level["bytes_resident"] / 1024, percent(level["occlusion_error"]), size(level, "occlusion_rms"),
            size(level, "color_error"), bias(level),
            occlusion_text(level["grid"])))
    print("\n| grid | light | bias r, g, b | worst view, bias r, g, b | colour error | rms | 2x2 | 4x4 |\n" + "|---" * 8 + "|")
    for level in evaluated["levels"]:
        for light in level["lights"]:
            print("| %d | %s | %s | %d: %s | %s |" % (
                level["grid"], light["light"], bias(light), light["worst_view"]["view"], bias(light["worst_view"]),
                " | ".join(size(light, name) for name in ("color_error", "color_rms", "color_rms_2x2", "color_rms_4x4"))))
    print("\n![source, level, difference](%s.png)\n" % name)


def main():
    folder, names = sys.argv[1], sys.argv[2:]
    print("# Levels against their sources\n\nMade by `scripts/measure_assets OUT FILES...`. Errors as `docs/error_metric.md` defines them; "
          "the thesis's occlusion errors (figures 10.1 to 10.3, its own assets) beside. Levels that would not be smaller than "
          "a finer one are not stored and have no row.\n")
    for name in names:
        table(folder, name)


main()
