# SPDX-License-Identifier: Apache-2.0
"""Bakes what is selected in a .blend file, as it is evaluated at the current frame, with its image textures.

    blender -b oak.blend --python scripts/bake_from_blender.py -- -o oak.farfield

Needs the Python module `farfield` where Blender's Python finds it (PYTHONPATH, or --module). docs/bake_from_blender.md
says what of materials is read. What is not is warned of, once each.
"""

import argparse
import sys
from pathlib import Path

import bpy
import numpy as np

Y_UP = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], dtype=float)  # as Blender's glTF exporter has it


def warn(text):
    if text not in warn.said:
        warn.said.add(text)
        print(f"bake_from_blender: warning: {text}", file=sys.stderr)


warn.said = set()


def parse_arguments():
    parser = argparse.ArgumentParser(prog="blender -b FILE --python bake_from_blender.py --", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", required=True, help="folder to write, by convention NAME.farfield")
    parser.add_argument("--all", action="store_true", help="bake all visible objects, not only those selected")
    parser.add_argument("--z-up", action="store_true", help="keep Blender's axes; without it +y is up, as in glTF")
    parser.add_argument("--finest-grid", type=int, default=512)
    parser.add_argument("--rays-per-voxel", type=int, default=200)
    parser.add_argument("--memory-limit", type=int, default=0, metavar="MIB")
    parser.add_argument("--module", help="folder that holds the Python package farfield")
    return parser.parse_args(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else [])


def import_farfield(folder):
    if folder:
        sys.path.insert(0, folder)
    try:
        import farfield
    except ImportError as missing:
        sys.exit(f"bake_from_blender: {missing}; install Farfield, or say with --module where its Python package is")
    return farfield


# ---- materials


class MaterialReader:
    """A Principled BSDF and the images that feed it, as farfield.bake takes them."""

    def __init__(self, material):
        self.name = material.name
        self.material = material
        self.out = {"name": material.name}

    def read(self):
        shader = self.find_principled()
        if shader is None:
            color = self.material.diffuse_color
            self.out["base_color"] = tuple(np.clip(color[:3], 0, 1))
            return self.out
        self.shader = shader
        base = self.color("Base Color", "base_color")
        self.surface()
        self.alpha(base)
        self.normal()
        self.emission()
        for name in ("Subsurface", "Sheen", "Clearcoat", "Anisotropic"):
            if self.value(name) > 0:
                self.ignored(name)
        return self.out

    def ignored(self, what, instead=""):
        warn(f"material {self.name}: {what} is not read{instead and '; '}{instead}")

    def find_principled(self):
        nodes = self.material.node_tree.nodes if self.material.use_nodes else []
        output = next((n for n in nodes if n.type == "OUTPUT_MATERIAL" and n.is_active_output), None)
        link = next(iter(output.inputs["Surface"].links), None) if output else None
        if link and link.from_node.type == "BSDF_PRINCIPLED":
            return link.from_node
        if link:
            self.ignored(f"a {link.from_node.bl_label} at the output", "its viewport colour stands alone")
        return None

    def value(self, name):
        return self.shader.inputs[name].default_value

    def source(self, name, socket=None):
        """(image node, the channel of its that is used: None for the colour, 0 to 2, or 3 for alpha) behind an input."""
        socket = socket or self.shader.inputs[name]
        if not socket.links:
            return None
        node, output = socket.links[0].from_node, socket.links[0].from_socket
        channel = None
        if node.type in ("SEPARATE_COLOR", "SEPRGB"):
            channel = list(node.outputs).index(output)
            behind = node.inputs[0].links
            node, output = (behind[0].from_node, behind[0].from_socket) if behind else (node, output)
        if node.type != "TEX_IMAGE" or node.image is None:
            self.ignored(f"the {node.bl_label} at {name}", "the plain value stands alone")
            return None
        if output.name == "Alpha":
            channel = 3
        feeds = node.inputs["Vector"].links
        if feeds and feeds[0].from_socket.name != "UV":
            self.ignored(f"the {feeds[0].from_node.bl_label} before the image {node.image.name}")
        if node.extension == "CLIP":
            self.ignored(f"Clip of the image {node.image.name}", "its border goes on")
        return node, channel

    def pixels(self, image):
        """(height, width, 4), from the upper row: sRGB bytes of colour images, else floats. None if it is missing."""
        if not image.pixels:  # asking for them loads the file
            warn(f"material {self.name}: the image {image.name} ({image.filepath}) cannot be read; it is left out")
            return None
        values = np.empty(len(image.pixels), dtype=np.float32)
        image.pixels.foreach_get(values)
        values = values.reshape(image.size[1], image.size[0], -1)[::-1]
        if image.is_float or image.colorspace_settings.name != "sRGB":
            return np.clip(values, 0, 1)
        return np.round(np.clip(values, 0, 1) * 255).astype(np.uint8)

    def set_texture(self, name, node, pixels):
        self.out[f"{name}_texture"] = pixels
        self.out[f"{name}_wrap"] = "repeat" if node.extension == "REPEAT" else "clamp"

    def channel(self, source):
        """One channel of an image as floats; the mean of all for its colour."""
        node, channel = source
        pixels = self.pixels(node.image)
        if pixels is None:
            return None
        scale = 255 if pixels.dtype == np.uint8 else 1
        plane = pixels[..., :3].mean(axis=-1) if channel is None else pixels[..., channel]
        return plane.astype(np.float32) / scale

    def color(self, name, field):
        """A colour input; returns the image node that feeds it, if one does."""
        source = self.source(name)
        pixels = self.pixels(source[0].image) if source else None
        if pixels is None:
            self.out[field] = tuple(np.clip(self.value(name)[:3], 0, 1))
            return None
        self.out[field] = (1, 1, 1)
        self.set_texture(field, source[0], pixels)
        return source[0]

    def surface(self):
        self.out["specular_f0"] = (min(0.08 * self.value("Specular"), 1),) * 3
        self.out["thin_transmission"] = float(np.clip(self.value("Transmission"), 0, 1))
        planes = {}
        for name in ("Roughness", "Metallic"):
            source = self.source(name)
            plane = self.channel(source) if source else None
            self.out[name.lower()] = 1.0 if plane is not None else float(np.clip(self.value(name), 0, 1))
            if plane is not None:
                planes[name] = (source[0], plane)
        if not planes:
            return
        node, plane = next(iter(planes.values()))
        packed = np.ones(plane.shape + (3,), dtype=np.float32)
        for name, at in (("Roughness", 1), ("Metallic", 2)):
            if name in planes and planes[name][1].shape != plane.shape:
                self.ignored(f"the image at {name}, which has another size than that at Roughness")
                self.out[name.lower()] = float(np.clip(self.value(name), 0, 1))
            elif name in planes:
                packed[..., at] = planes[name][1]
        self.set_texture("roughness", node, packed)

    def alpha(self, base):
        source = self.source("Alpha")
        if source is None:
            self.out["alpha"] = float(np.clip(self.value("Alpha"), 0, 1))
            self.out["alpha_mode"] = "blend" if self.out["alpha"] < 1 else "opaque"
            return
        if base is None or source[0].image != base.image or source[1] != 3:
            plane = self.channel(source)
            if plane is None:
                return
            self.set_texture("alpha", source[0], plane)
        self.out["alpha_mode"] = "blend"
        if self.material.blend_method == "CLIP":
            self.out["alpha_mode"] = "mask"
            self.out["alpha_cutoff"] = self.material.alpha_threshold

    def normal(self):
        links = self.shader.inputs["Normal"].links
        if not links:
            return
        node = links[0].from_node
        if node.type != "NORMAL_MAP" or node.space != "TANGENT":
            self.ignored(f"the {node.bl_label} at Normal")
            return
        source = self.source("Normal Map", node.inputs["Color"])
        pixels = self.pixels(source[0].image) if source else None
        if pixels is not None:
            scale = 255 if pixels.dtype == np.uint8 else 1
            self.set_texture("normal", source[0], pixels[..., :3].astype(np.float32) / scale)
            self.out["normal_scale"] = node.inputs["Strength"].default_value

    def emission(self):
        strength = max(self.value("Emission Strength"), 0)
        if strength == 0 or not (self.shader.inputs["Emission"].links or any(self.value("Emission")[:3])):
            return
        self.color("Emission", "emission")
        self.out["emission"] = tuple(strength * channel for channel in self.out["emission"])


# ---- geometry


def read_mesh(farfield, object_, ids):
    """The evaluated object's polygons; None if it has none."""
    mesh = object_.to_mesh()
    if mesh is None or not mesh.polygons:
        object_.to_mesh_clear()
        return None

    def get(collection, name, columns, kind):
        values = np.empty(len(collection) * columns, dtype=kind)
        collection.foreach_get(name, values)
        return values.reshape(-1, columns) if columns > 1 else values

    mesh.calc_normals_split()
    slots = [slot.material for slot in object_.material_slots] or [None]
    slot_of_face = np.minimum(get(mesh.polygons, "material_index", 1, np.int32), len(slots) - 1)
    uv = None
    layer = next((layer for layer in mesh.uv_layers if layer.active_render), None)
    if layer:
        uv = get(layer.data, "uv", 2, np.float32)
        uv[:, 1] = 1 - uv[:, 1]
    counts = get(mesh.polygons, "loop_total", 1, np.int32)
    one_face = (1, -1)  # rows of corners, as one array of three axes says
    out = farfield.Mesh(
        get(mesh.vertices, "co", 3, np.float32),
        get(mesh.loops, "vertex_index", 1, np.int32),
        counts,
        uv=None if uv is None else uv.reshape(*one_face, 2),
        normals=get(mesh.loops, "normal", 3, np.float32).reshape(*one_face, 3),
        material_ids=np.array([ids(slot) for slot in slots])[slot_of_face],
        name=object_.name,
    )
    object_.to_mesh_clear()
    return out


def collect(farfield, everything, to_output):
    """Meshes, (mesh, matrix) for each place, and materials by id, of what is selected."""
    materials, meshes, index, instances = [], [], {}, []

    def id_of(material):
        if material not in materials:
            materials.append(material)
        return materials.index(material)

    graph = bpy.context.evaluated_depsgraph_get()
    for shown in graph.object_instances:
        object_ = shown.object
        chosen = (shown.parent if shown.is_instance else object_).original
        if not (everything or chosen.select_get()) or not shown.show_self:
            continue
        if object_.type not in ("MESH", "CURVE", "SURFACE", "FONT", "META"):
            if object_.type not in ("EMPTY", "CAMERA", "LIGHT", "ARMATURE"):
                warn(f"{object_.name}: a {object_.type.lower()} is not read")
            continue
        original = object_.original
        slots = tuple(slot.material.name if slot.material else "" for slot in object_.material_slots)
        has_own_shape = original.modifiers or getattr(original.data, "shape_keys", None)
        key = original.name if has_own_shape else (original.data.name, slots)
        if key not in index:
            mesh = read_mesh(farfield, object_, id_of)
            index[key] = None if mesh is None else len(meshes)
            if mesh is not None:
                meshes.append(mesh)
        if index[key] is not None:
            instances.append((index[key], to_output @ np.array(shown.matrix_world)))
    return meshes, instances, [MaterialReader(m.original).read() if m else {} for m in materials]


def main():
    arguments = parse_arguments()
    farfield = import_farfield(arguments.module)
    to_output = np.eye(4) if arguments.z_up else Y_UP
    meshes, instances, materials = collect(farfield, arguments.all, to_output)
    if not meshes:
        sys.exit("bake_from_blender: nothing with faces is selected; select objects and save, or say --all")
    try:
        report = farfield.bake(
            meshes, arguments.output, instances=instances, materials=materials,
            name=Path(bpy.data.filepath).name or "untitled.blend", finest_grid=arguments.finest_grid,
            rays_per_voxel=arguments.rays_per_voxel, memory_limit=arguments.memory_limit << 20)
    except (farfield.Error, ValueError) as failure:
        for warning in getattr(failure, "warnings", []):
            warn(warning)
        sys.exit(f"bake_from_blender: {failure}")
    for warning in report["warnings"]:
        warn(warning)
    levels = ", ".join(str(level["level"]) for level in report["levels"])
    print(f"{arguments.output}: {len(meshes)} meshes in {len(instances)} places, {len(materials)} materials; "
          f"levels {levels}, {report['seconds']:.1f} s{', up to date' if report['up_to_date'] else ''}")


main()
