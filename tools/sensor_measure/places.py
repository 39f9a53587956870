"""Flux of endless strips of 0.1 px by the places of the samples in a pixel, over all slopes of whole pixels and all places of a strip.

    PYTHONPATH=tools python -m sensor_measure.places

The samples of all pixels lie on lines of slope p/q that are 1/sqrt(p^2 + q^2) px apart, so counting the lines in a strip gives its flux. As in `strips`, the
flux is the mean over 16 shifts by a sixteenth of a pixel.
"""

import math
import re
from pathlib import Path

import numpy as np

from .strips import SHIFTS, WIDTH

LIMIT, STRIPS = 300, 240
BOUNDS = {4: 0.15, 16: 0.05}
SLOPES = [(p, q) for p in range(18) for q in range(-17, 18) if math.gcd(p, q) == 1 and (p, q) > (0, 0) and p * p + q * q <= LIMIT]


def places(samples):
    """The places from the source, in pixels."""
    text = (Path(__file__).parents[2] / "src/raster/view.rs").read_text(encoding="utf-8")
    parts = re.search(rf"\[\[f64; 2\]; {samples + 1}\] =\s+of_1024\((.*?)\);", text, re.S)[1]
    return np.array(re.findall(r"(\d+), (\d+)", parts), float) / 1024


def fluxes(at, p, q):
    """Flux over that of the area, for strips at even places between two lines of the slope p/q."""
    lines = math.hypot(p, q)
    shifts = np.arange(SHIFTS) / SHIFTS * lines
    edge = (np.arange(STRIPS) + 0.5)[:, None, None] / STRIPS + shifts[:, None] - at @ [p, q]
    inside = np.floor(edge + WIDTH * lines) - np.floor(edge)
    return inside.mean(axis=(1, 2)) / (WIDTH * lines)


def main():
    """Prints a line for each number of samples."""
    for samples, bound in BOUNDS.items():
        worst = {slope: float(abs(fluxes(places(samples), *slope) - 1).max()) for slope in SLOPES}
        beyond = sum(value > bound for value in worst.values())
        slope = max(worst, key=worst.get)
        print(f"{samples} samples: {beyond} of {len(SLOPES)} slopes are beyond {bound:.0%} at some place, {slope} by the most: {worst[slope]:.1%}")


if __name__ == "__main__":
    main()
