"""Errors are exceptions with file, line and key."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import pytest
from support import Scenes

import isotherm


def test_a_wrong_value(scenes: Scenes) -> None:
    scene = scenes.write(("beta_deg = 20", "beta_deg = 200"))
    with pytest.raises(isotherm.SceneError) as raised:
        isotherm.Simulation(scene)
    error = raised.value
    assert error.file == str(scene)
    assert error.line == scene.read_text().splitlines().index("beta_deg = 200") + 1
    assert error.key is not None and error.key.endswith("beta_deg")
    assert f"{scene}:{error.line}" in str(error) and "200" in str(error)
    assert isinstance(error, ValueError) and isinstance(error, isotherm.IsothermError)
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again), again.file, again.line, again.key) == (
        isotherm.SceneError,
        str(error),
        error.file,
        error.line,
        error.key,
    )


def test_files_that_are_missing(scenes: Scenes) -> None:
    absent = scenes.folder / "absent.toml"
    with pytest.raises(isotherm.SceneError, match="absent.toml") as raised:
        isotherm.Simulation(absent)
    assert raised.value.file == str(absent)
    with pytest.raises(isotherm.SceneError, match="nothing.glb"):
        isotherm.Simulation(scenes.write(("cubesat.glb", "nothing.glb")))


def test_a_file_outside_needs_leave(scenes: Scenes) -> None:
    inside = scenes.folder / "inside"
    inside.mkdir()
    scene = inside / "scene.toml"
    scene.write_text(
        scenes.write(('"cubesat.glb"', '"../cubesat.glb"'), ('"materials.toml"', '"../materials.toml"')).read_text()
    )
    with pytest.raises(isotherm.SceneError, match="outside"):
        isotherm.Simulation(scene)
    isotherm.Simulation(scene, allow_outside=True)


@pytest.mark.parametrize(
    ("arguments", "kind", "words"),
    [
        ({"position": (1, 2, 3)}, TypeError, "quaternion= or|look_at="),
        ({"position": (1, 2, 3), "quaternion": (1, 0, 0, 0), "look_at": (0, 0, 0)}, TypeError, "look_at="),
        ({"look_at": (0, 0, 0)}, TypeError, "position="),
        ({"position": (1, 2), "look_at": (0, 0, 0)}, isotherm.RequestError, "position must have 3 numbers, not 2"),
        ({"position": "abc", "look_at": (0, 0, 0)}, TypeError, "position must have 3 numbers"),
        ({"position": (1, 2, 3), "quaternion": (2, 0, 0, 0)}, isotherm.RequestError, "length 1"),
        ({"position": (float("nan"), 2, 3), "quaternion": (1, 0, 0, 0)}, isotherm.RequestError, "finite"),
        ({"position": (0, 0, 3), "look_at": (0, 0, 0)}, isotherm.RequestError, "along the direction that is up"),
        ({"position": (3, 0, 0), "look_at": (0, 0, 0), "frame": "moon"}, isotherm.RequestError, "'moon'"),
    ],
)
def test_poses_that_are_none(scene: Path, arguments: dict[str, Any], kind: type[Exception], words: str) -> None:
    simulation = isotherm.Simulation(scene)
    with pytest.raises(kind, match=words):
        simulation.image(**arguments)
    simulation.image()


def test_calls_that_can_not_be_answered(scene: Path) -> None:
    simulation = isotherm.Simulation(scene)
    simulation.step_to(100)
    for time in (50, float("nan"), float("inf")):
        with pytest.raises(isotherm.RequestError, match="can not step to|is no time"):
            simulation.step_to(time)
    with pytest.raises(isotherm.RequestError, match="there is no joint 'x'"):
        simulation.set_joint("x", 0)
    with pytest.raises(isotherm.RequestError, match="is no saved state"):
        simulation.restore(b"nothing")
    with pytest.raises(isotherm.RequestError, match="state"):
        simulation.restore(simulation.save()[:-7])
    with pytest.raises(isotherm.RequestError, match="width must be"):
        isotherm.Camera(0, 10, fx=10)
    with pytest.raises(isotherm.RequestError, match="width must be"):
        isotherm.Camera(-1, 5, fx=10)
    with pytest.raises(isotherm.RequestError, match="length 1"):
        simulation.place(200, position=(7e6, 0, 0), sun=(1.5e11, 0, 0), quaternion=(2, 0, 0, 0))
    with pytest.raises(TypeError, match="distortion"):
        isotherm.Camera(10, 10, fx=10, distortion=[1.0])
    with pytest.raises(TypeError):
        simulation.camera.replace(fov=3)
    assert simulation.time == 100


def test_a_device_that_is_not_there(scene: Path) -> None:
    with pytest.raises(isotherm.DeviceError, match="no such thing") as raised:
        isotherm.Simulation(scene, device="no such thing")
    assert isinstance(raised.value, RuntimeError) and raised.value.file is None
    assert len(isotherm.devices()) >= 1
