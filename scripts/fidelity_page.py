# SPDX-License-Identifier: Apache-2.0
"""The text of docs/results/fidelity.md, from what scripts/measure_fidelity.py has measured."""
from thesis_figures import occlusion_text


class Figures:
    """Of one asset. levels: of our bake, as `farfield evaluate --json` gives them; simplified: method -> the same of meshes."""

    def __init__(self, name, is_tuned, cpu_seconds=0, levels=(), simplified=None, failure=None):
        self.name, self.is_tuned, self.failure = name, is_tuned, failure
        self.cpu_seconds, self.levels, self.simplified = cpu_seconds, list(levels), simplified or {}


def percent(value, digits=1):
    return "?" if value is None else "%+.*f" % (digits, 100 * value)


def size(value):
    return percent(value).lstrip("+")


def bias(values):
    """The channel that is farthest off."""
    known = [value for value in values if value is not None]
    return percent(max(known, key=abs)) if known else "?"


def is_covered(level):
    return abs(level["occlusion_error"]) <= 0.01


def is_right(light):
    return all(value is not None and abs(value) <= 0.02 for value in light["color_bias"])


def rows(head, body):
    lines = ["| %s |" % " | ".join(head), "|---" * len(head) + "|"]
    return lines + ["| %s |" % " | ".join(row) for row in body] + [""]


def level_table(levels):
    head = ["grid", "triangles", "voxels", "on disk, KiB", "resident, KiB", "coverage", "thesis: willow, vessel, maple", "rms",
            "rms, touched", *(light["light"] for light in levels[0]["lights"])]
    return rows(head, (
        ["%d" % level["grid"], "%d" % level["triangles"], "%d" % level["voxels"], "%.0f" % (level["bytes_disk"] / 1024),
         "%.0f" % (level["bytes_resident"] / 1024), percent(level["occlusion_error"]), occlusion_text(level["grid"]),
         size(level["occlusion_rms"]), size(level["occlusion_rms_touched"]),
         *(bias(light["color_bias"]) for light in level["lights"])] for level in levels))


def simplified_row(method, ours, mesh, lights):
    if mesh is None:
        return ["%d" % ours["grid"], method, "nothing is left", *["-"] * (4 + len(lights))]
    return ["%d" % ours["grid"], method, "%d" % mesh["triangles"], "%.0f" % (mesh["bytes_resident"] / 1024),
            percent(mesh["occlusion_error"]), size(mesh["occlusion_rms_touched"]), size(ours["occlusion_rms_touched"]),
            *(bias(light["color_bias"]) for light in mesh["lights"])]


def simplified_table(levels, simplified):
    lights = list(dict.fromkeys(light["light"] for meshes in simplified.values() for mesh in meshes for light in mesh["lights"]))
    head = ["grid", "mesh", "triangles", "resident, KiB", "coverage", "rms, touched", "ours", *lights]
    body = []
    for ours in levels:
        for method, meshes in simplified.items():
            of_grid = [mesh for mesh in meshes if mesh["grid"] == ours["grid"]]
            body.append(simplified_row(method, ours, of_grid[0] if of_grid else None, lights))
    return rows(head, body)


def section(figures):
    lines = ["## %s%s" % (figures.name, "" if figures.is_tuned else " (untouched)"), "",
             "Bake: %.0f CPU seconds." % figures.cpu_seconds, "", *level_table(figures.levels)]
    if any(figures.simplified.values()):
        lines += ["Meshes of the same bytes:", "", *simplified_table(figures.levels, figures.simplified)]
    return lines


def count_text(levels):
    text = "coverage %d of %d" % (sum(map(is_covered, levels)), len(levels))
    for i, light in enumerate(levels[0]["lights"]):
        text += ", %s %d" % (light["light"], sum(is_right(level["lights"][i]) for level in levels))
    return text


def closer_text(method, all_figures):
    """How often a mesh is closer to the source than our level, by what both miss of its outline."""
    pairs = [(ours["occlusion_rms_touched"], mesh["occlusion_rms_touched"]) for figures in all_figures
             for ours in figures.levels for mesh in figures.simplified.get(method, []) if mesh["grid"] == ours["grid"]]
    known = [(ours or 0, mesh or 0) for ours, mesh in pairs]  # lost in noise: next to nothing
    return "%d closer to the source than our level" % sum(mesh < ours for ours, mesh in known)


def summary(all_figures):
    lines = ["## All in one", "",
             "Levels whose coverage is within 1 %, and whose colour is within 2 % in each channel, per light.", ""]
    for is_tuned, text in ((True, "looked at while tuning"), (False, "untouched")):
        levels = [level for figures in all_figures if figures.is_tuned == is_tuned for level in figures.levels]
        if levels:
            lines.append("* %s: %s" % (text, count_text(levels)))
    for method in ("simplify", "sloppy"):
        levels = [level for figures in all_figures for level in figures.simplified.get(method, [])]
        if levels:
            lines.append("* meshoptimizer's `%s` in the same bytes: %s; %s (rms of touched pixels)"
                         % (method, count_text(levels), closer_text(method, all_figures)))
    return lines + [""]


def page(all_figures, views, left_out, program):
    lines = ["# How alike levels look", "",
             "Made by `scripts/measure_fidelity.py` with %d views, by the program %s. Coverage: occlusion error of the level, %% of"
             " what the source covers" % (views, program),
             "(thesis: of its own assets, figures 10.1 to 10.3); then its rms per pixel, and over touched pixels. Under each light the"
             " mean colour's bias, %, of the channel that is",
             "farthest off (`docs/error_metric.md`); ?: lost in noise. Untouched: not looked at while tuning (decisions 0012, 0013, 0015)."
             " Only levels that save bytes are stored: where rows",
             "are missing a finer one is shown.", "",
             "Meshes of the same bytes (`tests/bench/simplified_levels`): what meshoptimizer's `simplify` and `simplifySloppy` make of"
             " the source in the level's resident bytes, BVH",
             "included; faces have the mean colour around their corners. More bytes than the level's: the simplifier could do no less.",
             ""]
    lines += summary([figures for figures in all_figures if figures.levels])
    lines += ["## Without a row", ""]
    whole = [figures.name for figures in all_figures if not figures.levels and not figures.failure]
    if whole:
        lines.append("* No level is smaller than the source, which is shown at every distance: %s." % ", ".join(whole))
    lines += ["* %s: %s" % (figures.name, figures.failure) for figures in all_figures if figures.failure]
    lines += ["* %s: %s" % reason for reason in left_out] + [""]
    for figures in all_figures:
        if figures.levels:
            lines += section(figures)
    return "\n".join(lines)
