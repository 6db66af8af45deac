# SPDX-License-Identifier: Apache-2.0
# The extension, as farfield/__init__.py calls it. Not for others, MaterialQuery aside.
from typing import Any, Callable, Sequence

import numpy as np
import numpy.typing as npt

version: str

class MaterialQuery:
    """A place on a surface of the source, as a material function is asked for it."""

    @property
    def material(self) -> int: ...
    @property
    def face(self) -> int: ...
    @property
    def opacity_only(self) -> bool: ...
    @property
    def uv(self) -> tuple[float, float]: ...
    @property
    def duv_dx(self) -> tuple[float, float]: ...
    @property
    def duv_dy(self) -> tuple[float, float]: ...
    @property
    def color(self) -> tuple[float, float, float, float]: ...

def bake_meshes(
    folder: str,
    name: str,
    meshes: list[dict[str, Any]],
    instances: list[tuple[int, npt.NDArray[np.float64]]],
    materials: list[dict[str, Any]] | Callable[[MaterialQuery], Any],
    material_key: str,
    settings: dict[str, Any],
    progress: Callable[[float, str], Any] | None,
) -> dict[str, Any]: ...
def bake_volume(
    folder: str,
    name: str,
    density: npt.NDArray[np.float32],
    channels: dict[str, npt.NDArray[np.float32] | None],
    to_asset: npt.NDArray[np.float64],
    settings: dict[str, Any],
    progress: Callable[[float, str], Any] | None,
) -> dict[str, Any]: ...
def bake_file(
    source: str, folder: str, mesh: int, settings: dict[str, Any], progress: Callable[[float, str], Any] | None
) -> dict[str, Any]: ...
def info(folder: str) -> str: ...
def evaluate(
    folder: str, source: str, options: dict[str, Any], progress: Callable[[float, str], Any] | None
) -> str: ...
def read_scene(path: str, assemblies: str, frame: float) -> dict[str, Any]: ...
def render(
    scene: Sequence[tuple[str, npt.NDArray[np.float64], Any]],
    view: dict[str, Any],
    channels: list[str],
    light: Any,
    progress: Callable[[float, str], Any] | None,
    warn: Callable[[str], None],
) -> npt.NDArray[np.float32]: ...
