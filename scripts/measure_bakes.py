#!/usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Bakes each mesh of a glTF scene and prints what that cost: the tables of docs/results/bake.md.

    scripts/measure_bakes.py SCENE.gltf OUT_DIR [--farfield build/release/bin/farfield] [BAKE OPTIONS...]

Assets go to OUT_DIR/SCENE/MESH.farfield, where `farfield shot SCENE.gltf --assets OUT_DIR` finds them. Reports stay beside
them, and what has one is not measured again. Stages are wall seconds, which a busy machine stretches; CPU s is the
process's own time.
"""
import argparse
import json
import os
import subprocess
from pathlib import Path

STAGES = ("analysis", "simplify", "voxelize", "write")


def measure(command, report):
    child = subprocess.Popen([*command, "--report", str(report)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        return None
    measured = json.loads(report.read_text())
    measured["cpu_seconds"], measured["peak_bytes"] = usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024
    report.write_text(json.dumps(measured))
    return measured


def row(name, report):
    levels = report["levels"]
    stages = [report["import_seconds"]] + [sum(level["seconds"][stage] for level in levels) for stage in STAGES]
    return "| %s | %.2f | %.0f | %.0f | %s |" % (name, levels[0]["triangles"] / 1e6, report["cpu_seconds"],
                                               report["peak_bytes"] / 2**20, " | ".join("%.1f" % s for s in stages))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path)
    parser.add_argument("out_dir", type=Path)
    parser.add_argument("--farfield", default="build/release/bin/farfield")
    arguments, bake_options = parser.parse_known_args()
    folder = arguments.out_dir / arguments.scene.stem
    folder.mkdir(parents=True, exist_ok=True)
    print("| mesh | M triangles | CPU s | peak MiB | read s | analyse s | simplify s | voxelise s | write s |\n"
          "|---|---|---|---|---|---|---|---|---|")
    for number, mesh in enumerate(json.loads(arguments.scene.read_text())["meshes"]):
        name = mesh["name"]
        path = folder / (name + ".json")
        command = [arguments.farfield, "bake", str(arguments.scene), "--mesh", str(number), "-o",
                   str(folder / (name + ".farfield")), "--no-warnings", *bake_options]
        report = json.loads(path.read_text()) if path.exists() else measure(command, path)
        print(row(name, report) if report else "| %s | failed |" % name, flush=True)


if __name__ == "__main__":
    main()
