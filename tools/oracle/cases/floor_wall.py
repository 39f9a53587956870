"""A floor beside a hot wall: the floor is warmed by the wall alone, and has a gradient that patches must resolve."""

from pathlib import Path

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


def _build(folder: Path) -> Path:
    sections = [scenes.still_sun(BETA), "[shadows]", "[exchange]", scenes.material("floor", *FLOOR), scenes.material("wall", *WALL)]
    return scenes.write(folder, PARTS, sections, CAMERA, f"step = {STEP}\nsteps = {STEPS}\ndraw_every = 40\n", INITIAL, 0.25)


def _truth() -> list:
    from ..balance import Finish
    from ..fields import read, still

    finishes = {"floor": Finish(*FLOOR), "wall": Finish(*WALL)}
    surface, found = still(PARTS, finishes, BETA, INITIAL, STEP, [40, 80], 0.14, exchange=(0.25, 1024))
    return read(surface, CAMERA, found, only={"floor"})


CASES = [Case("floor_wall", _build, _truth, Bounds(rms=1.5, largest=4.0), parts=["floor", "wall"], finds="patches that do not resolve what they receive")]
