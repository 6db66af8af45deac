# SPDX-License-Identifier: Apache-2.0
"""blender -b --factory-startup --python pick_mattes.py -- PICTURE.exr LAYER NAME...: the mattes that the Cryptomatte node
of Blender's compositor picks by name, one line each: "NAME left 1.000 right 0.000", the means over halves of the picture.
"""

import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np

picture, layer, *names = sys.argv[sys.argv.index("--") + 1:]
image = bpy.data.images.load(picture)
scene = bpy.context.scene
scene.render.resolution_x, scene.render.resolution_y = image.size
scene.render.resolution_percentage = 100
scene.render.image_settings.file_format = "OPEN_EXR"
scene.render.image_settings.color_mode = "RGB"
scene.use_nodes = True
tree = scene.node_tree
tree.nodes.clear()
picker = tree.nodes.new("CompositorNodeCryptomatteV2")
picker.source = "IMAGE"
picker.image = image
picker.layer_name = layer
out = tree.nodes.new("CompositorNodeComposite")
tree.links.new(picker.outputs["Matte"], out.inputs["Image"])


def matte_of(name, folder):
    picker.matte_id = name
    scene.render.filepath = str(Path(folder) / "matte.exr")
    bpy.ops.render.render(write_still=True)
    matte = bpy.data.images.load(scene.render.filepath)
    pixels = np.array(matte.pixels[:]).reshape(matte.size[1], matte.size[0], 4)[:, :, 0]
    bpy.data.images.remove(matte)
    return pixels


with tempfile.TemporaryDirectory() as folder:
    for name in names:
        left, right = np.array_split(matte_of(name, folder), 2, axis=1)
        print(f"{name} left {left.mean():.3f} right {right.mean():.3f}")
