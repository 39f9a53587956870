"""Chooses pixels whose surface is beyond doubt, and tells what they see."""

from dataclasses import dataclass

import numpy as np

from .camera import Camera
from .rays import Rays


@dataclass
class Seen:
    """Pixels that show a surface with all their neighbours."""

    u: np.ndarray
    v: np.ndarray
    # Number of the triangle, and place on it [m].
    triangle: np.ndarray
    place: np.ndarray
    # Direction of sight.
    direction: np.ndarray


def seen(camera: Camera, rays: Rays, group: np.ndarray, most: int) -> Seen:
    """At most so many pixels, spread evenly. `group` numbers the triangles: neighbours of a pixel have to show the same number."""
    origins, directions = camera.rays()
    triangle, distance = rays.first(origins, directions)
    number = np.where(triangle >= 0, group[triangle], -1).reshape(camera.height, camera.width)
    alike = number >= 0
    for du in (-1, 0, 1):
        for dv in (-1, 0, 1):
            alike &= np.roll(number, (dv, du), (0, 1)) == number
    alike[[0, -1]] = alike[:, [0, -1]] = False
    chosen = np.flatnonzero(alike.ravel())
    if len(chosen) > most:
        chosen = np.sort(np.random.default_rng(3).choice(chosen, most, replace=False))
    place = origins[chosen] + distance[chosen, None] * directions[chosen]
    return Seen(chosen % camera.width, chosen // camera.width, triangle[chosen], place, directions[chosen])
