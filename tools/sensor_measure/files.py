"""Reads what a sensor wrote: PNG and JSON. Nothing here knows isotherm beyond what the JSON says."""

import json
import struct
import zlib
from pathlib import Path

import numpy as np

# CODATA 2018: 2 h c^2 [W m2 sr-1] and h c / k [m K].
FIRST = 1.191042972397188e-16
SECOND = 1.438776877503933e-2


def read_png(path):
    """A grey PNG of 8 or 16 bits, without interlacing."""
    data, at, packed, head = Path(path).read_bytes(), 8, b"", None
    while at < len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        kind, content = data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            head = struct.unpack(">IIB", content[:9])
        if kind == b"IDAT":
            packed += content
        at += 12 + length
    width, height, depth = head
    step = depth // 8
    rows = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, 1 + width * step)
    values, above = np.zeros((height, width * step), np.uint8), np.zeros(width * step, np.uint8)
    for row, (kind, *_) in enumerate(rows):
        line = rows[row, 1:]
        if kind == 1:
            line = np.cumsum(line.reshape(width, step), axis=0, dtype=np.uint8).reshape(-1)
        elif kind == 2:
            line = line + above
        elif kind > 2:
            line = _unfiltered(kind, line, above, step)
        values[row] = above = line
    return values.view(">u2" if step == 2 else np.uint8).astype(np.float64)


def _unfiltered(kind, line, above, step):
    """A row of the PNG filters Average (3) and Paeth (4)."""
    found, above = [0] * step, [0] * step + above.tolist()
    for at, byte in enumerate(line.tolist(), step):
        a, b, c = found[at - step], above[at], above[at - step]
        if kind == 3:
            guess = (a + b) // 2
        else:
            guess = min((abs(b - c), 0, a), (abs(a - c), 1, b), (abs(a + b - 2 * c), 2, c))[2]
        found.append((byte + guess) & 255)
    return np.array(found[step:], np.uint8)


class Image:
    """An image of a sensor."""

    def __init__(self, path):
        self.about = json.loads(Path(path).read_text())
        self.folder = Path(path).parent
        self.numbers = read_png(self._file("_dn.png"))

    def _file(self, ending):
        return self.folder / next(name for name in self.about["files"] if name.endswith(ending))

    @property
    def time(self):
        return self.about["time_s"]

    def kelvin(self):
        """Brightness temperatures of the radiometric output [K]."""
        scale = self.about["kelvin"]["scale"]
        return read_png(self._file("_kelvin.png")) * scale

    def works(self):
        """Whether each pixel works."""
        works = np.ones_like(self.numbers, bool)
        for kind in ("zero_px", "most_px"):
            for x, y in self.about["bad_pixels"][kind]:
                works[y, x] = False
        return works

    def is_flagged(self):
        """Whether the mask says what digital numbers and bad pixels say, and flagged pixels count no temperature."""
        most, bad = self.about["digital_numbers"]["most"], ~self.works()
        flags = self.about["mask"]
        expected = flags["below the range"] * (self.numbers == 0) + flags["beyond the range"] * (self.numbers == most)
        expected = expected + flags["bad pixel"] * bad
        told = bool((read_png(self._file("_mask.png")) == expected).all())
        return told and bool(((self.kelvin() == 0) == (expected > 0)).all()) and bool((expected > 0).any())

    def signal(self):
        """Signal at the detector [W m-2 sr-1]."""
        of = self.about["digital_numbers"]
        return (self.numbers - of["offset"]) / of["scale"]

    def share(self):
        """Share of the light that arrives at each pixel."""
        vignetting = self.about["vignetting"]
        if vignetting is None:
            return np.ones_like(self.numbers)
        if "map" in vignetting:
            return np.array(vignetting["map"])
        height, width = self.numbers.shape
        (fx, fy), (cx, cy) = vignetting["cos4"]["focal_px"], vignetting["cos4"]["centre_px"]
        x, y = (np.arange(width) + 0.5 - cx) / fx, (np.arange(height) + 0.5 - cy) / fy
        return 1.0 / (1.0 + x[None, :] ** 2 + y[:, None] ** 2) ** 2

    def radiance(self):
        """Radiance at the lens [W m-2 sr-1]."""
        optics, share = self.about["optics"], self.share()
        at_lens = (self.signal() - (1.0 - share) * optics["housing"]) / share
        return (at_lens - optics["lens"]) / optics["transmission"]


def images(folder):
    """All images of a run, in order."""
    return [Image(path) for path in sorted(Path(folder).glob("frames/step_*.json"))]


def band_radiance(band_um, temperature):
    """Radiance of a blackbody in a band, by Gauss and Legendre [W m-2 sr-1]."""
    low, high = (um * 1e-6 for um in band_um)
    nodes, weights = np.polynomial.legendre.leggauss(96)
    wave = 0.5 * (high - low) * nodes + 0.5 * (high + low)
    temperature = np.asarray(temperature, float)[..., None]
    spectral = FIRST / wave**5 / np.expm1(SECOND / (wave * temperature))
    return (spectral * weights).sum(-1) * 0.5 * (high - low)


def brightness(band_um, radiance):
    """Temperature of a blackbody with a radiance, between the points of a table [K]."""
    table = np.linspace(100.0, 1000.0, 9001)
    return np.interp(radiance, band_radiance(band_um, table), table)


def slope(band_um, temperature):
    """Change of the blackbody's radiance with its temperature [W m-2 sr-1 K-1]."""
    step = 0.01
    return (band_radiance(band_um, temperature + step) - band_radiance(band_um, temperature - step)) / (2 * step)
