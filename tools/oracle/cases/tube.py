"""A tube across a plate: its shadow is a band with a penumbra, and the tube itself is lit as a cylinder of facets."""

from pathlib import Path

from .. import gltf, scenes, shapes
from ..camera import Camera
from ..case import Bounds, Case

BETA, INITIAL, STEP, STEPS = 60.0, 290.0, 60.0, 20
_TUBE = shapes.tube([0.0, -2.4, 0.6], [0.0, 2.4, 0.6], 0.25, 16, 24)
PARTS = [gltf.Part("plate", "plate", shapes.quad([-2, -1.5, 0], [4, 0, 0], [0, 3, 0])), gltf.Part("tube", "tube", *_TUBE)]
CAMERA = Camera((4.0, -4.5, 4.0), (0.0, 0.0, 0.2), 42.0)
PLATE, TUBE = (0.7, 0.85, 4860.0), (0.4, 0.6, 3645.0)
CONDUCTS = 0.4


def _build(max_edge: float):
    def build(folder: Path) -> Path:
        sections = [scenes.still_sun(BETA), "[shadows]", scenes.material("plate", *PLATE, conducts=CONDUCTS), scenes.material("tube", *TUBE, conducts=CONDUCTS)]
        return scenes.write(folder, PARTS, sections, CAMERA, f"step = {STEP}\nsteps = {STEPS}\ndraw_every = 10\n", INITIAL, max_edge)

    return build


def _truth() -> list:
    from ..balance import Finish
    from ..fields import read, still

    finishes = {"plate": Finish(*PLATE, conducts=CONDUCTS), "tube": Finish(*TUBE, conducts=CONDUCTS)}
    surface, found = still(PARTS, finishes, BETA, INITIAL, STEP, [10, 20], 0.06, samples=64, divide=4)
    return read(surface, CAMERA, found, by_part=True)


CASES = [
    Case("tube_coarse", _build(0.5), _truth, Bounds(rms=3.0, p99=12.0), data="tube", parts=["plate", "tube"], finds="a band of shadow narrower than elements"),
    Case("tube_fine", _build(0.15), _truth, Bounds(rms=0.5, p99=2.0), data="tube", parts=["plate", "tube"], finds="a band of shadow narrower than elements"),
]
