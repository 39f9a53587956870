"""Two sheets of foil close together, as in a sunshield: light and infrared go to and fro between them many times, and leave by the rim alone.
Patches wider than the gap spread the light that they reflect, so a coarse mesh is too warm inside, which its stated error has to tell."""

from pathlib import Path

import numpy as np

from .. import gltf, scenes, shapes
from ..camera import Camera
from ..case import Bounds, Case

BETA, INITIAL, STEP, STEPS = 50.0, 260.0, 60.0, 60
GAP = 0.02
PARTS = [
    gltf.Part("warm", "warm", shapes.quad([-0.3, -0.3, GAP], [0.6, 0, 0], [0, 0.6, 0])),
    gltf.Part("cold", "cold", shapes.quad([-0.4, -0.3, 0], [0, 0.6, 0], [0.7, 0, 0])),
]
# The cold sheet from below.
CAMERA = Camera((-0.4, -0.5, -2.2), (-0.05, 0.0, 0.0), 22.0)
WARM, COLD = (0.5, 0.8, 600.0, (0.08, 0.05)), (0.3, 0.4, 400.0, (0.08, 0.05))




def _build(max_edge: float | None):
    def build(folder: Path) -> Path:
        sections = [scenes.still_sun(BETA), "[shadows]", "[exchange]", scenes.material("warm", *WARM), scenes.material("cold", *COLD)]
        return scenes.write(folder, PARTS, sections, CAMERA, f"step = {STEP}\nsteps = {STEPS}\ndraw_every = 30\n", INITIAL, max_edge)

    return build


def _truth() -> list:
    from ..balance import Finish
    from ..fields import groups, still
    from ..pixels import seen
    from ..rays import Rays

    surface, found = still(PARTS, {"warm": Finish(*WARM), "cold": Finish(*COLD)}, BETA, INITIAL, STEP, [30, 60], 0.02, exchange=(0.02, 2048), samples=64, divide=2)
    pixels = seen(CAMERA, Rays(surface.triangles), groups(surface), 1200)
    # The edges of shadows near the rim are sharper than this mesh.
    x, y = pixels.place[:, 0], pixels.place[:, 1]
    inside = np.flatnonzero((np.abs(y) < 0.28) & (x > -0.28) & (x < 0.24))
    return [(step, int(pixels.u[n]), int(pixels.v[n]), 1, float(kelvin[n])) for step, field in sorted(found.items()) for kelvin in [surface.at(pixels.triangle, pixels.place, field)] for n in inside]


CASES = [
    Case("gap", _build(None), _truth, Bounds(rms=1.5, largest=8.0), parts=["warm", "cold"], finds="light that goes to and fro in a narrow gap of foil"),
    # The bound is of what so coarse a mesh can do; the case is there for what the program states of it.
    Case("gap_coarse", _build(0.1), _truth, Bounds(rms=7.0), data="gap", parts=["warm", "cold"], finds="its stated error on patches that are wider than the gap"),
]
