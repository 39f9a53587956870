"""A row of fins on a plate: their shadows fall on each other and on the plate, which conducts."""

from pathlib import Path

import numpy as np

from .. import gltf, scenes, shapes
from ..camera import Camera
from ..case import Bounds, Case

BETA, INITIAL, STEP, STEPS = 35.0, 290.0, 60.0, 20
FINS = np.arange(5) * 0.8 - 1.6
PARTS = [gltf.Part("plate", "plate", shapes.quad([-2.5, -1, 0], [5, 0, 0], [0, 2, 0]))]
PARTS += [gltf.Part(f"fin_{number}", "fin", shapes.box([at - 0.02, -1, 0.005], [at + 0.02, 1, 0.5])) for number, at in enumerate(FINS)]
CAMERA = Camera((5.5, -4.0, 4.8), (0.3, 0.0, 0.1), 38.0)
PLATE, FIN = (0.7, 0.85, 4860.0), (0.5, 0.8, 2430.0)
CONDUCTS = 0.4


def _build(max_edge: float):
    def build(folder: Path) -> Path:
        sections = [scenes.still_sun(BETA), "[shadows]", scenes.material("plate", *PLATE, conducts=CONDUCTS), scenes.material("fin", *FIN, conducts=CONDUCTS)]
        return scenes.write(folder, PARTS, sections, CAMERA, f"step = {STEP}\nsteps = {STEPS}\ndraw_every = 10\n", INITIAL, max_edge)

    return build


def _truth() -> list:
    from ..balance import Finish
    from ..fields import read, still

    finishes = {"plate": Finish(*PLATE, conducts=CONDUCTS), "fin": Finish(*FIN, conducts=CONDUCTS)}
    surface, found = still(PARTS, finishes, BETA, INITIAL, STEP, [10, 20], 0.05, samples=64, divide=4)
    return read(surface, CAMERA, found)


# Both are held to bounds that light at vertices misses; the coarse mesh has two edges between two fins.
CASES = [
    Case("comb_coarse", _build(0.4), _truth, Bounds(rms=3.0, p99=8.0), data="comb", parts=[part.name for part in PARTS], finds="shadows of parts that stand close"),
    Case("comb_fine", _build(0.15), _truth, Bounds(rms=1.0, p99=3.0), data="comb", parts=[part.name for part in PARTS], finds="shadows of parts that stand close"),
]
