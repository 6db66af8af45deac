#!/usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Renders a shot at budgets of 50 to 1 % of what its full detail takes, and prints the table of docs/results/scale.md.

    scripts/measure_budgets.py SCENE OUT_DIR [--farfield build/release/bin/farfield] [SHOT OPTIONS...]

The shot options go to `farfield shot`, e.g. --frames 0-120:40 --size 160x90 --spp 4 --assets DIR. Assets that are missing
are baked first. Full detail: the resident bytes of level 0 of every asset, as their manifests have them.
"""
import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

SHARES = (0.5, 0.25, 0.1, 0.05, 0.02, 0.01)


def run(command, log):
    """Exit code, CPU seconds and peak resident bytes of a program."""
    with open(log, "w") as out:
        child = subprocess.Popen(command, stdout=out, stderr=subprocess.STDOUT)
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
    return child.returncode, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024


def full_detail_bytes(assets):
    manifests = [json.loads(p.read_text()) for p in Path(assets).rglob("manifest.json") if ".partial" not in str(p)]
    return sum(m["levels"][0]["resident_bytes"] for m in manifests), sum(m["levels"][0]["triangles"] for m in manifests)


def mib(count):
    return "%.2f" % (count / 2**20)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("out_dir", type=Path)
    parser.add_argument("--farfield", default="build/release/bin/farfield")
    parser.add_argument("--assets", required=True)
    arguments, shot_options = parser.parse_known_args()
    arguments.out_dir.mkdir(parents=True, exist_ok=True)

    def shot(name, budget, *more):
        command = [arguments.farfield, "shot", arguments.scene, "-o", str(arguments.out_dir / name), "--assets",
                   arguments.assets, "--budget", str(budget), *shot_options, *more]
        return run(command, arguments.out_dir / (name + ".log"))

    code, seconds, _ = shot("unlimited", "64G")
    if code:
        sys.exit("measure_budgets: the shot fails without a budget; see " + str(arguments.out_dir / "unlimited.log"))
    full, triangles = full_detail_bytes(arguments.assets)
    print("Full detail: %d triangles, %s MiB; without a limit %.0f CPU s" % (triangles, mib(full), seconds))
    print("\n| budget | MiB | accounted, peak | RSS over what there was before, peak | finest levels, first to last frame "
          "| CPU s |\n|---|---|---|---|---|---|")
    for share in SHARES:
        name, budget = "budget_%g" % (100 * share), int(full * share)
        code, seconds, _ = shot(name, budget)
        if code:
            last = (arguments.out_dir / (name + ".log")).read_text().strip().splitlines()[-1:]
            print("| %g %% | %s | failed: %s | | | |" % (100 * share, mib(budget), " ".join(last)))
            continue
        report = json.loads((arguments.out_dir / name / "shot.json").read_text())
        rss = report["peak_rss_bytes"] - report["baseline_rss_bytes"]
        levels = " ".join("%.1f" % (sum(f["finest_level"].values()) / len(f["finest_level"])) for f in report["frames"])
        print("| %g %% | %s | %s | %s | %s | %.0f |" % (100 * share, mib(budget), mib(report["peak_accounted_bytes"]), mib(rss),
                                                        levels, seconds))
        sys.stdout.flush()


if __name__ == "__main__":
    main()
