"""A craft that spins by 7.5 deg a step: a mast throws a shadow that sweeps over light paint, and faces turn into the Sun. Every place is followed by itself."""

from pathlib import Path

import numpy as np

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


def _sun(time: float) -> tuple[np.ndarray, float]:
    """Direction of the Sun in the body, which turns about +Z, and its flux [W/m2]."""
    turn, beta = np.radians(RATE * time), np.radians(BETA)
    return np.array([np.cos(beta) * np.cos(turn), -np.cos(beta) * np.sin(turn), np.sin(beta)]), 1361.0


def _build(max_edge: float):
    def build(folder: Path) -> Path:
        sky = scenes.still_sun(BETA).replace('mode = "inertial"', f'mode = "spin"\nspin_axis = "+Z"\nrate_deg = {RATE}')
        skins = [scenes.material(name, *skin) for name, skin in SKINS.items()]
        return scenes.write(folder, PARTS, [sky, "[shadows]", *skins], CAMERA, f"step = {STEP}\nsteps = {STEPS}\ndraw_every = 24\n", INITIAL, max_edge)

    return build


def _truth() -> list:
    from .. import pixels, rays
    from ..balance import Finish
    from ..places import followed

    triangles = np.concatenate([part.triangles for part in PARTS])
    part_of = np.repeat(np.arange(len(PARTS)), [len(part.triangles) for part in PARTS])
    normals = gltf.flat_normals(triangles)
    scene = rays.Rays(triangles)
    _, plane = np.unique(np.round(np.column_stack([part_of, normals, (normals * triangles[:, 0]).sum(1)]), 3), axis=0, return_inverse=True)
    seen = pixels.seen(CAMERA, scene, plane.ravel(), 1200)
    part = part_of[seen.triangle]
    table = []
    for number, each in enumerate(PARTS):
        own = np.flatnonzero(part == number)
        found = followed(seen.place[own], normals[seen.triangle[own]], Finish(*SKINS[each.material]), scene, _sun, lambda _: 0.0, INITIAL, STEP, [24, 48], parts=10, samples=16)
        table += [(step, int(seen.u[k]), int(seen.v[k]), number, float(kelvin)) for step, all_of in found.items() for k, kelvin in zip(own, all_of, strict=True)]
    return table


FINDS = "light that is found once in a step in which it turns far"
PART_NAMES = [part.name for part in PARTS]
CASES = [
    Case("spin_coarse", _build(0.2), _truth, Bounds(rms=1.0), data="spin", parts=PART_NAMES, finds=FINDS),
    Case("spin_fine", _build(0.05), _truth, Bounds(rms=0.7), data="spin", parts=PART_NAMES, finds=FINDS),
]
