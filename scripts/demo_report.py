#!/usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Says what a budget saved against full detail: a line per frame, and a page with both pictures side by side.

    scripts/demo_report.py SHOT_FOLDER FULL_DETAIL_FOLDER PAGE.html

Both folders as `farfield shot` leaves them, of the same frames. The page shows their pictures where they lie.
"""
import argparse
import html
import json
import os
from pathlib import Path

STYLE = """body { font: 15px/1.5 sans-serif; max-width: 1100px; margin: 2em auto; padding: 0 1em }
table { border-collapse: collapse } td, th { padding: .2em .8em; text-align: right } img { width: 100% }
.pair { display: grid; grid-template-columns: 1fr 1fr; gap: .5em; margin: 1em 0 } figure { margin: 0 }"""


def mib(count):
    return "%.1f MiB" % (count / 2**20)


def rows(levels, full):
    """Per frame: its number and what both took after it."""
    of_full = {frame["frame"]: frame for frame in full["frames"]}
    return [(frame["frame"], frame["accounted_bytes"], of_full[frame["frame"]]["accounted_bytes"]) for frame in levels["frames"]]


def page(levels, full, folders, target):
    def picture(folder, number, caption):
        path = os.path.relpath(folder / ("frame_%04d.png" % number), target.parent)
        return '<figure><img src="%s" alt="%s"><figcaption>%s</figcaption></figure>' % (html.escape(path), caption, caption)

    table = "".join("<tr><td>%d<td>%s<td>%s<td>%.0f</tr>" % (n, mib(a), mib(b), b / a) for n, a, b in rows(levels, full))
    pairs = "".join('<div class="pair">%s%s</div>' % (picture(folders[0], n, "frame %d, %s" % (n, mib(a))),
                                                   picture(folders[1], n, "full detail, " + mib(b)))
                    for n, a, b in rows(levels, full))
    return """<!doctype html><html lang="en"><meta charset="utf-8"><title>Farfield: inside a budget</title><style>%s</style>
<h1>A forest that does not fit</h1>
<p>Budget: %s. Taken at the most: %s. The same pictures at full detail take %s: %.0f times the budget.</p>
<table><tr><th>frame<th>taken with levels<th>at full detail<th>ratio</tr>%s</table>
%s</html>
""" % (STYLE, mib(levels["budget_bytes"]), mib(levels["peak_accounted_bytes"]), mib(full["peak_accounted_bytes"]),
       full["peak_accounted_bytes"] / levels["budget_bytes"], table, pairs)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("shot", type=Path)
    parser.add_argument("full_detail", type=Path)
    parser.add_argument("page", type=Path)
    arguments = parser.parse_args()
    levels, full = (json.loads((folder / "shot.json").read_text()) for folder in (arguments.shot, arguments.full_detail))
    for number, with_levels, at_full_detail in rows(levels, full):
        print("frame %4d: %10s with levels, %10s at full detail" % (number, mib(with_levels), mib(at_full_detail)))
    print("budget %s, at the most %s taken; full detail takes %.0f times the budget" % (
        mib(levels["budget_bytes"]), mib(levels["peak_accounted_bytes"]), full["peak_accounted_bytes"] / levels["budget_bytes"]))
    arguments.page.write_text(page(levels, full, (arguments.shot, arguments.full_detail), arguments.page))


if __name__ == "__main__":
    main()
