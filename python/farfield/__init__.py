# SPDX-License-Identifier: Apache-2.0
"""Farfield: levels of detail for path tracers. Bake meshes to assets, look at assets, render them.

    import farfield
    mesh = farfield.Mesh(points, faces)                       # numpy arrays
    farfield.bake(mesh, "oak.farfield", materials=[{"base_color": (0.4, 0.3, 0.2)}])
    picture = farfield.render("oak.farfield", width=640, height=360)    # (360, 640, 3), linear, float32

Colours are linear RGB. Texture coordinates have v pointing down the image: (0, 0) is the first pixel of its first row.
Transforms are for column vectors: the translation is the last column. What fails raises farfield.Error or, where an
array does not fit, ValueError. docs/bake_api.md tells more.
"""

from __future__ import annotations

import json
import os
import warnings as _warnings
from dataclasses import dataclass
from typing import Any, Callable, Iterable, Mapping, Sequence, Union

import numpy as np
import numpy.typing as npt

from . import _arrays, _farfield
from ._arrays import MaterialQueries
from ._errors import Error
from ._farfield import MaterialQuery

__all__ = ["Asset", "Error", "MaterialQueries", "MaterialQuery", "Mesh", "bake", "bake_file", "bake_volume", "batched", "evaluate", "info",
           "open", "read_scene", "render"]
__version__: str = _farfield.version

Path = Union[str, "os.PathLike[str]"]
Progress = Callable[[float, str], Any]
MaterialFunction = Callable[[MaterialQuery], Mapping[str, Any]]


def batched(function: Callable[[MaterialQueries], Mapping[str, Any]]) -> Any:
    """Marks a material function that is asked for many places at once: it gets MaterialQueries, arrays with a row per
    place, and returns a dictionary of arrays (n, 3) or (n,), or of what holds for all. Bakes ask a function millions of
    times; this way they ask it thousands of places per call.

        @farfield.batched
        def stripes(at):
            return {"diffuse": np.where(at.uv[:, :1] % 0.1 < 0.05, (0.8, 0.1, 0.1), (0.8, 0.8, 0.8))}
    """

    def ask(queries: MaterialQueries) -> Mapping[str, Any]:
        return function(queries)

    ask.batched = True  # type: ignore[attr-defined]
    return ask


@dataclass
class Mesh:
    """Polygons.

    points: (n, 3). faces: (m, k) integers, or a list of faces of any lengths, or flat with `counts`, the number of
    corners of each face. uv (.., 2), normals (.., 3; of length 0: the face's own) and colors (.., 3 or 4; linear) have
    a row per point or per corner; of shape (m, k, ..) they are per corner. material_ids: one per face; without them 0.

    Of a cage, which is baked with subdivide=...: creases (n, 2) are pairs of points whose edge stays sharp, sharp_points
    (n,) points; their sharpness is a number or one each: 0 is smooth, 10 and more is sharp for ever. scheme:
    "catmull-clark", "loop" or "none" for this mesh, whatever bake(subdivide=...) says of the others.
    """

    points: npt.ArrayLike
    faces: Any
    counts: npt.ArrayLike | None = None
    uv: npt.ArrayLike | None = None
    normals: npt.ArrayLike | None = None
    colors: npt.ArrayLike | None = None
    material_ids: npt.ArrayLike | None = None
    name: str = ""
    creases: npt.ArrayLike | None = None
    crease_sharpness: npt.ArrayLike | float = float("inf")
    sharp_points: npt.ArrayLike | None = None
    point_sharpness: npt.ArrayLike | float = float("inf")
    scheme: str | None = None

    def _arrays(self) -> dict[str, Any]:
        points = _arrays.rows(self.points, 3, "points")
        corners, counts = _arrays.faces(self.faces, self.counts)
        ids = None if self.material_ids is None else _arrays.integers(self.material_ids, "material_ids").ravel()

        def attribute(name: str, columns: int) -> tuple[npt.NDArray[Any], bool] | None:
            return _arrays.attribute(getattr(self, name), columns, len(points), corners, name)

        return {
            "name": self.name,
            "points": points,
            "corners": corners,
            "counts": counts,
            "material_ids": ids,
            "uv": attribute("uv", 2),
            "normals": attribute("normals", 3),
            "colors": attribute("colors", 4),
            "scheme": None if self.scheme is None else _number("scheme", self.scheme, _SCHEMES),
            **_arrays.creases(self.creases, self.crease_sharpness, self.sharp_points, self.point_sharpness),
        }


def bake(
    meshes: Mesh | Iterable[Mesh],
    out: Path,
    *,
    instances: Sequence[tuple[int, npt.ArrayLike]] | None = None,
    materials: MaterialFunction | Sequence[Mapping[str, Any]] | npt.NDArray[Any] | None = None,
    material_key: str = "",
    name: str = "memory",
    finest_grid: int = 512,
    coarsest_grid: int = 8,
    rays_per_voxel: int = 200,
    source_only: bool = False,
    subdivide: str = "none",
    subdivide_error: float = 0.125,
    subdivide_edge: float = 0,
    subdivide_boundary: str = "edge-and-corner",
    subdivide_uv: str = "corners-plus1",
    displace_detail: float = 1,
    simplify: str = "auto",
    threads: int = 0,
    memory_limit: int = 0,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Bakes meshes into the folder `out` (by convention NAME.farfield) and returns what was made: its levels (dicts with
    level, grid, resolution, triangles, voxels, bytes_disk, bytes_resident), warnings, seconds, up_to_date.

    instances: (index of a mesh, 4 x 4 or 3 x 4 matrix) for every place of a mesh; without them each is there once.
    materials: by material id, dictionaries with any of base_color, alpha, alpha_mode ("opaque", "mask", "blend"),
    alpha_cutoff, metallic, roughness, specular_f0, diffuse_transmission, diffuse_transmission_color,
    thin_transmission, emission, normal_scale, height_gain, height_base, name, and base_color_texture, roughness_texture (G roughness, B
    metallic), alpha_texture, normal_texture, emission_texture, height_texture: file names or arrays (height, width, 3 or 4; of
    one channel (height, width)), uint8 (colours: sRGB) or linear floats, each with base_color_wrap and so on: "repeat", "clamp", "mirror". Or an (n, 3)
    array of base colours. Or a function of a MaterialQuery that returns a dictionary with any of diffuse, specular,
    roughness, transmission, opacity, normal, emission: called from several threads in turn, some 15 microseconds each,
    dozens of times per face (see `batched`); the same query must get the same answer. material_key stands for its answers: without one, every call bakes anew.

    height_texture displaces: the surface lies height_base + height_gain * value above the mesh, along its normals, in
    the mesh's units; heights of arrays may be any finite floats. displace_detail: they are means over this much, in
    voxels of level 0, and faces are cut until they lie within subdivide_error of them.

    subdivide: "catmull-clark" or "loop" (triangles only) takes meshes that say nothing else (Mesh.scheme) for cages: level
    0 is their limit surface.
    subdivide_error: how far its faces may lie from it, in voxels of level 0. subdivide_edge: the longest that their sides
    may be, in such voxels; 0 is what the error gives. subdivide_boundary: "edge-and-corner" or "edge-only".
    subdivide_uv: where texture coordinates stay linear: "none", "corners-only", "corners-plus1", "corners-plus2",
    "boundaries", "all".

    simplify: what collapses on coarser levels: "loops" (of quads, which stay quads; edges of other faces), "edges" (of all
    faces), "auto" (loops of well-structured parts, edges of the others).

    memory_limit: bytes that the process may grow by; 0 is no limit. progress: called with (done in [0, 1], stage); what
    it raises ends the bake. Ctrl-C ends it too; the next call goes on from there.
    """
    all_meshes = [meshes] if isinstance(meshes, Mesh) else list(meshes)
    arrays = []
    for i, mesh in enumerate(all_meshes):
        try:
            arrays.append(mesh._arrays())
        except ValueError as unfit:
            raise ValueError(f"mesh {i}{f' ({mesh.name})' if mesh.name else ''}: {unfit}") from None
    settings = _settings(coarsest_grid, source_only, threads, memory_limit, finest_grid, rays_per_voxel)
    settings |= _subdivision(subdivide, subdivide_error, subdivide_edge, subdivide_boundary, subdivide_uv, displace_detail)
    settings |= _simplify(simplify)
    placed = _arrays.instances(instances, len(all_meshes))
    looks = _arrays.materials(materials)
    return _farfield.bake_meshes(os.fspath(out), name, arrays, placed, looks, material_key, settings, progress)


def bake_file(
    source: Path,
    out: Path,
    *,
    mesh: int = -1,
    finest_grid: int = 512,
    coarsest_grid: int = 8,
    rays_per_voxel: int = 200,
    density_grid: str = "",
    density_scale: float = 1.0,
    albedo: float | Sequence[float] | None = None,
    anisotropy: float = 0.0,
    level_set: bool = False,
    fibre_roughness: float = 0.1,
    downsampling: str = "matched",
    source_only: bool = False,
    subdivide: str = "none",
    subdivide_error: float = 0.125,
    subdivide_edge: float = 0,
    subdivide_boundary: str = "edge-and-corner",
    subdivide_uv: str = "corners-plus1",
    displace_detail: float = 1,
    simplify: str = "auto",
    threads: int = 0,
    memory_limit: int = 0,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """bake() for a file: OBJ with MTL, PLY, glTF or glb, gzipped or not; or an OpenVDB volume (.vdb). mesh: of glTF this
    one alone, in its own space; -1 is the whole scene. Of volumes alone: density_grid (without it "density", or the only
    fog volume), level_set (take one for the fog inside it), and what bake_volume() has; their grids are their own."""
    settings = _settings(coarsest_grid, source_only, threads, memory_limit, finest_grid, rays_per_voxel)
    settings |= _fog(density_scale, albedo, anisotropy, downsampling, density_grid, level_set, fibre_roughness)
    settings |= _subdivision(subdivide, subdivide_error, subdivide_edge, subdivide_boundary, subdivide_uv, displace_detail)
    settings |= _simplify(simplify)
    return _farfield.bake_file(os.fspath(source), os.fspath(out), mesh, settings, progress)


def bake_volume(
    density: npt.ArrayLike,
    out: Path,
    *,
    voxel_size: float = 1.0,
    to_asset: npt.ArrayLike | None = None,
    name: str = "memory",
    coarsest_grid: int = 8,
    density_scale: float = 1.0,
    albedo: npt.ArrayLike | None = None,
    anisotropy: npt.ArrayLike = 0.0,
    sggx: npt.ArrayLike | None = None,
    fibre: npt.ArrayLike | None = None,
    fibre_roughness: float = 0.1,
    self_shadowing: npt.ArrayLike | None = None,
    downsampling: str = "matched",
    source_only: bool = False,
    threads: int = 0,
    memory_limit: int = 0,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Bakes fog into the folder `out`, as bake() does meshes.

    density: (depth, height, width), z, y, x: density[k, j, i] is that of the cube of voxel_size from voxel_size * (i, j,
    k) on, which to_asset, a 4 x 4 or 3 x 4 matrix, puts into the asset; with shear or uneven scale it is resampled onto cubes. density_scale: the
    attenuation coefficient, in 1 / unit of the asset, where the density is 1. albedo of single scattering: a number, three
    for linear RGB, or an array (depth, height, width, 3); without it 0.99. anisotropy: mean cosine of scattering, from
    -0.98 to 0.98, a number or an array (depth, height, width). sggx: (depth, height, width, 6), matrices S as xx, yy, zz,
    xy, xz, yz along the asset's axes, whose sigma_t(w) is density sqrt(w^T S w); or fibre: (depth, height, width, 3),
    directions of any length, across which the density stops, and fibre_roughness of that along them. self_shadowing:
    (depth, height, width), in [0, 1]. docs/scene_format.md says more of these. downsampling: how levels are made, "linear", "transp", "iso", "aniso" or "matched".
    """
    values = np.ascontiguousarray(density, dtype=np.float32)
    if values.ndim != 3:
        raise ValueError(f"density: an array of shape (depth, height, width), not {values.shape}")
    per_voxel = albedo is not None and np.ndim(albedo) == 4
    g_per_voxel = np.ndim(anisotropy) != 0
    channels = {
        "albedo": _arrays.voxels(albedo if per_voxel else None, (*values.shape, 3), "albedo"),
        "sggx": _arrays.voxels(sggx, (*values.shape, 6), "sggx"),
        "fibre": _arrays.voxels(fibre, (*values.shape, 3), "fibre"),
        "anisotropy": _arrays.voxels(anisotropy if g_per_voxel else None, values.shape, "anisotropy"),
        "self_shadowing": _arrays.voxels(self_shadowing, values.shape, "self_shadowing"),
    }
    place = _arrays.matrix(np.eye(4) if to_asset is None else to_asset, "to_asset")
    place = place @ np.diag([voxel_size, voxel_size, voxel_size, 1.0])
    settings = _settings(coarsest_grid, source_only, threads, memory_limit)
    settings |= _fog(density_scale, None if per_voxel else albedo, 0.0 if g_per_voxel else float(anisotropy),
                     downsampling, fibre_roughness=fibre_roughness)
    return _farfield.bake_volume(os.fspath(out), name, values, channels, place, settings, progress)


def _settings(
    coarsest_grid: int, source_only: bool, threads: int, memory_limit: int, finest_grid: int = 512,
    rays_per_voxel: int = 200
) -> dict[str, Any]:
    for name, value in (("finest_grid", finest_grid), ("coarsest_grid", coarsest_grid),
                        ("rays_per_voxel", rays_per_voxel), ("threads", threads), ("memory_limit", memory_limit)):
        if value < 0:
            raise ValueError(f"{name} is {value}")
    return {
        "finest_grid": finest_grid,
        "coarsest_grid": coarsest_grid,
        "rays_per_voxel": rays_per_voxel,
        "source_only": source_only,
        "threads": threads,
        "memory_limit_bytes": memory_limit,
        **_fog(),
        **_subdivision(),
        **_simplify(),
    }


def _fog(
    density_scale: float = 1.0, albedo: Any = None, anisotropy: float = 0.0, downsampling: str = "matched",
    density_grid: str = "", level_set: bool = False, fibre_roughness: float = 0.1
) -> dict[str, Any]:
    if albedo is not None:
        albedo = np.asarray(albedo, dtype=np.float64)
        if albedo.shape not in ((), (3,)):
            raise ValueError(f"albedo: a number or three, not of shape {albedo.shape}")
        albedo = [float(value) for value in np.broadcast_to(albedo, 3)]
    return {
        "density_grid": density_grid,
        "density_scale": density_scale,
        "albedo": albedo,
        "anisotropy": anisotropy,
        "level_set": level_set,
        "fibre_roughness": fibre_roughness,
        "downsampling": downsampling,
    }


_SCHEMES = ("none", "catmull-clark", "loop")
_BOUNDARIES = ("edge-and-corner", "edge-only")
_UV_RULES = ("none", "corners-only", "corners-plus1", "corners-plus2", "boundaries", "all")
_SIMPLIFY = ("auto", "loops", "edges")


def _number(name: str, value: str, names: tuple[str, ...]) -> int:
    if value not in names:
        raise ValueError(f"{name} is {value!r}, which is none of {', '.join(names)}")
    return names.index(value)


def _simplify(method: str = "auto") -> dict[str, Any]:
    return {"simplify": _number("simplify", method, _SIMPLIFY)}


def _subdivision(
    scheme: str = "none", error: float = 0.125, edge: float = 0, boundary: str = "edge-and-corner",
    uv: str = "corners-plus1", detail: float = 1
) -> dict[str, Any]:
    return {
        "subdivide": _number("subdivide", scheme, _SCHEMES),
        "subdivide_boundary": _number("subdivide_boundary", boundary, _BOUNDARIES),
        "subdivide_uv": _number("subdivide_uv", uv, _UV_RULES),
        "subdivide_error": error,
        "subdivide_edge": edge,
        "displace_detail": detail,
    }


class Asset:
    """A baked asset: its folder, and what its manifest says. The functions of this module take it in place of a folder.

    materials: the function that it was baked with, if it was; render() asks it up close.
    """

    def __init__(self, folder: Path, materials: MaterialFunction | None = None):
        self.folder = os.fspath(folder)
        self.materials = materials
        self._info: dict[str, Any] = info(self.folder)

    @property
    def levels(self) -> list[dict[str, Any]]:
        """The stored levels, finest first."""
        levels: list[dict[str, Any]] = self._info["levels"]
        return levels

    def info(self) -> dict[str, Any]:
        return self._info

    def evaluate(self, **options: Any) -> dict[str, Any]:
        return evaluate(self, **options)

    def render(self, **options: Any) -> npt.NDArray[np.float32]:
        return render(self, **options)

    def __fspath__(self) -> str:
        return self.folder

    def __repr__(self) -> str:
        return f"farfield.Asset({self.folder!r})"


def open(folder: Path, materials: MaterialFunction | None = None) -> Asset:
    """Opens a baked asset."""
    return Asset(folder, materials)


def info(folder: Path) -> dict[str, Any]:
    """What `farfield info --json` says: the asset's levels, with what they hold, cost and (once evaluated) miss."""
    said: dict[str, Any] = json.loads(_farfield.info(os.fspath(folder)))
    return said


def evaluate(
    asset: Path,
    *,
    source: Path | None = None,
    other_source: bool = False,
    levels: tuple[int, int] = (1, 1000),
    lights: Sequence[str] = ("daylight", "front", "behind", "above", "sky"),
    views: int = 12,
    samples: int = 0,
    seed: int = 0,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """How far levels look from the source (docs/error_metric.md): {"views", "warnings", "levels": [{"level",
    "occlusion_error", "occlusion_rms", "color_error", "color_bias", "lights", "depth", ...}]}; errors are fractions, None
    where noise hides them (then "bounds" holds). The asset keeps them if daylight is among the lights.

    source: the file that was baked; without it the asset's own level 0. other_source: compare with a file that was not
    baked, too (then the asset keeps nothing; without it that is an Error). levels: from, to. lights: see the default.
    samples: per pixel and light; 0: as many as each level's size asks for.
    """
    options = {
        "other_source": other_source,
        "first_level": levels[0],
        "last_level": levels[1],
        "lights": ",".join(lights),
        "views": views,
        "samples": samples,
        "seed": seed,
    }
    text = _farfield.evaluate(os.fspath(asset), "" if source is None else os.fspath(source), options, progress)
    figures: dict[str, Any] = json.loads(text)
    return figures


def read_scene(path: Path, *, assemblies: str = "repeated", frame: float = 0) -> dict[str, Any]:
    """What stands where in a glTF scene (docs/scene_format.md), for hosts that place baked assets themselves.

    {"assets": [{"name", "folder", "node", "triangles"}], "instances": {"asset": (n,), "to_world": (n, 3, 4), "id": (n,),
    "tint": (n, 3), "name": [...]}, "origin", "warnings"}. folder: where `farfield bake SCENE --scene -o LIBRARY` puts the
    asset in LIBRARY. node: of the file, for assemblies; None for meshes. to_world is as the file has it less "origin",
    which is not 0 in map coordinates only. assemblies: "repeated", "marked" or "none". frame: n / fps seconds.
    """
    scene: dict[str, Any] = _farfield.read_scene(os.fspath(path), assemblies, frame)
    return scene


def render(
    scene: Path | Sequence[tuple[Path, npt.ArrayLike]],
    *,
    width: int = 480,
    height: int = 270,
    eye: Sequence[float] | None = None,
    target: Sequence[float] | None = None,
    up: Sequence[float] = (0, 1, 0),
    fov_y: float = 0.7,
    samples: int = 16,
    level: float | None = None,
    light: Any = None,
    channels: Sequence[str] = ("R", "G", "B"),
    transparent: bool = False,
    max_depth: int = 64,
    seed: int = 0,
    pixel_error: float = 1.0,
    budget: int = 4 << 30,
    threads: int = 0,
    progress: Progress | None = None,
) -> npt.NDArray[np.float32]:
    """A path-traced picture of shape (height, width, channels), linear, row by row from the top.

    scene: an asset, or (asset, 4 x 4 or 3 x 4 matrix to world) for each instance. eye, target, up: the camera; without
    an eye all is seen. fov_y: vertical, radians. level: what every ray sees, 0 is the source; None: as its footprint
    asks. light: None is sun and sky (+y up), (r, g, b) the same from everywhere, an array (height, width, 3) or the
    name of an EXR a latitude-longitude picture. channels: also "A", "Z", "albedo.R", "N.X", "lod.level" and so on.
    transparent: the light itself is not seen. budget: bytes for the assets. The same arguments give the same picture.
    """
    placed: list[tuple[Path, npt.ArrayLike]]
    placed = [(scene, np.eye(4))] if isinstance(scene, (str, os.PathLike)) else list(scene)
    arrays = [
        (os.fspath(asset), _arrays.matrix(to_world, f"instance {i}"), _look(getattr(asset, "materials", None)))
        for i, (asset, to_world) in enumerate(placed)
    ]
    if not arrays:
        raise ValueError("there is nothing to render")
    if not (0 < width <= 1 << 15 and 0 < height <= 1 << 15):
        raise ValueError(f"pictures of {width} x {height} pixels: 1 to {1 << 15} each way")
    if not 0 < fov_y < np.pi:
        raise ValueError(f"fov_y is {fov_y}; it is an angle in radians between 0 and pi")
    view = {"width": width, "height": height, "eye": eye, "target": target, "up": up, "fov_y": fov_y,
            "samples": samples, "seed": seed, "max_depth": max_depth, "transparent": transparent,
            "budget_bytes": budget, "pixel_error": pixel_error, "level": level, "threads": threads}
    look = os.fspath(light) if isinstance(light, os.PathLike) else light
    return _farfield.render(arrays, view, list(channels), look, progress, _warn)


def _look(function: MaterialFunction | None) -> Any:
    return None if function is None else _arrays.material_function(function)


def _warn(text: str) -> None:
    _warnings.warn(text, stacklevel=3)
