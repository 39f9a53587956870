"""Makes the inputs of models/station_chaser.toml: the path of the chaser's camera, and a map of the Earth's brightness temperatures.

    python tools/station_chaser/make.py models    # needs numpy

The path is a straight approach at 1 m/s with the slow swing of a chaser under attitude control. The map is no weather: warm oceans, colder high
latitudes, and clouds from sums of random waves.
"""

import math
import struct
import sys
import zlib
from pathlib import Path

import numpy

COLUMNS, ROWS = 1440, 720
OFFSET, SCALE = 215.0, 0.35  # K at grey 0, K a grey value


def minus(a, b):
    return [x - y for x, y in zip(a, b)]


def unit(a):
    length = math.sqrt(sum(x * x for x in a))
    return [x / length for x in a]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def quaternion(x, y, z):
    """The rotation that takes the axes of the camera to x, y, z (columns of its matrix)."""
    m = list(zip(x, y, z))
    w = math.sqrt(max(0.0, 1 + m[0][0] + m[1][1] + m[2][2])) / 2
    if w > 1e-3:
        return [w, (m[2][1] - m[1][2]) / (4 * w), (m[0][2] - m[2][0]) / (4 * w), (m[1][0] - m[0][1]) / (4 * w)]
    i = max(range(3), key=lambda k: m[k][k])
    j, k = (i + 1) % 3, (i + 2) % 3
    q = [0.0] * 4
    root = math.sqrt(1 + m[i][i] - m[j][j] - m[k][k])
    q[1 + i] = root / 2
    q[0] = (m[k][j] - m[j][k]) / (2 * root)
    q[1 + j] = (m[j][i] + m[i][j]) / (2 * root)
    q[1 + k] = (m[k][i] + m[i][k]) / (2 * root)
    return q


def path():
    """Positions from the station along the axes of its orbit frame (+X forward, +Z to the Earth), and the attitude of the camera."""
    lines = ["time,x,y,z,qw,qx,qy,qz"]
    last = None
    for step in range(41):
        time = 95 + 2 * step
        way = time - 100
        along = unit([56.0, -22.0, 16.0])
        place = [p + way * d for p, d in zip([-112.0, 44.0, -40.0], along)]
        # The camera looks at the middle of the station, up to a third of a degree off.
        off = [0.9 * math.sin(0.11 * time), 0.7 * math.sin(0.17 * time + 1), 0.8 * math.cos(0.13 * time)]
        z = unit(minus([2.0 + off[0], off[1], -4.0 + off[2]], place))
        up = [0.02 * math.sin(0.09 * time), 0.02 * math.cos(0.07 * time), -1.0]
        x = unit(cross(z, up))
        q = quaternion(x, cross(z, x), z)
        if last and sum(a * b for a, b in zip(q, last)) < 0:
            q = [-a for a in q]
        last = q
        lines.append(f"{time}," + ",".join(f"{value:.4f}" for value in place) + "," + ",".join(f"{value:.8f}" for value in q))
    return "\n".join(lines) + "\n"


def earth():
    """Rows of grey values from the north pole down. Clouds are sums of random waves on the sphere, swept along the parallels."""
    chosen = numpy.random.default_rng(16)
    latitude = numpy.pi * (0.5 - (numpy.arange(ROWS) + 0.5) / ROWS)[:, None]
    longitude = 2 * numpy.pi * ((numpy.arange(COLUMNS) + 0.5) / COLUMNS - 0.5)[None, :]
    x, y, z = numpy.cos(latitude) * numpy.cos(longitude), numpy.cos(latitude) * numpy.sin(longitude), 1.6 * numpy.sin(latitude)
    noise = numpy.zeros((ROWS, COLUMNS))
    for octave in range(8):
        for _ in range(10):
            direction = chosen.normal(size=3)
            u, v, w = direction / numpy.linalg.norm(direction) * 7.0 * 1.85**octave
            # A wave bends others, so that clouds curl.
            noise += 0.72**octave * numpy.sin(u * x + v * y + w * z + 0.3 * noise + chosen.uniform(0, 2 * numpy.pi))
    cloud = numpy.clip(0.4 * noise / noise.std() + 0.3, 0.0, 1.0) ** 1.3
    ground = 297.0 - 48.0 * numpy.sin(latitude) ** 2
    top = 222.0 + 26.0 * numpy.sin(latitude) ** 2
    grey = numpy.rint((ground + cloud * (top - ground) - OFFSET) / SCALE)
    return [bytes(row) for row in numpy.clip(grey, 0, 255).astype(numpy.uint8)]


def png(rows):
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    # Each row as differences from the one above, which packs well.
    raw, above = b"", bytes(COLUMNS)
    for row in rows:
        raw += b"\2" + bytes((a - b) % 256 for a, b in zip(row, above))
        above = row
    head = struct.pack(">IIBBBBB", COLUMNS, ROWS, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b"")


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    (folder / "station_chaser.csv").write_text(path())
    (folder / "earth_clouds.png").write_bytes(png(earth()))
