# SPDX-License-Identifier: Apache-2.0
"""What [Loubet 2018] reports of its own assets, which are not ours."""

# Figures 10.1 to 10.3: occlusion error in % at 512^3 ... 16^3 of its willow, vessel and maple.
OCCLUSION = {512: (0.90, 1.3, -2.4), 256: (1.7, 0.94, -1.35), 128: (2.1, 2.8, 0.75), 64: (2.8, 0.63, 2.86),
             32: (4.4, 1.3, 5.11), 16: (8.3, 7.3, 7.97)}


def occlusion_text(grid):
    return ", ".join("%+.2f" % error for error in OCCLUSION[grid]) if grid in OCCLUSION else "-"
