"""Radiant flux of strips far narrower than a pixel, by their angle, from the files of runs."""

import math

import numpy as np

from .files import band_radiance

SHIFTS, SIDE, LENGTH, WIDTH = 16, 40, 30.0, 0.1
# Slopes of whole pixels, where the samples of all pixels lie on few lines, then angles and places in a pixel that are drawn.
SLOPES = [(p, q) for p in range(9) for q in range(-8, 9) if math.gcd(p, q) == 1 and (p, q) > (0, 0) and p * p + q * q <= 13] + [(8, 1), (8, -1), (1, 8), (1, -8)]
DRAWN = np.random.default_rng(32)
ANGLES = np.concatenate([np.degrees([math.atan2(q, p) % math.pi for p, q in SLOPES]), DRAWN.uniform(0.0, 180.0, 24)])
PLACES = DRAWN.uniform(0.0, 1.0, (len(ANGLES), 2))
DISTANCE, FOCAL = 5.0, 500.0
SIZE = SHIFTS * SIDE, len(ANGLES) * SIDE
CAMERA = "width = {}\nheight = {}\nfocal_px = {}\nsamples = {}"
SENSOR = "netd = 0\nrange = [40, 320]\nbits = 16\n"


def corners():
    """A strip for each angle and shift, each in a square of its own; a shift is a sixteenth of a pixel across the strip."""
    metre, all_corners = DISTANCE / FOCAL, []
    for row, angle in enumerate(np.radians(ANGLES)):
        along, across = (math.cos(angle), math.sin(angle)), (-math.sin(angle), math.cos(angle))
        for column in range(SHIFTS):
            middle = ((column + 0.5) * SIDE - 0.5 * SIZE[0] + PLACES[row][0], (row + 0.5) * SIDE - 0.5 * SIZE[1] + PLACES[row][1])
            for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                place = [middle[i] + 0.5 * u * LENGTH * along[i] + (0.5 * v * WIDTH + column / SHIFTS) * across[i] for i in (0, 1)]
                all_corners.append((metre * place[0], metre * place[1], 0.0))
    return all_corners


def camera(samples):
    """Keys of the camera with so many samples of a pixel."""
    return CAMERA.format(*SIZE, FOCAL, samples)


def fluxes(image):
    """Flux of the strips at each angle over that of their area, in the mean over the shifts."""
    cells = image.signal().reshape(len(ANGLES), SIDE, SHIFTS, SIDE).sum(axis=(1, 3))
    return cells.mean(axis=1) / (LENGTH * WIDTH * float(band_radiance(image.about["band_um"], 300.0)))
