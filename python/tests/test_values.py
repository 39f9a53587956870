"""Values equal those of the command line, bit for bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support import CHANNELS, SENSOR, Scenes, exr, fits, program, same

import isotherm

WARM = ("steps = 556\n", "steps = 556\nwarm_up_orbits = 0.05\n")
REFLECTING = ("band_um = [8.0, 14.0]\n", 'band_um = [8.0, 14.0]\nreflections = "environment"\nbackground = "planet"\n')
MANY = ("up = [0, 0, -1]\n", "up = [0, 0, -1]\nsamples = 4\n")


@pytest.mark.parametrize("device", [None, "cpu"])
@pytest.mark.parametrize("changes", [[WARM], [WARM, MANY], [WARM, REFLECTING]], ids=["plain", "samples", "reflections"])
def test_an_image_is_that_of_render(scenes: Scenes, changes: list[tuple[str, str]], device: str | None) -> None:
    scene = scenes.write(*changes)
    file = scenes.folder / "image.exr"
    # The last step is shorter.
    program("render", scene, "--time", 247.5, "-o", file, *(["--device", device] if device else []))
    simulation = isotherm.Simulation(scene, device=device)
    simulation.step_to(247.5)
    frame = simulation.image()
    channels = exr(file)
    assert set(CHANNELS.values()) - {"error"} <= set(channels)
    assert same(frame, channels) == []
    assert (frame.part > 0).any() and (frame.temperature > 200).any()
    # A millisecond makes a difference.
    simulation.step_to(247.501)
    assert "temperature" in same(simulation.image(), channels)


def test_images_and_numbers_are_those_of_a_run(scenes: Scenes) -> None:
    changes = [WARM, ("steps = 556", "steps = 12"), ("draw_every = 10", "draw_every = 4")]
    files = '\n[output]\nfiles = ["dn.fits", "kelvin.tiff"]\n'
    scene = scenes.write(*changes, more=SENSOR + files)
    out = scenes.folder / "out"
    program("run", scene, "-o", out)
    simulation = isotherm.Simulation(scene)
    before: np.ndarray | None = None
    for step in (0, 4, 8, 12):
        simulation.step_to(10.0 * step)
        frame = simulation.image()
        assert same(frame, exr(out / f"frames/step_{step:06}.exr")) == []
        [numbers] = (out / "frames").glob(f"step_{step:06}*.fits")
        assert frame.dn is not None and frame.counts is not None
        assert (frame.dn == fits(numbers)).all()
        [counts] = (out / "frames").glob(f"step_{step:06}*.tiff")
        # The one strip of the file stands at its end.
        assert frame.counts.astype("<u2").tobytes() == counts.read_bytes()[-2 * frame.counts.size :]
        # Noise follows from the time: another image has other numbers.
        assert before is None or (before != frame.dn).any()
        before = frame.dn


def test_temperatures_of_nodes_and_parts(scene: Path) -> None:
    simulation = isotherm.Simulation(scene, device="cpu")
    simulation.step_to(600)
    temperatures, parts = simulation.node_temperatures(), simulation.node_parts()
    assert temperatures.shape == parts.shape == (simulation.nodes,)
    assert (temperatures.dtype, parts.dtype) == (np.float32, np.uint32)
    assert simulation.node_positions().shape == (simulation.nodes, 3)
    of_parts = simulation.part_temperatures()
    assert list(of_parts) == simulation.parts == ["body", "lens", "wing_port", "wing_starboard"]
    for index, (name, part) in enumerate(of_parts.items()):
        own = temperatures[parts == index]
        assert (own.min(), own.max()) == (part.min, part.max), name
        assert part.min - 1e-9 <= part.mean <= part.max + 1e-9
    wing = simulation.node_positions()[parts == simulation.parts.index("wing_starboard")]
    assert wing[:, 1].min() == pytest.approx(0.12, abs=1e-6) and wing[:, 1].max() == pytest.approx(0.72, abs=1e-6)


def test_a_scene_from_a_text(scenes: Scenes) -> None:
    scene = scenes.write()
    one = isotherm.Simulation(scene).image()
    other = isotherm.Simulation(scenes.folder / "absent.toml", text=scene.read_text()).image()
    assert (one.radiance == other.radiance).all()
