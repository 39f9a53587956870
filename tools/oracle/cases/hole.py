"""A box with a hole in its lid: a spot of light on its floor, in a cavity whose walls warm each other and reflect the light."""

from pathlib import Path

import numpy as np

from .. import gltf, scenes, shapes
from ..camera import Camera
from ..case import Bounds, Case

BETA, INITIAL, STEP, STEPS = 70.0, 260.0, 60.0, 60
HOLE = 0.3


def _lid() -> np.ndarray:
    h = HOLE
    return np.concatenate([
        shapes.quad([-1, -1, 1], [2, 0, 0], [0, 1 - h, 0]),
        shapes.quad([-1, h, 1], [2, 0, 0], [0, 1 - h, 0]),
        shapes.quad([-1, -h, 1], [1 - h, 0, 0], [0, 2 * h, 0]),
        shapes.quad([h, -h, 1], [1 - h, 0, 0], [0, 2 * h, 0]),
    ])  # fmt: skip


PARTS = [
    gltf.Part("floor", "sheet", shapes.quad([-1, -1, -1], [2, 0, 0], [0, 2, 0])),
    gltf.Part("walls", "sheet", shapes.box([-1, -1, -1], [1, 1, 1], ("+Z", "-Z", "+X"))),
    gltf.Part("side", "sheet", shapes.quad([1, -1, -1], [0, 2, 0], [0, 0, 2])),
    gltf.Part("lid", "sheet", _lid()),
]
# Through the hole onto the floor.
CAMERA = Camera((0.6, -0.5, 3.5), (-0.25, 0.05, -0.6), 30.0)
SHEET = (0.5, 0.6, 2430.0, (0.6, 0.7))
CONDUCTS = 0.4


def _build(folder: Path) -> Path:
    sections = [scenes.still_sun(BETA), "[shadows]", "[exchange]", scenes.material("sheet", *SHEET, conducts=CONDUCTS)]
    return scenes.write(folder, PARTS, sections, CAMERA, f"step = {STEP}\nsteps = {STEPS}\ndraw_every = 30\n", INITIAL, 0.15)


def _truth() -> list:
    from ..balance import Finish
    from ..fields import read, still

    surface, found = still(PARTS, {"sheet": Finish(*SHEET, conducts=CONDUCTS)}, BETA, INITIAL, STEP, [30, 60], 0.08, exchange=(0.2, 4096), samples=64, divide=2)
    return read(surface, CAMERA, found)


CASES = [Case("hole", _build, _truth, Bounds(rms=1.5, largest=6.0), parts=[part.name for part in PARTS], finds="a spot of light, and a cavity that sends it on")]
