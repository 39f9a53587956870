"""A white floor over which the Sun rises by 1 deg a step, and a black foil along the Sun's way that receives nothing but what the floor reflects."""

from pathlib import Path

import numpy as np

from .. import gltf, scenes, shapes
from ..camera import Camera
from ..case import Bounds, Case

# The Sun stands at +Z, and the body turns about +X from -60 deg on.
RATE, FIRST, INITIAL, STEP, STEPS, EVERY = 1.0 / 15.0, -60.0, 250.0, 15.0, 48, 12
PARTS = [
    gltf.Part("floor", "white", shapes.quad([0, -1, 0], [2, 0, 0], [0, 2, 0])),
    gltf.Part("wall", "foil", shapes.quad([0, -1, 0], [0, 2, 0], [0, 0, 2])),
]
CAMERA = Camera((5.0, -5.0, 3.5), (0.9, 0.0, 0.6), 33.0)
WHITE, FOIL = (0.2, 0.85, 6000.0, (0.0, 0.3)), (0.9, 0.85, 300.0, (0.0, 0.05))


def _build(folder: Path) -> Path:
    half = np.radians(FIRST) / 2
    turns = f'mode = "spin"\nspin_axis = "+X"\nrate_deg = {RATE}\nquaternion = [{np.cos(half)}, {np.sin(half)}, 0, 0]'
    sky = scenes.still_sun(90.0).replace('mode = "inertial"\nquaternion = [1, 0, 0, 0]', turns)
    sections = [sky, "[shadows]", "[exchange]", scenes.material("white", *WHITE), scenes.material("foil", *FOIL)]
    return scenes.write(folder, PARTS, sections, CAMERA, f"step = {STEP}\nsteps = {STEPS}\ndraw_every = {EVERY}\n", INITIAL, None)


def _truth() -> list:
    from ..facing import Plate, rows

    def direct(time: float) -> float:
        return 1361.0 * float(np.cos(np.radians(FIRST + RATE * time)))

    plates = [Plate(2.0, WHITE[1], WHITE[3][1], WHITE[2], 0.0, WHITE[0], direct), Plate(2.0, FOIL[1], FOIL[3][1], FOIL[2], 0.0, FOIL[0])]
    triangles = np.concatenate([part.triangles for part in PARTS])
    part_of = np.repeat([0, 1], [len(part.triangles) for part in PARTS])
    angle = 0.5 * np.pi
    return rows(plates, 2.0, lambda _: angle, np.array([angle]), INITIAL, STEP, {step: triangles for step in range(EVERY, STEPS + 1, EVERY)}, part_of, CAMERA, (60, 24), 600, {0, 1})


CASES = [Case("rise", _build, _truth, Bounds(rms=1.0, p99=5.0), parts=["floor", "wall"], finds="reflected light that is late by half of the time for which it is held")]
