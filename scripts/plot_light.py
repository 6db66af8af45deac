#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Draws the figures of docs/results/light.md from the numbers of build/release/bin/scattering_figures.

usage: scripts/plot_light.py CSV_FOLDER PNG_FOLDER      (needs Debian's python3-matplotlib)
"""
import csv
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

source, target = sys.argv[1:3]


def rows(name):
    with open(f"{source}/{name}.csv") as file:
        return list(csv.DictReader(file))


def save(figure, name):
    figure.tight_layout()
    figure.savefig(f"{target}/{name}.png", dpi=80)
    plt.close(figure)


def plot_codec():
    data = rows("codec")
    figure, axes = plt.subplots(1, 2, figsize=(11, 4), sharey=True)
    for axis, shape in zip(axes, ("needle", "disk")):
        for size in ("6", "12"):
            part = [r for r in data if r["shape"] == shape and r["bytes"] == size]
            x = [float(r["smallest"]) for r in part]
            line, = axis.loglog(x, [float(r["max"]) for r in part], label=f"{size} bytes, maximum")
            axis.loglog(x, [float(r["mean"]) for r in part], "--", color=line.get_color(), label=f"{size} bytes, mean")
        axis.set_title("eigenvalues (1, e, e)" if shape == "needle" else "eigenvalues (1, 1, e)")
        axis.set_xlabel("e")
        axis.grid(True, alpha=0.3)
    axes[0].set_ylabel("error of sigma (largest sigma = 1)")
    axes[0].legend()
    save(figure, "codec_error")


def plot_rg():
    data = rows("rg")
    side = int(np.sqrt(len(data)))
    error = np.array([float(r["error"]) for r in data]).reshape(side, side)
    figure, axis = plt.subplots(figsize=(6, 4.6))
    image = axis.imshow(error.T * 1e3, origin="lower", extent=(0, 1, 0, 1), cmap="RdBu", vmin=-0.75, vmax=0.75)
    axis.set_xlabel("sqrt(l2 / l1)")
    axis.set_ylabel("sqrt(l3 / l1)")
    figure.colorbar(image, label="relative error of the fast R_G, 1e-3")
    save(figure, "rg_error")


def plot_lobes():
    maps = [("d_sggx", "D, SGGX (1, .1, .4)"), ("d_lobes", "D, lobes fitted to it"),
            ("phase_specular", "specular SGGX phase function"),
            ("phase_shadowed", "fitted lobes with anisotropic A"),
            ("phase_leaf", "diffuse flakes 0.5 + transmission 0.3"),
            ("phase_glossy_leaf", "the same with F0 = 0.04, roughness^2 = 0.04")]
    figure, axes = plt.subplots(3, 2, figsize=(11, 9))
    for axis, (name, title) in zip(axes.flat, maps):
        values = np.loadtxt(f"{source}/{name}.csv", delimiter=",")
        image = axis.imshow(values, extent=(0, 360, 180, 0), cmap="magma", vmin=0)
        if name.startswith("phase"):
            axis.plot([26.6], [42.2], "wx")
        axis.set_title(title)
        figure.colorbar(image, ax=axis, shrink=0.7)
    save(figure, "lobes")


def plot_furnace():
    data = rows("furnace")
    figure, axes = plt.subplots(1, 3, figsize=(13, 4), sharey=True)
    for axis, surface in zip(axes, ("diffuse", "plastic", "metal")):
        for roughness2 in ("0.01", "0.1", "0.5"):
            if surface == "diffuse" and roughness2 != "0.01":
                continue
            part = [r for r in data if (r["surface"], r["roughness2"]) == (surface, roughness2)]
            axis.plot([float(r["cos"]) for r in part], [float(r["albedo"]) for r in part], label=f"alpha^2 {roughness2}")
        axis.set_title({"diffuse": "diffuse 1", "plastic": "diffuse 1 under F0 = 0.04", "metal": "F0 = 1"}[surface])
        axis.set_xlabel("cosine of the view")
        axis.grid(True, alpha=0.3)
        axis.legend(fontsize=7)
    axes[0].set_ylabel("albedo in a white furnace")
    axes[0].set_ylim(0, 1.05)
    save(figure, "furnace")


plot_codec()
plot_rg()
plot_lobes()
plot_furnace()
