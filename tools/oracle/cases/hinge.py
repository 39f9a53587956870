"""A thin plate that turns on a joint towards a hot one and back at 0.2 deg/s: the infrared that both send follows the pose."""

from pathlib import Path

import numpy as np

from .. import gltf, scenes, shapes
from ..camera import Camera
from ..case import Bounds, Case

# The Sun shines along +Z on the back of the fixed plate; the turning one is in its shadow.
BETA, INITIAL, STEP, STEPS, EVERY = -90.0, 280.0, 10.0, 78, 13
FIRST, LAST, HALF = 2.0, 80.0, 390.0
PARTS = [
    gltf.Part("fixed", "hot", shapes.quad([0, -1, 0], [2, 0, 0], [0, 2, 0])),
    gltf.Part("turning", "thin", shapes.quad([0, -1, 0], [0, 2, 0], [0, 0, 2])),
]
CAMERA = Camera((5.0, -5.0, 3.5), (0.9, 0.0, 0.6), 33.0)
HOT, THIN = (0.3, 0.9, 1500.0, (0.9, 0.1)), (0.3, 0.85, 300.0, (0.3, 0.5))


def angle(time: float) -> float:
    """Turn of the plate [deg]."""
    return FIRST + (LAST - FIRST) * (time / HALF if time < HALF else 2 - time / HALF)


def _build(exchange: str, max_edge: float | None = None):
    def build(folder: Path) -> Path:
        joint = f'[[joint]]\npart = "turning"\naxis = "+Y"\nmode = "schedule"\nschedule = {{ time = [0, {HALF}, {2 * HALF}], angle_deg = [{FIRST}, {LAST}, {FIRST}] }}\n'
        sections = [scenes.still_sun(BETA), "[shadows]", exchange, joint, scenes.material("hot", *HOT), scenes.material("thin", *THIN)]
        return scenes.write(folder, PARTS, sections, CAMERA, f"step = {STEP}\nsteps = {STEPS}\ndraw_every = {EVERY}\n", INITIAL, max_edge)

    return build


def _placed(turn: float) -> np.ndarray:
    """The triangles of both plates, the second turned [deg]."""
    sine, cosine = np.sin(np.radians(turn)), np.cos(np.radians(turn))
    turned = PARTS[1].triangles @ np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]]).T
    return np.concatenate([PARTS[0].triangles, turned])


def _truth() -> list:
    from ..facing import Plate, rows

    plates = [Plate(2.0, HOT[1], HOT[3][1], HOT[2], HOT[3][0] * 1361.0), Plate(2.0, THIN[1], THIN[3][1], THIN[2])]
    placed = {number: _placed(angle(number * STEP)) for number in range(EVERY, STEPS + 1, EVERY)}
    part_of = np.repeat([0, 1], [len(part.triangles) for part in PARTS])
    knots = np.radians(90 - np.arange(LAST, FIRST - 1e-9, -2.0))
    return rows(plates, 2.0, lambda time: np.radians(90 - angle(time)), knots, INITIAL, STEP, placed, part_of, CAMERA, (30, 12), 500, {0, 1})


FINDS = "rows of another pose"
# By default the program chooses the edges. On edges of 0.2 m an element beside the hot plate is too large: what arrives there falls by 60 K within it.
CASES = [
    Case("hinge", _build("[exchange]"), _truth, Bounds(largest=3.0), data="hinge", parts=["fixed", "turning"], finds=FINDS, long=True),
    Case("hinge_1_deg", _build("[exchange]\nredraw_angle_deg = 1\n"), _truth, Bounds(largest=2.0), data="hinge", parts=["fixed", "turning"], finds="rows of the 64th pose for ever", long=True),
    Case("hinge_coarse", _build("[exchange]", 0.2), _truth, Bounds(rms=0.8, p99=3.0), data="hinge", parts=["fixed", "turning"], finds=FINDS),
]
