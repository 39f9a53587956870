"""A small box on a large deck whose mesh does not know the box: its walls see sunlit and shaded deck at their foot, within one cell of the deck."""

from pathlib import Path

import numpy as np

from .. import gltf, scenes, shapes
from ..camera import Camera
from ..case import Bounds, Case

BETA, INITIAL, STEP, STEPS = 40.0, 290.0, 20.0, 60
# Half of the sides of deck and box, and the gap between them [m]. The truth is fine up to NEAR.
HALF, NEAR, SIDE, GAP = 5.0, 1.5, 0.25, 0.005
FACES = ["-X", "+X", "-Y", "+Y", "-Z", "+Z"]
# Each face is a part, so that the truth has no vertex with the mean of two faces.
BOX = [gltf.Part(f"box{face}", "box", shapes.box([-SIDE, -SIDE, GAP], [SIDE, SIDE, GAP + 2 * SIDE], tuple(other for other in FACES if other != face))) for face in FACES]
PARTS = [gltf.Part("deck", "deck", shapes.quad([-HALF, -HALF, 0], [2 * HALF, 0, 0], [0, 2 * HALF, 0])), *BOX]
CAMERA = Camera((3.0, -3.0, 1.6), (0.0, 0.0, 0.2), 14.0)
DECK, SKIN = (0.3, 0.85, 3000.0), (0.2, 0.9, 4000.0)


def _build(folder: Path) -> Path:
    sections = [scenes.still_sun(BETA), "[shadows]", "[exchange]", scenes.material("deck", *DECK), scenes.material("box", *SKIN)]
    return scenes.write(folder, PARTS, sections, CAMERA, f"step = {STEP}\nsteps = {STEPS}\ndraw_every = {STEPS}\n", INITIAL, None)


def _grid(along: list[float], across: list[float]) -> np.ndarray:
    """Rectangles of the deck between lines."""
    return np.concatenate([shapes.quad([x, y, 0], [to_x - x, 0, 0], [0, to_y - y, 0]) for x, to_x in zip(along, along[1:]) for y, to_y in zip(across, across[1:])])


def _truth() -> list:
    from ..balance import Finish
    from ..fields import read, still

    # The truth's deck has edges where the box and its shadow end.
    shadow = -SIDE - (GAP + 2 * SIDE) / np.tan(np.radians(BETA))
    near = _grid([-NEAR, shadow, -SIDE, SIDE, NEAR], [-NEAR, -SIDE, SIDE, NEAR])
    far = [_grid([-HALF, -NEAR], [-HALF, HALF]), _grid([NEAR, HALF], [-HALF, HALF]), _grid([-NEAR, NEAR], [-HALF, -NEAR]), _grid([-NEAR, NEAR], [NEAR, HALF])]
    parts = [gltf.Part("deck", "deck", near), *BOX, gltf.Part("far", "deck", np.concatenate(far))]
    finishes = {"deck": Finish(*DECK), "box": Finish(*SKIN)}
    surface, found = still(parts, finishes, BETA, INITIAL, STEP, [STEPS], 0.04, {"deck": 0.03, "far": 0.25}, exchange=(0.04, 2048), samples=64, divide=2)
    # An edge of a shadow on the deck lies between vertices of the truth, and nothing shines on the top but the Sun.
    return read(surface, CAMERA, found, only={"box+X", "box-Y"})


CASES = [Case("box_on_deck", _build, _truth, Bounds(rms=1.5), parts=[part.name for part in PARTS], finds="errors of light that differs within the cell of a sender and are not stated")]
