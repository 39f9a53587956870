"""A data set as the checks see it: its orbits, images and EXR files, and a way to say what was found."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import OpenEXR

SPLITS = ("train", "val", "test")
# OpenCV's pixels less those of the EXR files.
OPENCV_PIXEL = -0.5


@dataclass(frozen=True)
class Image:
    """One image."""

    root: Path
    split: str
    orbit: int
    number: int

    def path(self, what: str, ending: str) -> Path:
        return self.root / self.split / f"{self.orbit:06}" / what / f"{self.number:06}.{ending}"

    def label(self) -> dict:
        return json.loads(self.path("label", "json").read_text())

    def parts(self) -> np.ndarray:
        """Part of each pixel from 1, from the EXR or, where the data set has none, from the map of parts."""
        exr = self.exr()
        if exr is not None:
            return exr.channels()["part"].pixels.astype(np.int64)
        return read_png(self.path("part", "png"))

    def exr(self) -> OpenEXR.File | None:
        path = self.path("radiance", "exr")
        return OpenEXR.File(str(path), separate_channels=True) if path.exists() else None


def read_png(path: Path) -> np.ndarray:
    from PIL import Image as Pillow

    return np.array(Pillow.open(path)).astype(np.int64)


def images(root: Path, most: int | None = None) -> list[Image]:
    """All images, or `most` of them, spread over all orbits."""
    found = []
    for split in SPLITS:
        for orbit in sorted((root / split).glob("[0-9]*")):
            numbers = sorted(int(number) for number in json.loads((orbit / "scene_gt.json").read_text()))
            found += [Image(root, split, int(orbit.name), number) for number in numbers]
    if most is None or len(found) <= most:
        return found
    return [found[int(place)] for place in np.linspace(0, len(found) - 1, most)]


def overlap(a: np.ndarray, b: np.ndarray) -> float:
    """Intersection of two masks over their union."""
    any_of = np.count_nonzero(a | b)
    return np.count_nonzero(a & b) / any_of if any_of else 1.0


def say(text: str) -> None:
    print(f"dataset_check: {text}", flush=True)


def need(right: bool, text: str) -> None:
    """Ends the check with a reason."""
    if not right:
        raise SystemExit(f"dataset_check: FAILED: {text}")
