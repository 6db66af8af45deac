# SPDX-License-Identifier: Apache-2.0


class Error(RuntimeError):
    """What Farfield says when something fails: one line that names the place and the remedy.

    `code` is its kind: "invalid argument", "not found", "io", "bad file", "unsupported", "out of budget", "cancelled".
    """

    code: str

    def __init__(self, message: str, code: str):
        super().__init__(message)
        self.code = code
