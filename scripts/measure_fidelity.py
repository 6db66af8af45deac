#!/usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Bakes assets 512^3 to 8^3, evaluates every level under every light, and writes docs/results/fidelity.md.

Usage: scripts/measure_fidelity.py FOLDER [--views N] [--only NAME...] [--bake-only] [FILE[*]...]

FILE: an asset beside the generated ones (scripts/make_fidelity_assets.py); with * behind it, one that was looked at while
tuning. What FOLDER has already is not done again: delete an asset's .cpu or .json for that. Needs the release build.
"""
import argparse
import json
import resource
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FARFIELD = ROOT / "build/release/bin/farfield"
sys.path.insert(0, str(ROOT / "scripts"))
import make_fidelity_assets


def run(*command):
    subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL)


def cpu_seconds(*command):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    run(*command)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def bake(name, source, folder):
    """CPU seconds."""
    seconds = folder / (name + ".cpu")
    if not seconds.exists():
        seconds.write_text("%f" % cpu_seconds(FARFIELD, "bake", source, "-o", folder / (name + ".farfield")))
    return float(seconds.read_text())


def evaluate(name, source, folder, views):
    result = folder / (name + ".json")
    levels = json.loads((folder / (name + ".farfield") / "manifest.json").read_text())["levels"]
    if len(levels) == 1:  # no other would be smaller than the source
        return {"levels": []}
    if not result.exists():
        run(FARFIELD, "evaluate", folder / (name + ".farfield"), "--source", source, "--views", views, "--json",
            result.with_suffix(".part"), "--sheet", folder / (name + ".png"))
        result.with_suffix(".part").rename(result)
    return json.loads(result.read_text())


def percent(value, digits=1):
    return "?" if value is None else "%+.*f" % (digits, 100 * value)


def bias(values):
    """The channel that is farthest off."""
    known = [value for value in values if value is not None]
    return percent(max(known, key=abs)) if known else "?"


def table(name, is_tuned, figures):
    lines = ["## %s%s" % (name, "" if is_tuned else " (untouched)"), "",
             "Bake: %.0f CPU seconds." % figures["bake_cpu_seconds"], ""]
    if not figures["levels"]:
        return lines + ["No level is smaller than the source, which is shown at every distance.", ""]
    lights = [light["light"] for light in figures["levels"][0]["lights"]]
    head = ["grid", "on disk, KiB", "coverage", "rms", "rms, touched", *lights]
    lines += ["| %s |" % " | ".join(head), "|---" * len(head) + "|"]
    for level in figures["levels"]:
        row = ["%d" % level["grid"], "%.0f" % (level["bytes_disk"] / 1024), percent(level["occlusion_error"]),
               percent(level["occlusion_rms"])[1:], percent(level["occlusion_rms_touched"])[1:],
               *(bias(light["color_bias"]) for light in level["lights"])]
        lines.append("| %s |" % " | ".join(row))
    return lines + [""]


def summary(results):
    lines = ["## All in one", "", "Levels whose coverage is within 1 %, and whose colour is within 2 % in each channel, per light.", ""]
    for is_tuned in (True, False):
        levels = [level for _, tuned, figures in results if tuned == is_tuned for level in figures["levels"]]
        if not levels:
            continue
        covered = sum(abs(level["occlusion_error"]) <= 0.01 for level in levels)
        lines.append("* %s: coverage %d of %d" % ("looked at while tuning" if is_tuned else "untouched", covered, len(levels)))
        for i, light in enumerate(levels[0]["lights"]):
            right = sum(all(b is not None and abs(b) <= 0.02 for b in level["lights"][i]["color_bias"]) for level in levels)
            lines[-1] += ", %s %d" % (light["light"], right)
    return lines + [""]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("files", nargs="*")
    parser.add_argument("--views", type=int, default=6)
    parser.add_argument("--only", nargs="*", help="of the generated assets")
    parser.add_argument("--bake-only", action="store_true")
    options = parser.parse_intermixed_args()
    names = list(make_fidelity_assets.ASSETS) if options.only is None else options.only
    generated = options.folder / "generated"
    if names:
        run(ROOT / "scripts/make_fidelity_assets.py", generated, *names)
    assets = [(Path(file.rstrip("*")).name.replace(".gz", "").replace(".", "_"), file.endswith("*"), file.rstrip("*"))
              for file in options.files]
    assets += [(name, False, generated / (name + ".glb")) for name in names]
    results = []
    for name, is_tuned, source in assets:
        print(name, flush=True)
        seconds = bake(name, source, options.folder)
        if not options.bake_only:
            figures = evaluate(name, source, options.folder, options.views)
            results.append((name, is_tuned, {**figures, "bake_cpu_seconds": seconds}))
    if not options.bake_only:
        write_page(results, options.views)


def write_page(results, views):
    lines = ["# How alike levels look", "",
             "Made by `scripts/measure_fidelity.py FOLDER FILES...` with %d views. Coverage: occlusion error of the level, %% of what"
             " the source covers;" % views,
             "then its rms per pixel, and over touched pixels. Under each light the mean colour's bias, %, of the channel that is"
             " farthest off", "(`docs/error_metric.md`); ?: lost in noise. Untouched: not looked at while tuning (decisions 0012, 0013).",
             ""]
    lines += summary(results)
    for result in results:
        lines += table(*result)
    (ROOT / "docs/results/fidelity.md").write_text("\n".join(lines))


if __name__ == "__main__":
    main()
