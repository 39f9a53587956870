"""Images of a data set as numbers that a small network takes, and what it shall find: distance and direction of the craft."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
from PIL import Image

# Pixels of a row or column that are taken together.
STRIPE = 8
# A pixel shows the craft if it differs from the background by so many differences between neighbours, of which three quarters are smaller.
CONTRAST = 6


def features(path: Path) -> np.ndarray:
    """How many pixels show the craft in each stripe of columns, in each of rows, and in all (logarithms)."""
    pixels = np.array(Image.open(path)).astype(np.float32)
    noise = np.percentile(np.abs(np.diff(pixels, axis=1)), 75) + 1
    shown = np.abs(pixels - np.median(pixels)) > CONTRAST * noise
    sums = [shown.sum(axis=axis) for axis in (0, 1)]
    stripes = [np.add.reduceat(values, np.arange(0, len(values), STRIPE)) for values in sums]
    return np.log1p(np.concatenate([*stripes, [shown.sum()]]))


def read(root: Path, split: str) -> tuple[np.ndarray, np.ndarray]:
    """The images of a split, and the logarithm of the distance and the direction (x / z and y / z) of the craft in each."""
    entries = json.loads((root / "speed" / f"{split}.json").read_text())
    if not entries:
        sys.exit(f"{root} has no images to {split} with")
    if not entries[0]["filename"].endswith(".png"):
        sys.exit(f"{root} has no digital numbers: its SPEC needs images = [\"numbers\"]")
    x, y, z = np.array([entry["r_Vo2To_vbs_true"] for entry in entries]).T
    labels = np.column_stack([np.log(np.sqrt(x**2 + y**2 + z**2)), x / z, y / z])
    return np.stack([features(root / entry["filename"]) for entry in entries]), labels
