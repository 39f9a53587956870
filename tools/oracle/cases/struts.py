"""Struts 1 m over light foil, which turns as slowly as a craft in orbit: their shadows are as wide as they move in a minute. Every place is followed by itself."""

from pathlib import Path

from .. import gltf, scenes, shapes
from ..camera import Camera
from ..case import Bounds, Case

BETA, RATE, INITIAL = 50.0, 0.065, 280.0
SKIN = (0.5, 0.85, 900.0)
STRUT = (0.3, 0.8, 3000.0)
PARTS = [
    gltf.Part("panel", "foil", shapes.box([-2, -2, -0.1], [2, 2, 0])),
    *[gltf.Part(f"strut_{k}", "strut", shapes.box([x - 0.03, -2, 0.97], [x + 0.03, 2, 1.03])) for k, x in enumerate((-1.2, -0.3, 0.6, 1.5))],
    gltf.Part("across", "strut", shapes.box([-2, -0.02, 1.05], [2, 0.02, 1.09])),
]
CAMERA = Camera((2.2, -2.6, 4.5), (0.0, 0.0, 0.0), 48.0)
STEP = 15
KEPT = (600, 1200, 1800, 2400)


def _build(step: int):
    def build(folder: Path) -> Path:
        skins = [scenes.material("foil", *SKIN), scenes.material("strut", *STRUT)]
        time = f"step = {step}\nsteps = {KEPT[-1] // step}\ndraw_every = {KEPT[0] // step}\n"
        return scenes.write(folder, PARTS, [scenes.spin(BETA, RATE), "[shadows]", *skins], CAMERA, time, INITIAL, 0.2)

    return build


def _truth() -> list:
    from ..balance import Finish
    from ..places import followed_in_pixels

    # The light of every 3 s.
    kept = [time // STEP for time in KEPT]
    return followed_in_pixels(PARTS, {"foil": Finish(*SKIN)}, CAMERA, scenes.turning_sun(BETA, RATE), INITIAL, STEP, kept, pieces=5, only={"panel"})


FINDS = "shadows of thin struts that pass between two looks at the Sun"
CASES = [
    Case("struts", _build(STEP), _truth, Bounds(rms=0.8), parts=["panel"], finds=FINDS),
    Case("struts_60", _build(4 * STEP), _truth, Bounds(rms=2.0), data="struts", table_steps=4, parts=["panel"], finds=FINDS),
]
