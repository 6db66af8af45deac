# SPDX-License-Identifier: Apache-2.0
import numpy as np
import farfield

longitude, latitude = np.meshgrid(np.linspace(0, 2 * np.pi, 65), np.linspace(0, np.pi, 33))
ring = np.sin(latitude)
points = np.stack([ring * np.cos(longitude), np.cos(latitude), ring * np.sin(longitude)], axis=-1).reshape(-1, 3)
corner = np.arange(33 * 65).reshape(33, 65)
quads = np.stack([corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]], axis=-1).reshape(-1, 4)
farfield.bake(farfield.Mesh(points, quads), "ball.farfield", materials=[{"base_color": (0.8, 0.2, 0.1)}], finest_grid=64)
picture = farfield.render("ball.farfield", width=160, height=90)
print(picture.shape, [level["triangles"] for level in farfield.info("ball.farfield")["levels"]])
