"""A craft that spins by 7.5 deg a step: a mast throws a shadow that sweeps over light paint, and faces turn into the Sun. Every place is followed by itself."""

from pathlib import Path

from .. import gltf, scenes, shapes
from ..camera import Camera
from ..case import Bounds, Case

BETA, RATE, INITIAL, STEP, STEPS = 30.0, 0.5, 290.0, 15.0, 48
PARTS = [
    gltf.Part("body", "paint", shapes.box([-1, -1, -0.5], [1, 1, 0.5])),
    gltf.Part("mast", "black", shapes.box([-0.1, -0.1, 0.5], [0.1, 0.1, 1.9])),
    gltf.Part("horn", "foil", shapes.box([0.5, 0.4, 0.5], [0.9, 0.8, 1.0])),
]
SKINS = {"paint": (0.3, 0.85, 600.0), "black": (0.95, 0.9, 2500.0), "foil": (0.4, 0.6, 250.0)}
CAMERA = Camera((3.0, -4.0, 4.0), (0.0, 0.0, 0.3), 36.0)


def _build(max_edge: float):
    def build(folder: Path) -> Path:
        skins = [scenes.material(name, *skin) for name, skin in SKINS.items()]
        return scenes.write(folder, PARTS, [scenes.spin(BETA, RATE), "[shadows]", *skins], CAMERA, f"step = {STEP}\nsteps = {STEPS}\ndraw_every = 24\n", INITIAL, max_edge)

    return build


def _truth() -> list:
    from ..balance import Finish
    from ..places import followed_in_pixels

    finishes = {name: Finish(*skin) for name, skin in SKINS.items()}
    return followed_in_pixels(PARTS, finishes, CAMERA, scenes.turning_sun(BETA, RATE), INITIAL, STEP, [24, 48], pieces=10)


FINDS = "light that is found once in a step in which it turns far"
PART_NAMES = [part.name for part in PARTS]
CASES = [
    Case("spin_coarse", _build(0.2), _truth, Bounds(rms=1.0), data="spin", parts=PART_NAMES, finds=FINDS),
    Case("spin_fine", _build(0.05), _truth, Bounds(rms=0.7), data="spin", parts=PART_NAMES, finds=FINDS),
]
