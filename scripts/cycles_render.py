# SPDX-License-Identifier: Apache-2.0
"""Runs inside Blender (see scripts/compare_with_cycles): renders a glTF scene with Cycles under a given sky, seen by a
given camera, with materials that mean what glTF says.

blender -b --factory-startup --python scripts/cycles_render.py -- JOB.json
JOB: {"scene", "sky", "outputs": [[exr, seed], ...], "width", "height", "spp", "seconds", "added",
      "camera": {"position", "forward", "up", "pixel_spread", "pixel_width"}}, vectors in glTF's axes
"""
import json
import math
import struct
import sys

import bpy
import numpy
from mathutils import Matrix, Vector

numpy.bool = bool  # Debian's numpy is newer than the add-on of Debian's Blender, which still says numpy.bool


def to_blender(v):
    """glTF has y up, Blender z."""
    return Vector((v[0], -v[2], v[1]))


def read_gltf_json(path):
    data = open(path, "rb").read()
    if data[:4] != b"glTF":
        return json.loads(data)
    return json.loads(data[20:20 + struct.unpack_from("<I", data, 12)[0]])


def clear():
    bpy.ops.wm.read_factory_settings(use_empty=True)


def remove_lights_and_cameras():
    for thing in list(bpy.data.objects):
        if thing.type in {"LIGHT", "CAMERA"}:
            bpy.data.objects.remove(thing)


def add_camera(job):
    spec = job["camera"]
    camera = bpy.data.cameras.new("camera")
    thing = bpy.data.objects.new("camera", camera)
    bpy.context.collection.objects.link(thing)
    forward, up = to_blender(spec["forward"]), to_blender(spec["up"])
    right = forward.cross(up)
    thing.matrix_world = Matrix.Translation(to_blender(spec["position"])) @ Matrix(
        (right, up, -forward)).transposed().to_4x4()
    camera.clip_start, camera.clip_end = 1e-3, 1e6
    camera.sensor_fit = "VERTICAL"
    if spec["pixel_spread"] > 0:
        camera.angle_y = 2 * math.atan(0.5 * spec["pixel_spread"] * job["height"])
    else:
        camera.type = "ORTHO"
        camera.ortho_scale = spec["pixel_width"] * job["height"]
    bpy.context.scene.camera = thing


def add_sky(path):
    """Our pictures have -z of glTF in the middle and +x to the right of it; Blender has its own +x in the middle."""
    world = bpy.data.worlds.new("sky")
    bpy.context.scene.world = world
    world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    coordinates = nodes.new("ShaderNodeTexCoord")
    mapping = nodes.new("ShaderNodeMapping")
    mapping.inputs["Rotation"].default_value = (0, 0, -0.5 * math.pi)
    picture = nodes.new("ShaderNodeTexEnvironment")
    picture.image = bpy.data.images.load(path)
    picture.image.colorspace_settings.name = "Linear"
    picture.interpolation = "Closest"
    links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    links.new(mapping.outputs["Vector"], picture.inputs["Vector"])
    links.new(picture.outputs["Color"], nodes["Background"].inputs["Color"])
    world.cycles.sampling_method = "MANUAL"
    world.cycles.sample_map_resolution = 2048


class Shader:
    """Node tree of a material that is built anew around what the importer connected to the Principled node."""

    def __init__(self, material):
        self.tree = material.node_tree
        self.principled = next((n for n in self.tree.nodes if n.type == "BSDF_PRINCIPLED"), None)
        self.output = next(n for n in self.tree.nodes if n.type == "OUTPUT_MATERIAL")

    def connect(self, name, target):
        source = self.principled.inputs[name]
        if source.is_linked:
            self.tree.links.new(source.links[0].from_socket, target)
        elif target.type == "RGBA":
            target.default_value = source.default_value
        elif target.type == "VALUE":
            target.default_value = source.default_value

    def node(self, kind):
        return self.tree.nodes.new(kind)

    def mix(self, factor, a, b):
        """factor: a number, or an output socket. a and b: shader sockets."""
        mixed = self.node("ShaderNodeMixShader")
        if isinstance(factor, float):
            mixed.inputs[0].default_value = factor
        else:
            self.tree.links.new(factor, mixed.inputs[0])
        self.tree.links.new(a, mixed.inputs[1])
        self.tree.links.new(b, mixed.inputs[2])
        return mixed.outputs[0]


    def diffuse(self):
        node = self.node("ShaderNodeBsdfDiffuse")
        self.connect("Base Color", node.inputs["Color"])
        self.connect("Normal", node.inputs["Normal"])
        return node.outputs[0]

    def highlight(self):
        """The Principled node's, over black."""
        for link in list(self.principled.inputs["Base Color"].links):
            self.tree.links.remove(link)
        self.principled.inputs["Base Color"].default_value = (0, 0, 0, 1)
        return self.principled.outputs[0]

    def add(self, a, b):
        added = self.node("ShaderNodeAddShader")
        self.tree.links.new(a, added.inputs[0])
        self.tree.links.new(b, added.inputs[1])
        return added.outputs[0]


def rebuild(material, gltf, added):
    """What glTF says of dielectrics: a Lambertian base, transmission, which Blender 3.4 does not import, alpha. A highlight
    is added to the base, or stays as the importer has it, with the Principled node's own base below it."""
    shader = Shader(material)
    if not shader.principled:
        return
    metallic = shader.principled.inputs["Metallic"]
    if metallic.is_linked or metallic.default_value > 0:
        return  # as the importer has it
    extensions = gltf.get("extensions", {})
    result = shader.principled.outputs[0]
    alpha = shader.principled.inputs["Alpha"]
    alpha_from = alpha.links[0].from_socket if alpha.is_linked else None
    for link in list(alpha.links):
        shader.tree.links.remove(link)
    alpha.default_value = 1
    if extensions.get("KHR_materials_specular", {}).get("specularFactor", 1.0) == 0:
        result = shader.diffuse()
    elif added:
        result = shader.add(shader.diffuse(), shader.highlight())
    through = extensions.get("KHR_materials_diffuse_transmission", {})
    if through.get("diffuseTransmissionFactor", 0) > 0:
        translucent = shader.node("ShaderNodeBsdfTranslucent")
        translucent.inputs["Color"].default_value = [*through.get("diffuseTransmissionColorFactor", [1, 1, 1]), 1]
        result = shader.mix(float(through["diffuseTransmissionFactor"]), result, translucent.outputs[0])
    if alpha_from:
        result = shader.mix(alpha_from, shader.node("ShaderNodeBsdfTransparent").outputs[0], result)
    shader.tree.links.new(result, shader.output.inputs["Surface"])


def rebuild_materials(document, added):
    by_name = {m.get("name", ""): m for m in document.get("materials", [])}
    for material in bpy.data.materials:
        if material.use_nodes:
            rebuild(material, by_name[material.name], added)


def set_up_cycles(job):
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = job["width"], job["height"]
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_mode = "RGBA"
    scene.render.image_settings.color_depth = "32"
    scene.render.film_transparent = True  # what is seen of the scene, without the sky behind it
    scene.render.image_settings.exr_codec = "ZIP"
    scene.render.use_persistent_data = True
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.samples = job["spp"]
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.pixel_filter_type = "BOX"
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = 64
    cycles.transmission_bounces = cycles.transparent_max_bounces = 64
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.blur_glossy = 0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.light_sampling_threshold = 0


def main():
    job = json.load(open(sys.argv[sys.argv.index("--") + 1]))
    clear()
    bpy.ops.import_scene.gltf(filepath=job["scene"])
    remove_lights_and_cameras()
    rebuild_materials(read_gltf_json(job["scene"]), job["added"])
    add_camera(job)
    add_sky(job["sky"])
    set_up_cycles(job)
    scene = bpy.context.scene
    scene.frame_set(0, subframe=0.0)
    frame = job["seconds"] * scene.render.fps / scene.render.fps_base
    scene.frame_set(int(frame), subframe=frame - int(frame))
    for path, seed in job["outputs"]:
        scene.cycles.seed = seed
        scene.render.filepath = path
        bpy.ops.render.render(write_still=True)


main()
