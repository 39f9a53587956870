"""A box with a hole in its lid: a spot of light on its floor, in a cavity whose walls warm each other and reflect the light."""

from pathlib import Path

import numpy as np

from .. import gltf, scenes, shapes
from ..camera import Camera
from ..case import Bounds, Case

BETA, INITIAL, STEP, STEPS = 70.0, 260.0, 60.0, 60
HOLE = 0.3


def _lid() -> np.ndarray:
    """Eight quads around the hole, whose edges meet: heat would not flow across others as it does in one sheet."""
    ends = [-1, -HOLE, HOLE, 1]
    cells = [(i, k) for i in range(3) for k in range(3) if (i, k) != (1, 1)]
    return np.concatenate([shapes.quad([ends[i], ends[k], 1], [ends[i + 1] - ends[i], 0, 0], [0, ends[k + 1] - ends[k], 0]) for i, k in cells])


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

    surface, found = still(PARTS, {"sheet": Finish(*SHEET, conducts=CONDUCTS)}, BETA, INITIAL, STEP, [30, 60], 0.08, exchange=(0.1, 1024), samples=64, divide=2)
    return read(surface, CAMERA, found)


CASES = [Case("hole", _build, _truth, Bounds(rms=1.5, largest=6.0), parts=[part.name for part in PARTS], finds="a spot of light, and a cavity that sends it on")]
