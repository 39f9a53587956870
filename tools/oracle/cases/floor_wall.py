"""A floor beside a hot wall: the floor is warmed by the wall alone, and has a gradient that patches must resolve."""

from pathlib import Path

import numpy as np

from .. import gltf, scenes, shapes
from ..camera import Camera
from ..case import Bounds, Case

BETA, INITIAL, STEP, STEPS = 0.0, 250.0, 30.0, 80
# The Sun shines along +X on the back of the wall, and grazes the floor.
PARTS = [
    gltf.Part("floor", "floor", shapes.quad([-6, -3, 0], [6, 0, 0], [0, 6, 0])),
    gltf.Part("wall", "wall", shapes.quad([0, -3, 0], [0, 0, 4], [0, 6, 0])),
]
CAMERA = Camera((-12.0, -3.0, 6.0), (-2.8, 0.0, 1.0), 40.0)
FLOOR, WALL = (0.3, 0.85, 1500.0, (0.3, 0.3)), (0.2, 0.9, 3000.0, (0.95, 0.1))


def _build(edge: float):
    def build(folder: Path) -> Path:
        sections = [scenes.still_sun(BETA), "[shadows]", "[exchange]", scenes.material("floor", *FLOOR), scenes.material("wall", *WALL)]
        return scenes.write(folder, PARTS, sections, CAMERA, f"step = {STEP}\nsteps = {STEPS}\ndraw_every = 40\n", INITIAL, edge)

    return build


def _truth() -> list:
    from ..facing import Plate, rows

    # The Sun shines on the back of the wall alone.
    plates = [Plate(6.0, FLOOR[1], FLOOR[3][1], FLOOR[2]), Plate(4.0, WALL[1], WALL[3][1], WALL[2], WALL[3][0] * 1361.0)]
    triangles = np.concatenate([part.triangles for part in PARTS])
    part_of = np.repeat([0, 1], [len(part.triangles) for part in PARTS])
    right = np.array([np.pi / 2])
    return rows(plates, 6.0, lambda _: np.pi / 2, right, INITIAL, STEP, {40: triangles, 80: triangles}, part_of, CAMERA, (30, 12), 1200, {0})


CASES = [
    Case("floor_wall", _build(0.25), _truth, Bounds(rms=1.5, largest=4.0), data="floor_wall", parts=["floor", "wall"], finds="patches that do not resolve what they receive"),
    Case("floor_wall_fine", _build(0.08), _truth, Bounds(rms=1.5, largest=4.0), data="floor_wall", parts=["floor", "wall"], finds="a flux that is uniform over a patch of many nodes"),
]
