#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Levels of volumes by each way of downsampling, as the tables of docs/results/volumes.md.

Usage: scripts/measure_volumes.py FARFIELD WORK NAME=VDB[:FLAGS] ...

FARFIELD: the command. WORK: a folder for assets and figures; what is there is not made again. NAME=VDB:FLAGS: a name of
its own for a volume and the flags of `farfield bake` for it: "dense=cloud.vdb:--density-scale 40". In brackets behind
errors: standard errors in their last digits, of all that is left of noise in both pictures. Standard library only."""

import json
import pathlib
import resource
import subprocess
import sys

METHODS = ["linear", "transp", "iso", "aniso", "matched"]
LIGHTS = ["daylight", "front", "behind"]
SAMPLES = {"1-2": 12, "3": 256, "4-9": 768}  # per pixel and light: coarse levels have few pixels


def run(command):
    """Runs a command; the CPU seconds that it took."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measure(farfield, work, title, volume, flags, method):
    name = f"{title}_{method}"
    asset, figures, times = work / f"{name}.farfield", work / f"{name}.json", work / f"{name}.seconds"
    if not figures.exists():
        times.write_text(str(run([farfield, "bake", volume, "-o", asset, "--downsampling", method, *flags])))
        levels = []
        for wanted, samples in SAMPLES.items():
            result = subprocess.run([farfield, "evaluate", asset, "--source", volume, *flags, "--views", "6", "--lights",
                                     ",".join(LIGHTS), "--levels", wanted, "--spp", str(samples), "--json", figures],
                                    stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            if result.returncode == 0:  # else there is no such level
                levels += json.loads(figures.read_text())["levels"]
        figures.write_text(json.dumps(levels))
    manifest = json.loads((asset / "manifest.json").read_text())
    return json.loads(figures.read_text()), manifest, float(times.read_text())


def percent(value, error, digits):
    """+3.9(4): 3.9 with a standard error of 0.4."""
    return f"{100 * value:+.{digits}f}({round(100 * error * 10**digits)})"


def mean_bias(light):
    errors = light["standard_errors"]["color_bias"]  # channels share their paths: their mean is not better
    return percent(sum(light["color_bias"]) / 3, sum(errors) / 3, 1)


def rows_of(title, volume, flags, farfield, work):
    for method in METHODS:
        levels, manifest, seconds = measure(farfield, work, title, volume, flags, method)
        first = manifest["levels"][0]
        entries = {entry["level"]: entry for entry in manifest["levels"]}
        for level in levels:
            entry = entries[level["level"]]
            occlusion = percent(level["occlusion_error"], level["standard_errors"]["occlusion_error"], 2)
            biases = [mean_bias(light) for light in level["lights"]]
            yield (method, level["level"], f"{level['grid']}^3", occlusion, *biases,
                   f"{100 * entry['file_bytes'] / first['file_bytes']:.2f}",
                   f"{100 * entry['file_bytes'] / volume.stat().st_size:.2f}",
                   f"{100 * entry['ray_cost'] / first['ray_cost']:.0f}", f"{seconds:.1f}")


def main():
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    farfield, work = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    work.mkdir(parents=True, exist_ok=True)
    for word in sys.argv[3:]:
        title, _, place = word.partition("=")
        path, _, flags = place.partition(":")
        volume, flags = pathlib.Path(path), flags.split()
        print(f"\n### {title}: `{volume.name} {' '.join(flags)}`\n")
        print("| method | level | grid | occlusion, % | daylight, % | front, % | behind, % | bytes of level 0, % "
              "| of the .vdb, % | ray cost of level 0, % | bake, CPU s |")
        print("|" + "---|" * 11)
        for row in sorted(rows_of(title, volume, flags, farfield, work), key=lambda row: row[1]):
            print("| " + " | ".join(str(cell) for cell in row) + " |", flush=True)


if __name__ == "__main__":
    main()
