"""A rod in an open can on a plate. The rod's cap lies apart from its side by rounding, as files often have it, and rings of nodes have the centre of the cap as their middle."""

from pathlib import Path

import numpy as np

from .. import gltf, scenes, shapes
from ..camera import Camera
from ..case import Bounds, Case

BETA, INITIAL, STEP, STEPS = 60.0, 300.0, 20.0, 90


def _open(radius: float, low: float, high: float, facets: int, rings: int) -> np.ndarray:
    """The side of a tube about the z axis."""
    turn = np.arange(facets + 1) * 2 * np.pi / facets
    x, y = radius * np.cos(turn), radius * np.sin(turn)
    quads = [([x[i], y[i], low], [x[i + 1] - x[i], y[i + 1] - y[i], 0], [0, 0, high - low]) for i in range(facets)]
    return np.concatenate([shapes.quad(*quad, (1, rings)) for quad in quads])


PARTS = [
    gltf.Part("rod", "rod", *shapes.tube([0, 0, 0.3], [0, 0, 2.3], 0.2, 12, 10)),
    gltf.Part("can", "can", _open(0.9, 0.2, 1.8, 16, 8)),
    gltf.Part("base", "base", shapes.quad([-1.5, -1.5, 0], [3, 0, 0], [0, 3, 0])),
]
CAMERA = Camera((3.0, -4.0, 6.0), (0.0, 0.0, 0.9), 32.0)
ROD, CAN, BASE = (0.95, 0.9, 3000.0), (0.2, 0.6, 1500.0, (0.5, 0.8)), (0.6, 0.7, 2500.0, (0.2, 0.05))
CONDUCTS = {"rod": 0.2, "can": 0.1, "base": 0.2}


def _build(folder: Path) -> Path:
    skins = [scenes.material(name, *skin, conducts=CONDUCTS[name]) for name, skin in zip(CONDUCTS, (ROD, CAN, BASE), strict=True)]
    return scenes.write(folder, PARTS, [scenes.still_sun(BETA), "[shadows]", "[exchange]", *skins], CAMERA, f"step = {STEP}\nsteps = {STEPS}\ndraw_steps = [15, 90]\n", INITIAL, 0.1)


def _truth() -> list:
    from ..balance import Finish
    from ..fields import read, still

    finishes = {name: Finish(*skin, conducts=CONDUCTS[name]) for name, skin in zip(CONDUCTS, (ROD, CAN, BASE), strict=True)}
    surface, found = still(PARTS, finishes, BETA, INITIAL, STEP, [15, 90], 0.08, exchange=(0.1, 1024), samples=64, divide=2)
    return read(surface, CAMERA, found)


CASES = [Case("can", _build, _truth, Bounds(rms=0.3, largest=3.0), parts=[part.name for part in PARTS], finds="a seam of rounding through which no heat flows, and patches around one centre")]
