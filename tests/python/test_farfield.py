# SPDX-License-Identifier: Apache-2.0
"""The Python package as people use it; run against the installed one (tests/install/check_python.cmake)."""

import ast
import inspect
import json
import os
import signal
import tempfile
import threading
import unittest
from pathlib import Path

import numpy as np

import farfield
from farfield import _farfield

SMALL = {"finest_grid": 16, "coarsest_grid": 8, "rays_per_voxel": 20}


def quad_grid(n):
    """A square of n x n quads in the plane z = 0, from 0 to 1, and the texture coordinates of its points."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1))
    points = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    index = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    quads = np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], axis=-1).reshape(-1, 4)
    return points, quads, np.stack([x, 1 - y], axis=-1).reshape(-1, 2)


class InAFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.out = self.folder / "thing.farfield"
        self.points, self.quads, self.uv = quad_grid(4)

    def level_bytes(self, asset):
        return {file.name: file.read_bytes() for file in sorted(Path(asset).glob("*.ffl"))}

    def front(self, asset, **options):
        """The square, head on, filling a small picture, under white light."""
        options = {"level": 0, "light": (1, 1, 1), "samples": 16} | options
        return farfield.render(asset, width=8, height=8, eye=(0.5, 0.5, 2), target=(0.5, 0.5, 0), fov_y=0.4, **options)


class Bake(InAFolder):
    def test_says_what_it_made(self):
        report = farfield.bake(farfield.Mesh(self.points, self.quads), self.out, **SMALL)
        self.assertEqual(report["levels"][0]["triangles"], 32)
        self.assertFalse(report["up_to_date"])
        self.assertEqual(report["warnings"], [])
        self.assertTrue(farfield.bake(farfield.Mesh(self.points, self.quads), self.out, **SMALL)["up_to_date"])

    def test_simplifies_as_it_is_told(self):
        options = SMALL | {"finest_grid": 32, "coarsest_grid": 16}
        for method in ("loops", "edges"):
            farfield.bake(farfield.Mesh(self.points, self.quads), self.out, simplify=method, **options)
            manifest = (Path(self.out) / "manifest.json").read_text()
            self.assertIn(f"simplify={method}", manifest)
        with self.assertRaisesRegex(ValueError, "simplify is 'quads'"):
            farfield.bake(farfield.Mesh(self.points, self.quads), self.out, simplify="quads", **options)

    def test_makes_cages_smooth(self):
        corners = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], dtype=float)
        faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
        edges = [[0, 1], [1, 3], [3, 2], [2, 0], [4, 5], [5, 7], [7, 6], [6, 4], [0, 4], [1, 5], [2, 6], [3, 7]]

        def triangles(mesh, **options):
            options = {"subdivide": "catmull-clark", "source_only": True} | SMALL | options
            return farfield.bake(mesh, self.out, **options)["levels"][0]["triangles"]

        smooth = triangles(farfield.Mesh(corners, faces))
        self.assertGreater(smooth, 100)
        self.assertLess(triangles(farfield.Mesh(corners, faces), subdivide_error=1), smooth)
        self.assertGreater(triangles(farfield.Mesh(corners, faces), subdivide_edge=0.5), smooth)
        self.assertEqual(triangles(farfield.Mesh(corners, faces, creases=edges)), 12)
        self.assertGreater(triangles(farfield.Mesh(corners, faces, creases=edges, crease_sharpness=np.ones(12))), 100)
        self.assertGreater(triangles(farfield.Mesh(corners, faces, sharp_points=[0, 7], point_sharpness=2)), 100)
        with self.assertRaisesRegex(ValueError, "subdivide is 'catmark'"):
            triangles(farfield.Mesh(corners, faces), subdivide="catmark")
        with self.assertRaisesRegex(ValueError, "crease_sharpness: a number, or 12"):
            triangles(farfield.Mesh(corners, faces, creases=edges, crease_sharpness=[1, 2]))
        with self.assertRaisesRegex(farfield.Error, "crease 0 lies between points 0 and 7"):
            triangles(farfield.Mesh(corners, faces, creases=[[0, 7]]))

    def test_displaces(self):
        uv = [[0, 0], [1, 0], [1, 1], [0, 1]]
        plane = farfield.Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]], uv=uv)
        heights = np.sin(np.linspace(0, 4 * np.pi, 64, dtype=np.float32))[:, np.newaxis] * np.ones((1, 64), np.float32)

        def triangles(**fields):
            with tempfile.TemporaryDirectory() as folder:
                made = farfield.bake(plane, os.path.join(folder, "a.farfield"), materials=[fields], source_only=True, **SMALL)
                return made["levels"][0]["triangles"]

        self.assertEqual(triangles(), 2)
        self.assertEqual(triangles(height_texture=heights, height_gain=0.0, height_base=0.05), 2)
        self.assertGreater(triangles(height_texture=heights, height_gain=0.05), 20)
        heights[3, 5] = np.inf
        with self.assertRaisesRegex(farfield.Error, r"height_texture: pixel \(5, 3\) is not finite"):
            triangles(height_texture=heights)

    def test_a_mesh_may_have_its_own_scheme(self):
        points = [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
        faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
        with tempfile.TemporaryDirectory() as folder:
            made = farfield.bake(farfield.Mesh(points, faces, scheme="catmull-clark"), os.path.join(folder, "a.farfield"),
                                 source_only=True, **SMALL)
            self.assertGreater(made["levels"][0]["triangles"], 100)
        with self.assertRaisesRegex(ValueError, "scheme is 'catmark'"):
            farfield.bake(farfield.Mesh(points, faces, scheme="catmark"), "unused")

    def test_takes_faces_in_every_form(self):
        flat = farfield.Mesh(self.points, self.quads.ravel(), counts=[4] * 16)
        lists = farfield.Mesh(self.points.tolist(), self.quads.tolist())
        mixed = farfield.Mesh(self.points, [self.quads[0].tolist(), self.quads[1].tolist()[:3]])
        small = farfield.Mesh(self.points.astype(np.float32)[:, :], self.quads.astype(np.uint16))
        farfield.bake(farfield.Mesh(self.points, self.quads), self.out, **SMALL)
        for mesh in (flat, lists, small):
            farfield.bake(mesh, self.folder / "other.farfield", **SMALL)
            self.assertEqual(self.level_bytes(self.out), self.level_bytes(self.folder / "other.farfield"))
        self.assertEqual(farfield.bake(mixed, self.out, **SMALL)["levels"][0]["triangles"], 3)

    def test_bakes_what_the_file_bakes_to(self):
        obj = self.folder / "square.obj"
        lines = ["v %.9g %.9g %.9g" % tuple(p) for p in self.points]
        obj.write_text("\n".join(lines + ["f %d %d %d %d" % tuple(f + 1) for f in self.quads]) + "\n")
        farfield.bake_file(obj, self.out, **SMALL)
        farfield.bake(farfield.Mesh(self.points, self.quads), self.folder / "arrays.farfield", **SMALL)
        ours, theirs = self.level_bytes(self.folder / "arrays.farfield"), self.level_bytes(self.out)
        self.assertEqual(ours.keys(), theirs.keys())
        self.assertEqual(ours, theirs)

    def test_puts_instances_in_their_places(self):
        away = np.eye(4)
        away[:3, 3] = (10, 0, 0)
        report = farfield.bake(farfield.Mesh(self.points, self.quads), self.out,
                               instances=[(0, np.eye(4)), (0, away[:3])], **SMALL)
        self.assertEqual(report["levels"][0]["triangles"], 64)
        self.assertGreaterEqual(farfield.info(self.out)["bounds"]["upper"][0], 11)

    def test_refuses_what_does_not_fit(self):
        points, quads, uv = self.points, self.quads, self.uv

        def mesh(points=points, faces=quads, **more):
            return lambda: farfield.bake(farfield.Mesh(points, faces, **more), self.out, **SMALL)

        def baked(**more):
            return lambda: farfield.bake(farfield.Mesh(points, quads), self.out, **SMALL, **more)

        cases = [
            (ValueError, r"points: an array of shape \(n, 3\)", mesh(points=points[:, :2])),
            (ValueError, "faces: an array of integers", mesh(faces=quads + 0.5)),
            (ValueError, r"mesh 0 \(sail\): uv: one row of 2", mesh(uv=points, name="sail")),
            (ValueError, "uv: 3 rows for 25 points and 64 corners", mesh(uv=uv[:3])),
            (farfield.Error, "corner 0 has point -1", mesh(faces=quads - 1)),
            (farfield.Error, "point 3 is not finite", mesh(points=np.where(np.arange(25)[:, None] == 3, np.nan, points))),
            (farfield.Error, "2 material ids for 16 faces", mesh(material_ids=[0, 0])),
            (farfield.Error, "no face", lambda: farfield.bake([], self.out)),
            (ValueError, "there is no mesh 1", baked(instances=[(1, np.eye(4))])),
            (ValueError, "is the matrix transposed", baked(instances=[(0, np.eye(4) + np.eye(4, k=-1))])),
            (ValueError, "a material has no 'colour'; there are: alpha", baked(materials=[{"colour": 1}])),
            (ValueError, "'base_color' cannot be 'red'", baked(materials=[{"base_color": "red"}])),
            (ValueError, "'alpha_mode' cannot be 'cutout'", baked(materials=[{"alpha_mode": "cutout"}])),
            (farfield.Error, "roughness is 2, not in", baked(materials=[{"roughness": 2}])),
            (farfield.Error, "nowhere.png", baked(materials=[{"base_color_texture": "/nowhere.png"}])),
            (ValueError, "put the dictionary into a list", baked(materials={"base_color": (1, 0, 0)})),
            (ValueError, "finest_grid is -1", lambda: farfield.bake([], self.out, finest_grid=-1)),
        ]
        for kind, message, call in cases:
            with self.subTest(message), self.assertRaisesRegex(kind, message):
                call()
        self.assertFalse(self.out.exists())

    def test_asks_whose_rows_they_are_where_both_could_be(self):
        points, faces = [(0, 0, 0), (1, 0, 0), (0, 1, 0)], np.array([[2, 1, 0]])
        uv = np.array([(0, 0), (1, 0), (0, 1)])
        with self.assertRaisesRegex(ValueError, r"uv\[faces\]"):
            farfield.bake(farfield.Mesh(points, faces, uv=uv), self.out, **SMALL)
        farfield.bake(farfield.Mesh(points, faces, uv=uv[faces]), self.out, **SMALL)

    def test_errors_have_a_kind(self):
        with self.assertRaises(farfield.Error) as caught:
            farfield.info(self.folder / "none.farfield")
        self.assertEqual(caught.exception.code, "not found")
        self.assertEqual(caught.exception.warnings, [])

    def test_errors_have_the_warnings_that_came_before(self):
        source = self.folder / "flat.obj"
        source.write_text("mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n")
        with self.assertRaisesRegex(farfield.Error, "no face has any area") as caught:
            farfield.bake_file(source, self.out)
        self.assertEqual(caught.exception.warnings[0], "material library gone.mtl cannot be read")

    def test_tells_progress_and_ends_when_that_raises(self):
        seen = []
        farfield.bake(farfield.Mesh(self.points, self.quads), self.out, progress=lambda *at: seen.append(at), **SMALL)
        self.assertEqual(seen[-1], (1.0, "done"))

        def stop(done, stage):
            raise KeyError(stage)

        with self.assertRaisesRegex(KeyError, "import"):
            farfield.bake(farfield.Mesh(self.points, self.quads), self.folder / "none.farfield", progress=stop, **SMALL)
        self.assertFalse((self.folder / "none.farfield").exists())

    def test_hears_ctrl_c(self):
        timer = threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT))
        points, quads, _ = quad_grid(30)
        crumpled = points + 0.3 * np.random.default_rng(1).random(points.shape)
        timer.start()
        with self.assertRaises(KeyboardInterrupt):
            farfield.bake(farfield.Mesh(crumpled, quads), self.out, finest_grid=1024, rays_per_voxel=5000)
        timer.join()
        self.assertFalse(self.out.exists())

    def test_keeps_to_its_memory(self):
        points, quads, _ = quad_grid(30)
        crumpled = points + 0.3 * np.random.default_rng(1).random(points.shape)
        with self.assertRaises(farfield.Error) as caught:
            farfield.bake(farfield.Mesh(crumpled, quads), self.out, finest_grid=1024, memory_limit=1)
        self.assertEqual(caught.exception.code, "out of budget")


class Materials(InAFolder):
    def square(self, **more):
        return farfield.Mesh(self.points, self.quads, uv=self.uv, **more)

    def test_colours_come_through(self):
        # A diffuse square under the same light from everywhere is as bright as its albedo, up to its own grey sides.
        farfield.bake(self.square(), self.out, materials=np.array([[0.5, 0.25, 0.125]]), **SMALL)
        picture = self.front(self.out)
        self.assertEqual(picture.shape, (8, 8, 3))
        self.assertEqual(picture.dtype, np.float32)
        np.testing.assert_allclose(picture.mean((0, 1)), [0.5, 0.25, 0.125], rtol=0.05)

    def test_each_face_has_its_material(self):
        ids = np.repeat([0, 1], 8)  # rows of quads go up
        farfield.bake(self.square(material_ids=ids), self.out,
                      materials=[{"base_color": (1, 0, 0)}, {"base_color": (0, 0, 1)}], **SMALL)
        picture = self.front(self.out)
        self.assertGreater(picture[6, 4, 0], 10 * picture[6, 4, 2])
        self.assertGreater(picture[1, 4, 2], 10 * picture[1, 4, 0])

    def test_pictures_have_their_first_row_at_the_top(self):
        image = np.zeros((2, 2, 3), dtype=np.uint8)
        image[0] = (255, 0, 0)
        image[1] = (0, 0, 188)  # sRGB of 0.5
        farfield.bake(self.square(), self.out, materials=[
            {"base_color": (1, 1, 1), "base_color_texture": image, "base_color_wrap": "clamp"}], **SMALL)
        picture = self.front(self.out)
        np.testing.assert_allclose(picture[0].mean(0), [1, 0, 0], atol=0.03)
        np.testing.assert_allclose(picture[7].mean(0), [0, 0, 0.5], atol=0.03)

    def test_masks_cut(self):
        mask = np.zeros((2, 2), dtype=np.float32)
        mask[:, 0] = 1
        farfield.bake(self.square(), self.out, materials=[
            {"base_color": (1, 1, 1), "alpha_mode": "mask", "alpha_texture": mask, "alpha_wrap": "clamp"}], **SMALL)
        alpha = self.front(self.out, transparent=True, channels=["A"])[..., 0]
        np.testing.assert_allclose(alpha[:, :3], 1, atol=0.01)
        np.testing.assert_allclose(alpha[:, 5:], 0, atol=0.01)

    def test_a_function_is_asked(self):
        asked = []

        def look(query):
            asked.append(query.material)
            return {"diffuse": (0.5, 0, 0) if query.uv[1] < 0.5 else (0, 0, 0.5)}

        farfield.bake(self.square(material_ids=np.full(16, 7)), self.out, materials=look, **SMALL)
        self.assertEqual(set(asked), {7})
        picture = self.front(farfield.open(self.out, materials=look), samples=4)
        np.testing.assert_allclose(picture[0].mean(0), [0.5, 0, 0], atol=0.03)
        np.testing.assert_allclose(picture[7].mean(0), [0, 0, 0.5], atol=0.03)

    def test_a_function_that_says_what_a_description_says_looks_the_same_from_afar(self):
        points, quads, _ = quad_grid(40)
        mesh = farfield.Mesh(points + 0.05 * np.random.default_rng(1).random(points.shape), quads)
        other = self.folder / "other.farfield"
        farfield.bake(mesh, self.out, materials=[{"base_color": (0.5, 0.25, 0.125)}], **SMALL)
        report = farfield.bake(mesh, other, materials=lambda query: {"diffuse": (0.5, 0.25, 0.125)}, **SMALL)
        root = report["levels"][-1]["level"]
        self.assertGreater(root, 0)
        described, asked = (self.front(asset, level=root, samples=1024) for asset in (self.out, other))
        np.testing.assert_allclose(asked.mean((0, 1)), described.mean((0, 1)), rtol=0.01)

    def test_a_batched_function_bakes_what_it_bakes_one_by_one(self):
        def stripe(query):
            return {"diffuse": (0.5, 0.25, 0.125) if query.uv[0] < 0.3 else (0.25, 0.5, 1), "roughness": 0.5}

        asked = []

        @farfield.batched
        def stripes(at):
            asked.append(len(at))
            return {"diffuse": np.where(at.uv[:, :1] < np.float32(0.3), (0.5, 0.25, 0.125), (0.25, 0.5, 1)), "roughness": 0.5}

        other = self.folder / "other.farfield"
        farfield.bake(self.square(), self.out, materials=stripe, **SMALL)
        farfield.bake(self.square(), other, materials=stripes, **SMALL)
        self.assertGreater(max(asked), 100)
        for level in self.out.glob("*.ffl"):
            self.assertEqual(level.read_bytes(), (other / level.name).read_bytes(), level.name)
        one, many = (self.front(farfield.open(self.out, materials=look), samples=4) for look in (stripe, stripes))
        np.testing.assert_array_equal(one, many)

        for message, answer in (("a material sample has no 'color'", {"color": 1}), ("not None", None),
                                ("'diffuse' of .* places cannot have the shape", {"diffuse": np.zeros((2, 5))})):
            with self.assertRaisesRegex(ValueError, message):
                farfield.bake(self.square(), self.out, materials=farfield.batched(lambda at: answer), **SMALL)

    def test_what_a_function_raises_comes_out(self):
        def broken(query):
            raise ZeroDivisionError("no look")

        with self.assertRaisesRegex(ZeroDivisionError, "no look"):
            farfield.bake(self.square(), self.out, materials=broken, **SMALL)
        with self.assertRaisesRegex(ValueError, "a material sample has no 'color'"):
            farfield.bake(self.square(), self.out, materials=lambda query: {"color": 1}, **SMALL)
        with self.assertRaisesRegex(ValueError, "returns a dictionary, not None"):
            farfield.bake(self.square(), self.out, materials=lambda query: None, **SMALL)


class Look(InAFolder):
    def setUp(self):
        super().setUp()
        farfield.bake(farfield.Mesh(self.points, self.quads), self.out, **SMALL)

    def test_info_and_open(self):
        asset = farfield.open(self.out)
        self.assertEqual(asset.levels, farfield.info(asset)["levels"])
        self.assertEqual(asset.levels[0]["level"], 0)

    def test_evaluate(self):
        points, quads, _ = quad_grid(40)  # fine enough that coarser levels save something
        farfield.bake(farfield.Mesh(points, quads), self.out, **SMALL)
        figures = farfield.open(self.out).evaluate(views=2, samples=16, lights=["daylight", "behind"])
        self.assertGreater(len(figures["levels"]), 0)
        self.assertEqual([level["level"] for level in figures["levels"]],
                         [level["level"] for level in farfield.info(self.out)["levels"][1:]])
        for level in figures["levels"]:
            self.assertLess(abs(level["occlusion_error"]), 0.2)
            self.assertEqual([light["light"] for light in level["lights"]], ["daylight", "behind"])
        with self.assertRaises(farfield.Error):
            farfield.open(self.out).evaluate(lights=["moon"])
        self.assertIn("color_error", farfield.info(self.out)["levels"][1])

    def test_the_same_picture_each_time(self):
        first, second = (farfield.render(self.out, width=16, height=9) for _ in range(2))
        np.testing.assert_array_equal(first, second)
        self.assertGreater(first.max(), 0)

    def test_channels(self):
        picture = self.front(self.out, channels=["A", "lod.level", "Z"])
        self.assertEqual(picture.shape, (8, 8, 3))
        np.testing.assert_allclose(picture[4, 4], [1, 0, 2], atol=1e-3)
        with self.assertRaisesRegex(ValueError, "no channel 'B2'; there are: R, G"):
            self.front(self.out, channels=["B2"])

    def test_instances_are_where_they_are_put(self):
        away = np.eye(4)
        away[:3, 3] = (0.5, 0, 0)
        alpha = self.front([(self.out, away)], transparent=True, channels=["A"])[..., 0]
        np.testing.assert_allclose(alpha[:, :3], 0, atol=0.01)
        np.testing.assert_allclose(alpha[:, 5:], 1, atol=0.01)

    def test_a_scene_says_what_stands_where_with_its_data(self):
        points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
        places = np.array([[0, 0, 0], [5, 0, 0]], np.float32)
        ids, tints = np.array([3, 4], np.uint32), np.array([[1, 0, 0], [0, 1, 0]], np.float32)
        parts = [points, places, ids, tints]
        (self.folder / "scene.bin").write_bytes(b"".join(part.tobytes() for part in parts))
        offsets = np.cumsum([0] + [part.nbytes for part in parts])
        kinds = ["VEC3", "VEC3", "SCALAR", "VEC3"]
        scene = {
            "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "scene": 0,
            "nodes": [{"name": "grass", "mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {
                "attributes": {"TRANSLATION": 1, "_ID": 2, "_TINT": 3}}}}],
            "meshes": [{"name": "blade", "primitives": [{"attributes": {"POSITION": 0}}]}],
            "buffers": [{"uri": "scene.bin", "byteLength": int(offsets[-1])}],
            "bufferViews": [{"buffer": 0, "byteOffset": int(offsets[i]), "byteLength": part.nbytes}
                            for i, part in enumerate(parts)],
            "accessors": [{"bufferView": i, "componentType": 5125 if kinds[i] == "SCALAR" else 5126, "count": len(part),
                           "type": kinds[i]} for i, part in enumerate(parts)],
        }
        (self.folder / "scene.gltf").write_text(json.dumps(scene))
        seen = farfield.read_scene(self.folder / "scene.gltf")
        self.assertEqual([asset["folder"] for asset in seen["assets"]], ["blade.farfield"])
        np.testing.assert_array_equal(seen["instances"]["id"], ids)
        np.testing.assert_array_equal(seen["instances"]["tint"], tints)
        np.testing.assert_array_equal(seen["instances"]["to_world"][:, :, 3], places)
        self.assertEqual(seen["instances"]["name"], ["grass", "grass"])
        with self.assertRaises(farfield.Error):
            farfield.read_scene(self.folder / "scene.gltf", assemblies="all")

    def test_refuses_what_it_cannot_show(self):
        for message, call in [
            ("nothing to render", lambda: farfield.render([])),
            ("pictures of 0 x", lambda: farfield.render(self.out, width=0)),
            ("fov_y", lambda: farfield.render(self.out, fov_y=4)),
            ("light: None", lambda: farfield.render(self.out, light=np.zeros((2, 2)))),
        ]:
            with self.subTest(message), self.assertRaisesRegex(ValueError, message):
                call()


class BakeVolume(InAFolder):
    def setUp(self):
        super().setUp()
        z, y, x = np.mgrid[0:10, 0:12, 0:14]
        self.density = np.where((x - 6) ** 2 + (y - 5) ** 2 + (z - 5) ** 2 < 17, 1.0, 0.0)
        self.density[5, 5, 13] = 2  # a voxel far along x

    def test_says_what_it_made(self):
        report = farfield.bake_volume(self.density, self.out, voxel_size=0.5, albedo=0.9)
        finest = report["levels"][0]
        self.assertEqual(finest["voxels"], np.count_nonzero(self.density))
        self.assertEqual(finest["resolution"], 0.5)
        self.assertEqual(finest["grid"], 12)  # x from 2 to 13
        self.assertEqual(report["warnings"], [])
        self.assertTrue(farfield.bake_volume(self.density, self.out, voxel_size=0.5, albedo=0.9)["up_to_date"])
        self.assertIn("no albedo", farfield.bake_volume(self.density, self.out)["warnings"][0])

    def test_lies_where_it_is_put(self):
        place = np.eye(4)
        place[:3, 3] = (100, 200, 300)
        farfield.bake_volume(self.density, self.out, voxel_size=0.5, to_asset=place, albedo=1)
        origin = json.loads((self.out / "manifest.json").read_text())["origin"]
        self.assertEqual(origin, [101, 200.5, 300.5])  # of the first voxel that has a density: (2, 1, 1)

    def test_is_seen(self):
        farfield.bake_volume(self.density, self.out, density_scale=100, albedo=(0.9, 0.1, 0.1))
        picture = farfield.render(self.out, width=8, height=8, eye=(6.5, 5.5, 40), target=(6.5, 5.5, 5), fov_y=0.1,
                                  level=0, light=(1, 1, 1), samples=16)
        red, green, blue = picture[4, 4]
        self.assertGreater(red, 3 * green)
        self.assertAlmostEqual(float(green), float(blue), delta=0.1)

    def test_albedos_may_vary(self):
        albedo = np.full((*self.density.shape, 3), 0.5)
        farfield.bake_volume(self.density, self.out, albedo=albedo)
        farfield.bake_volume(self.density, self.folder / "same.farfield", albedo=(0.5, 0.5, 0.5))
        self.assertEqual(farfield.info(self.out)["levels"][0]["voxels"],
                         farfield.info(self.folder / "same.farfield")["levels"][0]["voxels"])

    def test_fibres_stop_across_themselves(self):
        along_z = np.zeros((*self.density.shape, 3))
        along_z[..., 2] = 1
        g = np.full(self.density.shape, 0.25)
        cube = np.ones((10, 10, 10))
        shown = []
        for axis in (0, 2):
            fibre = np.zeros((*cube.shape, 3))
            fibre[..., axis] = 1
            farfield.bake_volume(cube, self.folder / f"along{axis}", albedo=0.9, density_scale=0.05, fibre=fibre,
                                 fibre_roughness=0.05)
            picture = farfield.render(self.folder / f"along{axis}", width=8, height=8, eye=(5, 5, 100),
                                      target=(5, 5, 5), fov_y=0.02, level=0, samples=64, channels=("A",))
            shown.append(float(picture.mean()))
        self.assertLess(shown[1], 0.1)  # along the fibres
        self.assertAlmostEqual(shown[0], 1 - np.exp(-0.5), delta=0.05)
        report = farfield.bake_volume(self.density, self.out, albedo=0.9, fibre=along_z, anisotropy=g)
        self.assertEqual(report["warnings"], [])
        identity = np.zeros((*self.density.shape, 6))
        identity[..., :3] = 1
        report = farfield.bake_volume(self.density, self.out, albedo=0.9, sggx=identity, self_shadowing=np.ones_like(g))
        self.assertEqual(report["warnings"], [])

    def test_methods_differ(self):
        z, y, x = np.mgrid[0:32, 0:32, 0:32]
        cloud = np.clip(1 + np.sin(0.9 * x + y) + np.sin(1.1 * y - z) + np.sin(0.8 * z + x), 0, None)
        for method in ("linear", "matched"):
            report = farfield.bake_volume(cloud, self.folder / method, albedo=0.9, downsampling=method)
            self.assertGreater(len(report["levels"]), 1)
        differ = self.level_bytes(self.folder / "linear") != self.level_bytes(self.folder / "matched")
        self.assertTrue(differ)

    def test_refuses_what_does_not_fit(self):
        bake = farfield.bake_volume
        for message, call in [
            ("density: an array of shape", lambda: bake(self.density[0], self.out)),
            ("albedo: an array of shape", lambda: bake(self.density, self.out, albedo=np.zeros((1, 2, 3, 3)))),
            ("albedo: a number or three", lambda: bake(self.density, self.out, albedo=(0.1, 0.2))),
            ("downsampling is", lambda: bake(self.density, self.out, downsampling="best")),
            ("fibre: an array of shape", lambda: bake(self.density, self.out, fibre=np.zeros((*self.density.shape, 2)))),
            ("sggx: an array of shape", lambda: bake(self.density, self.out, sggx=np.zeros(6))),
            ("anisotropy: an array of shape", lambda: bake(self.density, self.out, anisotropy=(0.1, 0.2))),
        ]:
            with self.subTest(message), self.assertRaisesRegex(ValueError, message):
                call()
        for message, call in [
            ("voxel \\(13, 5, 5\\) is -2", lambda: bake(-self.density * (self.density > 1), self.out)),
            ("singular", lambda: bake(self.density, self.out, to_asset=np.diag([1, 0, 1, 1]))),
            ("nothing to see", lambda: bake(np.zeros((2, 2, 2)), self.out)),
        ]:
            with self.subTest(message), self.assertRaisesRegex(farfield.Error, message):
                call()


class Package(unittest.TestCase):
    def test_stubs_say_what_there_is(self):
        folder = Path(farfield.__file__).parent
        self.assertTrue((folder / "py.typed").exists())
        stub = ast.parse((folder / "_farfield.pyi").read_text())
        named = {node.name for node in stub.body if isinstance(node, (ast.FunctionDef, ast.ClassDef))}
        self.assertEqual(named, {name for name in vars(_farfield) if name[0] != "_" and name != "version"})
        query = next(node for node in stub.body if isinstance(node, ast.ClassDef))
        self.assertEqual({node.name for node in query.body if isinstance(node, ast.FunctionDef)},
                         {name for name in vars(_farfield.MaterialQuery) if name[0] != "_"})

    def test_the_page_shows_the_example_that_is_run(self):
        repository = Path(__file__).parents[2]
        example = (repository / "samples/bake_from_numpy/bake_from_numpy.py").read_text().partition("\n")[2]
        self.assertIn(f"```python\n{example}```\n", (repository / "docs/bake_api.md").read_text())

    def test_everything_is_documented(self):
        for name in farfield.__all__:
            self.assertTrue(inspect.getdoc(getattr(farfield, name)), name)


if __name__ == "__main__":
    unittest.main()
