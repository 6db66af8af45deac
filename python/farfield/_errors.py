# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from typing import Sequence


class Error(RuntimeError):
    """What Farfield says when something fails: one line that names the place and the remedy.

    `code` is its kind: "invalid argument", "not found", "io", "bad file", "unsupported", "out of budget", "cancelled".
    `warnings`: what was noticed on the way to it, one line each.
    """

    code: str
    warnings: list[str]

    def __init__(self, message: str, code: str, warnings: Sequence[str] = ()):
        super().__init__(message)
        self.code = code
        self.warnings = list(warnings)
