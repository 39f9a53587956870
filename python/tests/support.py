"""The satellite of ``models/``, the program, and readers of its images."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import OpenEXR

import isotherm

REPOSITORY = Path(__file__).resolve().parents[2]
MODELS = REPOSITORY / "models"
SENSOR = """
[sensor]
netd = 0.05
range = [150, 400]
time_constant = 20
kelvin_per_count = 0.01
"""


class Scenes:
    """A folder with the satellite and scenes of it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        for name in ("cubesat.glb", "materials.toml"):
            shutil.copy(MODELS / name, folder / name)
        self.text = (MODELS / "cubesat.toml").read_text()

    def write(self, *changes: tuple[str, str], more: str = "", name: str = "scene.toml") -> Path:
        """The scene with texts exchanged. It is small and has no warm-up, so that tests are quick."""
        text = self.text
        for before, after in [
            ("warm_up_orbits = 1\n", ""),
            ("width = 320\nheight = 240", "width = 96\nheight = 72"),
            *changes,
        ]:
            assert before in text, before
            text = text.replace(before, after)
        path = self.folder / name
        path.write_text(text + more)
        return path


def program(*arguments: object) -> None:
    """Runs ``isotherm``: that of ISOTHERM_PROGRAM, or of the last build."""
    path = os.environ.get("ISOTHERM_PROGRAM", str(REPOSITORY / "target/debug/isotherm"))
    ran = subprocess.run([path, *map(str, arguments)], capture_output=True, text=True, timeout=300)
    assert ran.returncode == 0, ran.stderr


CHANNELS = {
    "L": "radiance",
    "T": "temperature",
    "T_error": "error",
    "Z": "depth",
    "part": "part",
    "material": "material",
}


def exr(path: Path) -> dict[str, np.ndarray]:
    """Channels of an EXR file, by the names of ``isotherm.Frame``. OpenEXR's own library reads it."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return {CHANNELS.get(name, name): np.array(channel.pixels) for name, channel in file.channels().items()}


def fits(path: Path) -> np.ndarray:
    """Numbers of a FITS file of 16 bits. Its last row is the top of the image."""
    data = path.read_bytes()
    end = data.index(b"END     ")
    cards = [data[i : i + 80].decode("ascii") for i in range(0, end, 80)]
    values = {card[:8].strip(): card[10:].split("/")[0].strip() for card in cards}
    width, height = int(values["NAXIS1"]), int(values["NAXIS2"])
    assert (values["BITPIX"], float(values["BZERO"])) == ("16", 32768.0)
    start = -(-(end + 80) // 2880) * 2880
    numbers = np.frombuffer(data, ">i2", width * height, start).astype(np.int32) + 32768
    return numbers.astype(np.uint16).reshape(height, width)[::-1]


def same(frame: isotherm.Frame, channels: dict[str, np.ndarray]) -> list[str]:
    """Names of the channels that differ from a file's in any bit."""
    differing = []
    for name in channels:
        own = getattr(frame, name)
        if own.shape != channels[name].shape or own.tobytes() != channels[name].astype(own.dtype).tobytes():
            differing.append(name)
    return differing
