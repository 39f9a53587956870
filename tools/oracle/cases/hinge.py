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


def _build(exchange: str):
    def build(folder: Path) -> Path:
        joint = f'[[joint]]\npart = "turning"\naxis = "+Y"\nmode = "schedule"\nschedule = {{ time = [0, {HALF}, {2 * HALF}], angle_deg = [{FIRST}, {LAST}, {FIRST}] }}\n'
        sections = [scenes.still_sun(BETA), "[shadows]", exchange, joint, scenes.material("hot", *HOT), scenes.material("thin", *THIN)]
        return scenes.write(folder, PARTS, sections, CAMERA, f"step = {STEP}\nsteps = {STEPS}\ndraw_every = {EVERY}\n", INITIAL, 0.2)

    return build


def _truth() -> list:
    from ..balance import Absorbed, Balance, Finish
    from ..fields import read
    from ..lit import sunlight
    from ..radiosity import Radiosity, patches_of
    from ..still import sun_at
    from ..surface import Surface

    surface = Surface(PARTS, 0.15)
    balance = Balance(surface, {"hot": Finish(*HOT), "thin": Finish(*THIN)})
    patches = patches_of(surface, balance.side, 0.2)
    moving = surface.vertices.copy()
    on_plate = surface.vertex_part == 1

    def placed(turn: float) -> np.ndarray:
        sine, cosine = np.sin(np.radians(turn)), np.cos(np.radians(turn))
        places = moving.copy()
        places[on_plate] = moving[on_plate] @ np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]]).T
        return places[surface.faces]

    turns = np.arange(FIRST, LAST + 1e-9, 2.0)
    poses = [Absorbed(balance, Radiosity(surface, balance.side, 0.2, 512, triangles=placed(turn), patches=patches)) for turn in turns]
    lights = []
    for turn, pose in zip(turns, poses, strict=True):
        direct = sunlight(surface, balance.side, sun_at(BETA), 16, triangles=placed(turn))
        lights.append(pose.light(direct, np.zeros_like(direct)))

    def absorbed(time: float, kelvin: np.ndarray) -> np.ndarray:
        place = min(max((angle(time) - FIRST) / 2.0, 0.0), len(turns) - 1 - 1e-9)
        low = int(place)
        both = [poses[low + n].total(*lights[low + n], kelvin) for n in (0, 1)]
        return both[0] * (1 - place + low) + both[1] * (place - low)

    keep = list(range(EVERY, STEPS + 1, EVERY))
    found = balance.run(INITIAL, STEP, STEPS, absorbed, keep, parts=2)
    table = []
    for number in keep:
        surface.triangles = placed(angle(number * STEP))
        surface.normals = gltf.flat_normals(surface.triangles)
        table += read(surface, CAMERA, {number: found[number]}, 500)
    return table


CASES = [
    Case("hinge", _build("[exchange]"), _truth, Bounds(largest=3.0), data="hinge", parts=["fixed", "turning"], finds="rows of another pose"),
    Case("hinge_1_deg", _build("[exchange]\nredraw_angle_deg = 1\n"), _truth, Bounds(largest=2.0), data="hinge", parts=["fixed", "turning"], finds="rows of the 64th pose for ever"),
]
