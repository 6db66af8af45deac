# SPDX-License-Identifier: Apache-2.0
"""Runs inside Blender (see scripts/compare_with_cycles): an OBJ as a .glb, smooth where it has normals, with a picture as base
colour where it has no material.

blender -b --factory-startup --python scripts/obj_to_glb.py -- MODEL.obj PICTURE_OR_NOTHING OUT.glb
"""
import sys

import bpy
import numpy

numpy.bool = bool  # as in cycles_render.py

model, picture, out = sys.argv[sys.argv.index("--") + 1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.wm.obj_import(filepath=model)
if picture:
    material = bpy.data.materials.new("textured")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = bpy.data.images.load(picture)
    links.new(texture.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
    for thing in bpy.data.objects:
        thing.data.materials.clear()
        thing.data.materials.append(material)
        thing.data.polygons.foreach_set("use_smooth", [True] * len(thing.data.polygons))
bpy.ops.export_scene.gltf(filepath=out, export_format="GLB")
