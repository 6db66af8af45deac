#!/usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Renders a shot at budgets of 50 to 1 % of what its full detail takes, and prints the table of docs/results/scale.md.

    scripts/measure_budgets.py SCENE OUT_DIR [--farfield build/release/bin/farfield] [SHOT OPTIONS...]

The shot options go to `farfield shot`, e.g. --frames 0-120:40 --size 160x90 --spp 4 --assets DIR. Assets that are missing
are baked first. Full detail: the resident bytes of level 0 of every asset, as their manifests have them, without instances.
Coarser: by how many levels than asked, the mean over pixels, per frame. Stall: what frames waited for levels, of their time. OUT_DIR/budgets.svg shows the table.
"""
import argparse
import json
import math
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
    print("\n| budget | MiB | accounted, peak | RSS over what there was before, peak | coarser, first to last frame | stall, s (share) "
          "| CPU s |\n|---|---|---|---|---|---|---|")
    points = []
    for share in SHARES:
        name, budget = "budget_%g" % (100 * share), int(full * share)
        code, seconds, _ = shot(name, budget)
        if code:
            last = (arguments.out_dir / (name + ".log")).read_text().strip().splitlines()[-1:]
            print("| %g %% | %s | failed: %s | | | | |" % (100 * share, mib(budget), " ".join(last)), flush=True)
            continue
        report = json.loads((arguments.out_dir / name / "shot.json").read_text())
        rss = report["peak_rss_bytes"] - report["baseline_rss_bytes"]
        coarser = [f["bias"] for f in report["frames"]]
        points.append((budget, report["peak_accounted_bytes"], rss, sum(coarser) / len(coarser)))
        stall, wall = (sum(f[key] for f in report["frames"]) for key in ("stall_seconds", "seconds"))
        print("| %g %% | %s | %s | %s | %s | %.1f (%.1f %%) | %.0f |" % (
            100 * share, mib(budget), mib(report["peak_accounted_bytes"]), mib(rss), " ".join("%.2f" % c for c in coarser),
            stall, 100 * stall / wall, seconds), flush=True)
    (arguments.out_dir / "budgets.svg").write_text(plot(points))


def plot(points):
    """Taken memory against the budget on logarithmic axes, and how much coarser levels were."""
    width, height, margin = 560, 360, 56
    if not points:
        return '<svg xmlns="http://www.w3.org/2000/svg"/>'
    low = math.floor(math.log2(min(min(p[:3]) for p in points) / 2**20))
    high = math.ceil(math.log2(max(max(p[:3]) for p in points) / 2**20))

    def at(value, length):
        return (math.log2(value / 2**20) - low) / (high - low) * (length - 2 * margin)

    def place(budget, taken):
        return margin + at(budget, width), height - margin - at(taken, height)

    out = ['<svg xmlns="http://www.w3.org/2000/svg" width="%d" height="%d" font-family="sans-serif" font-size="12">' % (width, height),
           '<rect width="100%" height="100%" fill="white"/>']
    for power in range(low, high + 1):
        x, y = place(2**20 * 2.0**power, 2**20 * 2.0**power)
        out.append('<path d="M%.1f %d V%d M%d %.1f H%d" stroke="#ddd"/>' % (x, margin, height - margin, margin, y, width - margin))
        out.append('<text x="%.1f" y="%d" text-anchor="middle">%g</text>' % (x, height - margin + 16, 2.0**power))
        out.append('<text x="%d" y="%.1f" text-anchor="end">%g</text>' % (margin - 6, y + 4, 2.0**power))
    out.append('<text x="%d" y="%d" text-anchor="middle">budget, MiB</text>' % (width / 2, height - 12))
    out.append('<text x="12" y="20">taken at the peak, MiB; figures: levels coarser than asked</text>')
    out.append('<path d="M%.1f %.1f L%.1f %.1f" stroke="#999" stroke-dasharray="4"/>' % (
        *place(2**20 * 2.0**low, 2**20 * 2.0**low), *place(2**20 * 2.0**high, 2**20 * 2.0**high)))
    for column, color, name in ((1, "#06c", "accounted"), (2, "#c30", "resident")):
        line = [place(p[0], p[column]) for p in points]
        out.append('<polyline fill="none" stroke="%s" points="%s"/>' % (color, " ".join("%.1f,%.1f" % xy for xy in line)))
        out.extend('<circle cx="%.1f" cy="%.1f" r="3" fill="%s"/>' % (*xy, color) for xy in line)
        out.append('<text x="%d" y="%d" fill="%s">%s</text>' % (margin + 8, margin + 16 * column, color, name))
    for p in points:
        x, y = place(p[0], max(p[1], p[2]))
        out.append('<text x="%.1f" y="%.1f" text-anchor="middle">%.2f</text>' % (x, y - 8, p[3]))
    return "\n".join(out + ["</svg>", ""])


if __name__ == "__main__":
    main()
