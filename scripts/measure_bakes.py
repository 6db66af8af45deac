#!/usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Bakes all assets of a glTF scene in one process and prints what each cost: the tables of docs/results/bake.md.

    scripts/measure_bakes.py SCENE.gltf OUT_DIR [--farfield build/release/bin/farfield] [BAKE OPTIONS...]
    scripts/measure_bakes.py --table REPORT.json...

Assets go to OUT_DIR/SCENE/NAME.farfield, where `farfield shot SCENE.gltf --assets OUT_DIR` finds them, and the report to
OUT_DIR/SCENE_bake_N.json with the first free N; --table prints such reports again, as one. What was baked before is left out.
Stages are wall seconds, which a busy machine stretches; CPU s is the process's own time.
"""
import argparse
import json
import subprocess
import sys
from pathlib import Path

STAGES = ("analysis", "simplify", "voxelize", "write")


def bake(arguments, bake_options):
    arguments.out_dir.mkdir(parents=True, exist_ok=True)
    number = 1
    while (report := arguments.out_dir / ("%s_bake_%d.json" % (arguments.scene.stem, number))).exists():
        number += 1
    code = subprocess.run([arguments.farfield, "bake", str(arguments.scene), "--scene", "-o",
                           str(arguments.out_dir / arguments.scene.stem), "--no-warnings", "--report", str(report), *bake_options],
                          stdout=subprocess.DEVNULL).returncode
    if code:
        print("measure_bakes: not all assets could be baked", file=sys.stderr)
    return report


def row(asset):
    levels = asset["levels"]
    stages = [asset["import_seconds"]] + [sum(level["seconds"][stage] for level in levels) for stage in STAGES]
    sizes = "%.1f | %.2f" % (levels[0]["bytes_resident"] / 2**20, levels[-1]["bytes_resident"] / 2**20)
    return "| %s | %.2f | %.0f | %.0f | %s | %s |" % (asset["asset"], levels[0]["triangles"] / 1e6, asset["cpu_seconds"],
                                                  asset["peak_bytes"] / 2**20, " | ".join("%.1f" % s for s in stages), sizes)


def print_table(reports):
    assets = [a for report in reports for a in json.loads(report.read_text())["assets"] if not a["up_to_date"]]
    print("| asset | M triangles | CPU s | peak MiB | read s | analyse s | simplify s | voxelise s | write s | level 0, MiB | root, MiB |\n"
          "|---|---|---|---|---|---|---|---|---|---|---|")
    for asset in assets:
        print(row(asset))
    if assets:
        triangles = sum(a["levels"][0]["triangles"] for a in assets)
        print("\n%d assets, %.1f M triangles: %.0f CPU s, peak %.0f MiB" % (
            len(assets), triangles / 1e6, sum(a["cpu_seconds"] for a in assets), max(a["peak_bytes"] for a in assets) / 2**20))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path, nargs="?")
    parser.add_argument("out_dir", type=Path, nargs="?")
    parser.add_argument("--table", type=Path, nargs="+", metavar="REPORT")
    parser.add_argument("--farfield", default="build/release/bin/farfield")
    arguments, bake_options = parser.parse_known_args()
    if not arguments.table and not arguments.out_dir:
        parser.error("give a scene and a folder, or --table")
    print_table(arguments.table or [bake(arguments, bake_options)])


if __name__ == "__main__":
    main()
