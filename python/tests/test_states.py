"""States, and what is set from outside."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from support import SENSOR, Scenes, exr, program, same

import isotherm

RADIUS = 6371e3 + 408e3


@pytest.mark.parametrize("device", [None, "cpu"])
def test_a_restored_state_goes_on_as_before(scenes: Scenes, device: str | None) -> None:
    simulation = isotherm.Simulation(scenes.write(more=SENSOR), device=device)
    simulation.step_to(155)
    saved = simulation.save()
    simulation.step_to(400)
    late = simulation.image()
    simulation.restore(saved)
    assert simulation.time == 155
    early = simulation.image()
    simulation.restore(saved)
    simulation.step_to(400)
    again = simulation.image()
    for name in ("radiance", "temperature", "dn"):
        assert getattr(again, name).tobytes() == getattr(late, name).tobytes(), name
        assert getattr(again, name).tobytes() != getattr(early, name).tobytes(), name
    other = isotherm.Simulation(
        scenes.write(("thickness = 0.0015", "thickness = 0.002"), name="other.toml"), device=device
    )
    with pytest.raises(isotherm.RequestError, match="other"):
        other.restore(saved)


def test_the_program_takes_a_state(scenes: Scenes) -> None:
    scene = scenes.write()
    simulation = isotherm.Simulation(scene)
    simulation.step_to(700)
    state, file = scenes.folder / "warm.state", scenes.folder / "image.exr"
    state.write_bytes(simulation.save())
    program("render", scene, "--time", 60, "--from-state", state, "-o", file)
    simulation.restore(state.read_bytes(), time=0)
    simulation.step_to(60)
    assert same(simulation.image(), exr(file)) == []
    cold = isotherm.Simulation(scene)
    cold.step_to(60)
    assert "temperature" in same(cold.image(), exr(file))


def test_a_joint_is_held_where_it_is_set(scene: Path) -> None:
    simulation = isotherm.Simulation(scene)
    assert list(simulation.joints) == ["hinge_port", "hinge_starboard"]
    before = simulation.image()
    simulation.set_joint("hinge_starboard", 0.7)
    assert simulation.joints["hinge_starboard"] == pytest.approx(0.7)
    assert (simulation.image().depth != before.depth).any()
    simulation.step_to(300)
    assert simulation.joints["hinge_starboard"] == pytest.approx(0.7)
    assert simulation.joints["hinge_port"] != pytest.approx(0.7)


def test_an_attitude_from_outside(scene: Path) -> None:
    simulation = isotherm.Simulation(scene)
    simulation.begin()
    # The body turns about the inertial Z by 0.01 rad a second.
    for second in range(1, 6):
        angle = 0.01 * second
        simulation.place(second, quaternion=(math.cos(angle / 2), 0, 0, math.sin(angle / 2)))
        simulation.step_to(second)
        turned = np.array([[math.cos(angle), math.sin(angle), 0], [-math.sin(angle), math.cos(angle), 0], [0, 0, 1]])
        assert np.allclose(simulation.sky.body_from_inertial, turned, atol=1e-9)
    with pytest.raises(isotherm.RequestError):
        simulation.step_to(6)
    with pytest.raises(isotherm.RequestError):
        simulation.place(5, quaternion=(1, 0, 0, 0))


def test_sun_and_position_from_outside(scene: Path) -> None:
    """Behind the planet it is dark, before it the Sun shines."""
    hot = {}
    for side in (-1, 1):
        simulation = isotherm.Simulation(scene)
        for time in (0, 600):
            place = {"position": (side * RADIUS, 0, 0), "velocity": (0, 7.7e3, 0), "sun": (1.5e11, 0, 0)}
            simulation.place(time, quaternion=(1, 0, 0, 0), **place)  # type: ignore[arg-type]
        simulation.step_to(600)
        assert np.allclose(simulation.sky.sun_direction, [1, 0, 0], atol=1e-4)
        assert simulation.sky.lit_fraction == (1 if side > 0 else 0)
        hot[side] = simulation.part_temperatures()["body"].mean
    assert hot[1] > hot[-1] + 20
