"""Arrays of a frame: their types, their memory, and the picture of a notebook."""

from __future__ import annotations

import gc
import pickle
import struct
from pathlib import Path

import numpy as np
import pytest
from support import SENSOR, Scenes, exr, program

import isotherm

TYPES = {
    "radiance": np.float32,
    "temperature": np.float32,
    "depth": np.float32,
    "part": np.uint32,
    "material": np.uint32,
    "dn": np.uint16,
    "counts": np.uint16,
}


def test_types_shapes_and_memory(scenes: Scenes) -> None:
    simulation = isotherm.Simulation(scenes.write(more=SENSOR))
    frame = simulation.image()
    for name, kind in TYPES.items():
        array = getattr(frame, name)
        assert (array.dtype, array.shape) == (kind, (72, 96)), name
        assert array.flags.c_contiguous and array.flags.writeable and array.flags.aligned
        # The same memory with each look, and a list of the image owns it: nothing was copied into an array of its own.
        assert getattr(frame, name) is array
        assert array.base is not None and not array.flags.owndata
    assert (
        frame.coverage.dtype == np.float32 and frame.reflected is None and frame.error is None and frame.budget is None
    )


def test_arrays_outlive_frame_and_simulation(scene: Path) -> None:
    simulation = isotherm.Simulation(scene)
    frame = simulation.image()
    temperature, copy = frame.temperature, frame.temperature.copy()
    simulation.step_to(500)
    simulation.image()
    assert (temperature == copy).all(), "a later image has memory of its own"
    del frame, simulation
    gc.collect()
    assert (temperature == copy).all()
    temperature[:] = 0


def test_without_a_sensor_there_are_no_numbers(scene: Path) -> None:
    frame = isotherm.Simulation(scene).image()
    assert frame.dn is None and frame.counts is None


def test_a_notebook_shows_a_picture(scene: Path) -> None:
    frame = isotherm.Simulation(scene).image()
    png = frame._repr_png_()
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    width, height = struct.unpack(">II", png[16:24])
    assert width > 320 and height > 200
    assert frame._repr_png_() == png
    frame.temperature[frame.part > 0] += 40
    assert frame._repr_png_() != png


def test_descriptions(scene: Path) -> None:
    simulation = isotherm.Simulation(scene)
    assert repr(simulation).startswith("Simulation('cubesat' on ")
    assert repr(simulation.image()) == "Frame(time=0, 96 x 72 pixels)"
    for kind in (isotherm.Simulation, isotherm.Frame, isotherm.Camera, isotherm.Sky, isotherm.PartTemperature):
        assert kind.__doc__
        for name, member in vars(kind).items():
            if not name.startswith("_"):
                assert member.__doc__, f"{kind.__name__}.{name}"
    for name in ("radiance", "temperature", "depth", "node_temperatures", "node_positions", "step_to"):
        owner = isotherm.Frame if hasattr(isotherm.Frame, name) else isotherm.Simulation
        assert "[" in getattr(owner, name).__doc__, f"{name} states a unit"


@pytest.mark.parametrize("name", ["radiance", "dn", "camera"])
def test_a_frame_is_not_changed(scene: Path, name: str) -> None:
    with pytest.raises(AttributeError):
        setattr(isotherm.Simulation(scene).image(), name, None)


def test_uncertainty_is_that_of_a_run(scenes: Scenes, tmp_path: Path) -> None:
    asks = '\n[uncertainty]\n[[uncertainty.parameter]]\nvary = "solar_constant"\npercent = 4\n'
    path = scenes.write(("steps = 556", "steps = 20"), more=asks)
    program("run", path, "-o", tmp_path / "out", "--device", "cpu")
    with isotherm.Simulation(path, device="cpu") as simulation:
        assert simulation.image().T_sigma is None
        simulation.find_sigma()
        simulation.step_to(200)
        frame = simulation.image()
        stored = exr(tmp_path / "out" / "frames" / "step_000020.exr")["T_sigma"]
        assert frame.T_sigma is not None and frame.cause is not None and frame.cause.dtype == np.uint32
        off = np.abs(frame.T_sigma - stored).max()
        assert off < 0.01 * stored.max() < np.abs(1.1 * frame.T_sigma - stored).max()
        assert "solar_constant" in frame.causes and frame.cause.max() <= len(frame.causes)
        simulation.step_to(210)
        assert simulation.image().T_sigma is None, "the run ends at 200 s"


def test_errors_are_those_of_a_run(scenes: Scenes, tmp_path: Path) -> None:
    path = scenes.write(("steps = 556", "steps = 20"), more="\n[shadows]\n[output]\nerror = true\n")
    program("run", path, "-o", tmp_path / "out")
    simulation = isotherm.Simulation(path)
    for step in (10, 20):
        simulation.step_to(10.0 * step)
        error = simulation.image().error
        assert error is not None and error.dtype == np.float32 and error.max() > 0
        for other in (10, 20):
            stored = exr(tmp_path / "out" / "frames" / f"step_{other:06}.exr")["error"]
            assert (stored.tobytes() == error.tobytes()) == (other == step)


def test_budgets_are_those_of_a_run(scenes: Scenes, tmp_path: Path) -> None:
    path = scenes.write(("steps = 556", "steps = 20"), more="\n[shadows]\n[output]\nbudget = true\n")
    program("run", path, "-o", tmp_path / "out")
    simulation = isotherm.Simulation(path)
    simulation.step_to(200.0)
    frame = simulation.image()
    names = ["sun", "albedo", "planet", "exchange", "conduction", "heater", "stored", "emitted"]
    assert list(frame.budget) == [f"Q_{name}" for name in names]
    stored = exr(tmp_path / "out" / "frames" / "step_000020.exr")
    for name, gains in frame.budget.items():
        assert gains.dtype == np.float32 and gains.shape == frame.part.shape
        assert stored[name].tobytes() == gains.tobytes(), name
    total = sum(gains.astype(np.float64) for gains in frame.budget.values())
    assert np.abs(total).max() <= 1e-4 * np.abs(frame.budget["Q_emitted"]).max() > 0


def test_bands_are_those_of_a_run(scenes: Scenes, tmp_path: Path) -> None:
    bands = """
[[band]]
name = "thermal"
band_um = [8, 14]
noise = 0.02
[[band]]
name = "long"
band_um = [11, 14]
noise = 0.02
[[band]]
name = "visible"
band_um = [0.4, 0.8]
[band.sensor]
radiance_noise = 0.2
radiance_range = [0, 300]
[output]
ratio = ["thermal", "long"]
"""
    plain = ("[radiance]\nband_um = [8.0, 14.0]\n", "")
    path = scenes.write(("steps = 556", "steps = 20"), plain, more=bands)
    program("run", path, "-o", tmp_path / "out")
    simulation = isotherm.Simulation(path)
    assert simulation.image().bands_dn.keys() == {"visible"}
    simulation.step_to(200.0)
    frame = simulation.image()
    assert list(frame.bands) == ["thermal", "long", "visible"]
    stored = exr(tmp_path / "out" / "frames" / "step_000020.exr")
    for name, radiance in frame.bands.items():
        assert radiance.dtype == np.float32 and radiance.shape == frame.part.shape
        assert stored[f"{name}.L"].tobytes() == radiance.tobytes(), name
    assert frame.bands["thermal"].tobytes() == frame.radiance.tobytes()
    assert frame.bands_dn["visible"].dtype == np.uint16
    assert frame.ratio is not None
    temperature, error = frame.ratio
    assert temperature.tobytes() == stored["T_ratio"].tobytes() and error.tobytes() == stored["T_ratio_error"].tobytes()
    restored = pickle.loads(pickle.dumps(frame))
    assert restored.bands["long"].tobytes() == frame.bands["long"].tobytes() and restored.ratio is not None
    scenes.write(("steps = 556", "steps = 20"), name="plain.toml")
    frame = isotherm.Simulation(scenes.folder / "plain.toml").image()
    assert frame.bands == {} and frame.bands_dn == {} and frame.ratio is None
