"""A foil of 77 J/(m2 K) that enters and leaves eclipse in steps of 15 s and of a minute, with the penumbra of the Sun's disc."""

from pathlib import Path

import numpy as np

from .. import gltf, scenes, shapes
from ..camera import Camera
from ..case import SIGMA, Bounds, Case
from ..orbit import Eclipse

ALTITUDE, RADIUS, PHASE, STEP, STEPS, INITIAL = 408e3, 6371e3, 95.0, 15.0, 220, 338.0
ABSORPTIVITY, EMISSIVITY, CAPACITY = 0.4, 0.63, 77.0
PARTS = [gltf.Part("foil", "foil", shapes.quad([0, -0.5, -0.5], [0, 1, 0], [0, 0, 1]))]
CAMERA = Camera((4.0, 0.0, 1.0), (0.0, 0.0, 0.0), 30.0, 32, 24)


def _build(response: str, step: float):
    def build(folder: Path) -> Path:
        sky = (
            f"[orbit]\naltitude = {ALTITUDE}\nbeta_deg = 0\nphase_deg = {PHASE}\n[attitude]\nmode = \"sun\"\nsun_axis = \"+X\"\nnorth_axis = \"+Z\"\n"
            f"[environment]\nsolar_constant = 1361.0\nplanet_radius = {RADIUS}\neclipse = true\n"
        )
        probe = '[[probe]]\nname = "middle"\nposition = [0, 0, 0]\n'
        skin = scenes.material("foil", ABSORPTIVITY, EMISSIVITY, CAPACITY, conducts=0.0 if response == "network" else None)
        time = f"step = {step}\nsteps = {round(STEP * STEPS / step)}\ndraw_steps = [0]\n"
        return scenes.write(folder, PARTS, [sky, skin, probe], CAMERA, time, INITIAL, None)

    return build


def _truth(step: float = STEP) -> list:
    from scipy.integrate import solve_ivp

    share = Eclipse(np.radians(PHASE), 0.0, RADIUS, RADIUS + ALTITUDE, STEP * STEPS)

    def rate(time: float, kelvin: np.ndarray) -> np.ndarray:
        return (ABSORPTIVITY * 1361.0 * share(time) - EMISSIVITY * SIGMA * kelvin**4) / CAPACITY

    steps = np.arange(round(STEP * STEPS / step) + 1) * step
    found = solve_ivp(rate, (0, steps[-1]), [INITIAL], "RK45", steps, max_step=0.5, rtol=1e-8, atol=1e-6)
    return [(number, 0, 0, -1, float(kelvin)) for number, kelvin in enumerate(found.y[0])]


FINDS = "steps across the penumbra with one mean load"
PROBE = ["probe:middle"]
CASES = [
    Case(f"eclipse_{response}", _build(response, STEP), _truth, Bounds(largest=0.5), data="eclipse", parts=PROBE, finds=FINDS)
    for response in ("radiative", "network")
] + [
    Case(f"eclipse_{response}_60", _build(response, 60.0), lambda: _truth(60.0), Bounds(largest=0.5), data="eclipse_60", parts=PROBE, finds=FINDS)
    for response in ("radiative", "network")
]
