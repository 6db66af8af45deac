#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Prints the table of docs/results/light.md from a run of the bench:

  build/release/bin/scattering_bench --benchmark_repetitions=7 --benchmark_enable_random_interleaving=true \\
      --benchmark_min_time=0.02 --benchmark_out=bench.json --benchmark_out_format=json
  scripts/light_table.py bench.json
"""
import json
import statistics
import sys

times = {}
for run in json.load(open(sys.argv[1]))["benchmarks"]:
    if run["run_type"] == "iteration" and not run["name"].startswith("acceptance"):
        times.setdefault(run["run_name"], []).append(run["cpu_time"])

groups = {}
for name, values in times.items():
    group, _, what = name.partition("/")
    groups.setdefault(group, []).append((what, statistics.median(values), min(values), max(values)))

print("| model | ns of CPU, median (lowest-highest) |")
print("|---|---|")
for group, entries in groups.items():
    cells = [f"{what or 'call'} {median:.3g} ({low:.3g}-{high:.3g})" for what, median, low, high in entries]
    print(f"| {group} | {' · '.join(cells)} |")
