"""Two thin plates in a wedge, cold at first: the sunlit one warms the other within a minute, so infrared that is held for longer arrives late."""

from pathlib import Path

import numpy as np

from .. import gltf, scenes, shapes
from ..camera import Camera
from ..case import Bounds, Case

BETA, INITIAL, STEP, STEPS, ANGLE = 0.0, 250.0, 10.0, 30, np.radians(40.0)
# The Sun shines from +X on the back of the roof, and grazes the floor.
PARTS = [
    gltf.Part("floor", "floor", shapes.quad([-4, -3, 0], [4, 0, 0], [0, 6, 0])),
    gltf.Part("roof", "roof", shapes.quad([0, -3, 0], [-4 * np.cos(ANGLE), 0, 4 * np.sin(ANGLE)], [0, 6, 0])),
]
CAMERA = Camera((-12.0, -3.0, 2.2), (-2.0, 0.0, 0.6), 34.0)
FLOOR, ROOF = (0.3, 0.85, 300.0, (0.3, 0.3)), (0.2, 0.9, 600.0, (0.95, 0.1))


def _build(folder: Path) -> Path:
    sections = [scenes.still_sun(BETA), "[shadows]", "[exchange]", scenes.material("floor", *FLOOR), scenes.material("roof", *ROOF)]
    return scenes.write(folder, PARTS, sections, CAMERA, f"step = {STEP}\nsteps = {STEPS}\ndraw_every = 15\n", INITIAL, 0.25)


def _truth() -> list:
    from ..facing import Plate, rows

    plates = [Plate(4.0, FLOOR[1], FLOOR[3][1], FLOOR[2]), Plate(4.0, ROOF[1], ROOF[3][1], ROOF[2], ROOF[3][0] * 1361.0 * np.sin(ANGLE))]
    triangles = np.concatenate([part.triangles for part in PARTS])
    part_of = np.repeat([0, 1], [len(part.triangles) for part in PARTS])
    return rows(plates, 6.0, lambda _: ANGLE, np.array([ANGLE]), INITIAL, STEP, {15: triangles, 30: triangles}, part_of, CAMERA, (60, 24), 1200, {0, 1})


CASES = [Case("wedge", _build, _truth, Bounds(rms=1.5, largest=4.0), parts=["floor", "roof"], finds="infrared that arrives late at thin sheets")]
