"""How far temperatures move if the states of an orbit are given one by one, and if images cut the steps.

PYTHONPATH=tools target/python/venv/bin/python -m serve_clients.same_states FOLDER, where FOLDER is one of tools/newcomer.
"""

import re
import sys
from pathlib import Path

import isotherm
import numpy as np

MU, EARTH_RADIUS, AU = 3.986004418e14, 6371e3, 149_597_870_700.0


def state(time: float, altitude: float, beta: float) -> dict[str, np.ndarray]:
    """Place, velocity, Sun and attitude of the tutorial's craft: -Z to the planet, +X along the flight, orbit noon at time 0."""
    radius = EARTH_RADIUS + altitude
    angle = np.sqrt(MU / radius**3) * time
    up = np.array([np.cos(angle), np.sin(angle), 0.0])
    forward = np.array([-np.sin(angle), np.cos(angle), 0.0])
    # Body X is forward, Y the orbit's normal, Z up: 90 deg about X, then the angle and 90 deg about the normal.
    half = 0.5 * (angle + np.pi / 2)
    w, z = np.cos(half), np.sin(half)
    quaternion = np.array([w, w, z, z]) * np.sqrt(0.5)
    sun = AU * np.array([np.cos(beta), 0.0, np.sin(beta)])
    speed = np.sqrt(MU / radius)
    return {"position": radius * up, "velocity": speed * forward, "sun": sun, "quaternion": quaternion}


def main() -> None:
    path = Path(sys.argv[1]) / "craft.toml"
    text = re.sub(r"^warm_up.*\n", "", path.read_text(), flags=re.MULTILINE)
    altitude, beta = (float(re.search(rf"^{key} = (\S+)", text, re.MULTILINE)[1]) for key in ("altitude", "beta_deg"))

    def temperatures(step: int, stop: int, placed: int | None = None) -> np.ndarray:
        """After 5280 s, with an image each `stop` s and a state each `placed` s."""
        simulation = isotherm.Simulation(path, text=text.replace("step = 60 ", f"step = {step} "))
        for end in range(0, 5281, stop):
            if placed:
                for time in range(max(end - stop, -placed) + placed, end + 1, placed):
                    simulation.place(float(time), **state(time, altitude, np.radians(beta)))
            simulation.step_to(float(end))
        return np.array(simulation.node_temperatures())

    for step, every in ((60, 10), (120, 30), (240, 30)):
        whole = temperatures(step, step)
        for what, other in ((f"states each {step} s", temperatures(step, step, step)), (f"images each {every} s", temperatures(step, every))):
            off = other - whole
            print(f"step {step} s, {what}: {np.sqrt((off**2).mean()):.4f} K rms, {np.abs(off).max():.4f} K at most", flush=True)


main()
