# SPDX-License-Identifier: Apache-2.0
"""Brings what people have in arrays into the one shape that the extension takes."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Sequence

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]

_SRGB = np.arange(256) / 255.0
_SRGB_TO_LINEAR = np.where(_SRGB <= 0.04045, _SRGB / 12.92, ((_SRGB + 0.055) / 1.055) ** 2.4).astype(np.float32)
_COLOR_TEXTURES = ("base_color_texture", "emission_texture")


def rows(values: Any, columns: int, what: str) -> Array:
    """(n, columns) float64."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != columns:
        raise ValueError(f"{what}: an array of shape (n, {columns}), not {array.shape}")
    return np.ascontiguousarray(array)


def integers(values: Any, what: str) -> Array:
    """Whole numbers of any shape as int64; 1.0 is one, 1.5 is refused."""
    array = np.asarray(values)
    if array.size == 0:
        return array.astype(np.int64)
    if array.dtype.kind not in "iu" or array.dtype == np.uint64 and array.max() > np.iinfo(np.int64).max:
        raise ValueError(f"{what}: an array of integers, not of {array.dtype}")
    return np.ascontiguousarray(array, dtype=np.int64)


def faces(values: Any, counts: Any) -> tuple[Array, Array | None]:
    """Corners, face after face, and how many each face has (None: three)."""
    if counts is not None:
        return integers(values, "faces").ravel(), integers(counts, "counts").ravel()
    if not isinstance(values, np.ndarray):
        lengths = [len(face) for face in values]
        if len(set(lengths)) > 1:  # polygons of several kinds
            corners = np.concatenate([integers(face, "faces") for face in values])
            return corners, np.asarray(lengths, dtype=np.int64)
    array = integers(values, "faces")
    if array.size == 0:
        return array.ravel(), None
    if array.ndim != 2:
        raise ValueError(f"faces: an array of shape (n, corners of a face), or flat with counts; not {array.shape}")
    if array.shape[1] == 3:
        return array.ravel(), None
    return array.ravel(), np.full(len(array), array.shape[1], dtype=np.int64)


def attribute(values: Any, columns: int, points: int, corners: Array, what: str) -> tuple[Array, bool] | None:
    """(float32 rows, whether they belong to points and not to corners). Three axes are corners: (n, k, columns)."""
    if values is None:
        return None
    array = np.asarray(values, dtype=np.float32)
    if columns == 4 and array.ndim >= 2 and array.shape[-1] == 3:
        array = np.concatenate([array, np.ones_like(array[..., :1])], axis=-1)
    if array.ndim not in (2, 3) or array.shape[-1] != columns:
        raise ValueError(f"{what}: one row of {columns} numbers per point or per corner, not shape {array.shape}")
    per_corner = array.ndim == 3
    array = np.ascontiguousarray(array.reshape(-1, columns))
    is_both = points == len(corners) == len(array) and not np.array_equal(corners, np.arange(points))
    if not per_corner and is_both:
        raise ValueError(
            f"{what}: there are as many points as corners, so rows could be for either; give rows of corners as an "
            f"array of shape (faces, corners of a face, {columns}), such as {what}[faces] for rows of points"
        )
    if per_corner or len(array) == len(corners):
        return array, False
    if len(array) == points:
        return array, True
    raise ValueError(f"{what}: {len(array)} rows for {points} points and {len(corners)} corners")


def creases(edges: Any, edge_sharpness: Any, points: Any, point_sharpness: Any) -> dict[str, Array | None]:
    """What stays sharp of a cage: pairs of points, points, and a sharpness for each."""

    def sharpness(values: Any, count: int, what: str) -> Array:
        array = np.asarray(values, dtype=np.float64)
        if array.ndim == 0:
            return np.full(count, array)
        if array.shape != (count,):
            raise ValueError(f"{what}: a number, or {count} of them, not an array of shape {array.shape}")
        return np.ascontiguousarray(array)

    pairs = None if edges is None else integers(edges, "creases")
    if pairs is not None and pairs.size and (pairs.ndim != 2 or pairs.shape[1] != 2):
        raise ValueError(f"creases: an array of shape (n, 2), not {pairs.shape}")
    sharp = None if points is None else integers(points, "sharp_points").ravel()
    return {
        "creases": pairs,
        "crease_sharpness": None if pairs is None else sharpness(edge_sharpness, len(pairs), "crease_sharpness"),
        "sharp_points": sharp,
        "point_sharpness": None if sharp is None else sharpness(point_sharpness, len(sharp), "point_sharpness"),
    }


def matrix(values: Any, what: str) -> Array:
    """The upper 3 x 4 part of a transform, for column vectors: the last column is the translation."""
    array = np.asarray(values, dtype=np.float64)
    if array.shape not in ((4, 4), (3, 4)):
        raise ValueError(f"{what}: a matrix of shape (4, 4) or (3, 4), not {array.shape}")
    if array.shape == (4, 4) and not np.array_equal(array[3], (0, 0, 0, 1)):
        raise ValueError(f"{what}: the last row is {array[3].tolist()}, not 0 0 0 1; is the matrix transposed?")
    return np.ascontiguousarray(array[:3])


def voxels(values: Any, shape: tuple[int, ...], what: str) -> Array | None:
    """float32 rows, one per voxel, of an array of this shape; None: None."""
    if values is None:
        return None
    array = np.ascontiguousarray(values, dtype=np.float32)
    if array.shape != shape:
        raise ValueError(f"{what}: an array of shape {shape}, not {array.shape}")
    return array.reshape(int(np.prod(shape[:3])), -1)


def image(values: Any, is_color: bool, what: str) -> str | Array:
    """The name of a file, or (height, width, 4) float32. Colours of 8 bits are sRGB, as in image files."""
    if isinstance(values, (str, os.PathLike)):
        return os.fspath(values)
    array = np.asarray(values)
    if array.ndim == 2:
        array = np.repeat(array[..., np.newaxis], 3, axis=-1)
    if array.ndim != 3 or array.shape[-1] not in (3, 4):
        raise ValueError(f"{what}: the name of a file or an array of shape (height, width, 3 or 4), not {array.shape}")
    out = np.ones(array.shape[:2] + (4,), dtype=np.float32)
    if array.dtype == np.uint8:
        rgb = array[..., :3]
        out[..., :3] = _SRGB_TO_LINEAR[rgb] if is_color else rgb / np.float32(255)
        if array.shape[-1] == 4:
            out[..., 3] = array[..., 3] / np.float32(255)
    elif array.dtype.kind == "f":
        out[..., : array.shape[-1]] = array
    else:
        raise ValueError(f"{what}: pixels are uint8 or floats, not {array.dtype}")
    return out


def material(fields: dict[str, Any]) -> dict[str, Any]:
    out = dict(fields)
    for name, value in fields.items():
        if name == "alpha_texture" and not isinstance(value, (str, os.PathLike)):
            # An array without alpha is a mask itself, as a file without alpha is.
            array = np.asarray(value)
            if array.ndim == 2:
                value = np.repeat(array[..., np.newaxis], 4, axis=-1)
            elif array.ndim == 3 and array.shape[-1] == 3:
                value = np.repeat(array[..., :1], 4, axis=-1)
        if name.endswith("_texture"):
            out[name] = image(value, name in _COLOR_TEXTURES, name)
    return out


@dataclass(frozen=True)
class MaterialQueries:
    """Places on surfaces of the source, as a batched material function is asked for them: a row per place."""

    material: Array  # (n,): the ids that the faces carry
    face: Array  # (n,): numbers of the faces, in the order in which the source has them
    uv: Array  # (n, 2): v points down the image; NaN where there are none
    duv_dx: Array  # (n, 2): half-axis of the footprint in uv
    duv_dy: Array  # (n, 2): the other half-axis
    color: Array  # (n, 4): vertex colour, linear RGBA
    opacity_only: Array  # (n,): nothing but the answer's opacity will be looked at

    def __len__(self) -> int:
        return len(self.material)


# Where a sample's fields lie in a row, and what they are when nothing is said: MaterialSample of farfield/material.h.
_SAMPLE = {"diffuse": (slice(0, 3), 0.8), "specular": (slice(3, 6), 0), "transmission": (slice(6, 9), 0),
           "roughness": (9, 1), "opacity": (10, 1), "normal": (slice(11, 14), (0, 0, 1)), "emission": (slice(14, 17), 0)}


def _samples(answer: Any, count: int) -> Array:
    if not isinstance(answer, Mapping):
        raise ValueError(f"a material function returns a dictionary, not {answer!r}")
    rows_ = np.empty((count, 17), np.float32)
    for columns, default in _SAMPLE.values():
        rows_[:, columns] = default
    for name, value in answer.items():
        if name not in _SAMPLE:
            raise ValueError(f"a material sample has no '{name}'; there are: {', '.join(sorted(_SAMPLE))}")
        try:
            rows_[:, _SAMPLE[name][0]] = value
        except (TypeError, ValueError):
            raise ValueError(f"a material sample: '{name}' of {count} places cannot have the shape {np.shape(value)}") from None
    return rows_


def material_function(function: Any) -> Any:
    """Of one kind, whatever is callable; `batched` says whether it is asked for many places at once."""
    ask: Any
    if getattr(function, "batched", False):
        def ask(count: int, *columns: Array) -> Array:
            return _samples(function(MaterialQueries(*columns)), count)
        ask.batched = True
    else:
        def ask(query: Any) -> Any:
            return function(query)
        ask.batched = False
    return ask


def materials(values: Any) -> list[dict[str, Any]] | Any:
    """A function as it is; an (n, 3) array as base colours; dictionaries with their images brought into shape."""
    if values is None:
        return []
    if callable(values):
        return material_function(values)
    if isinstance(values, np.ndarray):
        return [{"base_color": tuple(map(float, color))} for color in rows(values, 3, "materials")]
    if isinstance(values, dict):
        raise ValueError("materials: a sequence of dictionaries, one per material id; put the dictionary into a list")
    return [material(fields) for fields in values]


def instances(values: Sequence[tuple[int, Any]] | None, mesh_count: int) -> list[tuple[int, Array]]:
    out = []
    for i, (mesh, to_asset) in enumerate(values or []):
        if not 0 <= mesh < mesh_count:
            raise ValueError(f"instance {i}: there is no mesh {mesh}; there are {mesh_count}")
        out.append((int(mesh), matrix(to_asset, f"instance {i}")))
    return out
