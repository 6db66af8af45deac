# SPDX-License-Identifier: Apache-2.0
"""blender -b --factory-startup --python make_scene.py -- FOLDER: writes FOLDER/scene.blend and FOLDER/scene.glb.

Two selected squares side by side under an orthographic camera, one red, one with an image that is packed into the file;
a third that is not selected. The glb has what is selected, and the camera.
"""

import sys
from pathlib import Path

import bpy

folder = Path(sys.argv[sys.argv.index("--") + 1])


def red():
    material = bpy.data.materials.new("red")
    material.use_nodes = True
    material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.8, 0.1, 0.1, 1)
    return material


def painted():
    material = bpy.data.materials.new("painted")
    material.use_nodes = True
    image = bpy.data.images.new("stripes", 16, 16)
    image.pixels = [value for i in range(256) for value in ((0, 1, 0, 1) if i % 4 < 2 else (0, 0, 1, 1))]
    image.pack()
    texture = material.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    shader = material.node_tree.nodes["Principled BSDF"]
    material.node_tree.links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    return material


def add_square(name, x, y, material):
    bpy.ops.mesh.primitive_plane_add(size=2, location=(x, y, 0))
    square = bpy.context.object
    square.name = square.data.name = name
    square.data.materials.append(material)
    return square


bpy.ops.object.select_all(action="SELECT")
bpy.ops.object.delete()
chosen = [add_square("Left", -1, 0, red()), add_square("Right", 1, 0, painted())]
add_square("Elsewhere", 0, 9, None)
bpy.ops.object.camera_add(location=(0, 0, 5))
camera = bpy.context.object
camera.data.type = "ORTHO"
camera.data.ortho_scale = 4
bpy.context.scene.camera = camera
for thing in bpy.data.objects:
    thing.select_set(thing in chosen)
bpy.ops.wm.save_as_mainfile(filepath=str(folder / "scene.blend"))
camera.select_set(True)
bpy.ops.export_scene.gltf(filepath=str(folder / "scene.glb"), use_selection=True, export_cameras=True)
