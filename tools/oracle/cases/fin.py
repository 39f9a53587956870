"""A fin that a heated plate warms through a contact along its end. Points near its border make obtuse triangles there, which no flip of an edge mends."""

from pathlib import Path

import numpy as np

from .. import gltf, scenes
from ..camera import Camera
from ..case import SIGMA, Bounds, Case

LENGTH, WIDTH, SHEET, EMISSIVITY, CAPACITY = 1.0, 0.1, 0.3, 0.8, 4860.0
PLATE_EMISSIVITY, PLATE_CAPACITY, CONTACT, POWER = 0.2, 12150.0, 2.0, 15.0
INITIAL, STEP, STEPS, DRAWN = 250.0, 30.0, 400, [40, 400]
CAMERA = Camera((0.5, 0.05, 1.6), (0.5, 0.05, 0.0), 40.0, 200, 40, (0.0, 1.0, 0.0))


def _fin(cells: int) -> np.ndarray:
    """Cells along the fin, with a point near the middle of each edge of the border."""
    triangles = []
    for cell in range(cells):
        low, high = cell * LENGTH / cells, (cell + 1) * LENGTH / cells
        middle, near = (low + high) / 2, 0.15 * LENGTH / cells
        a, b, c, d = (low, 0), (high, 0), (high, WIDTH), (low, WIDTH)
        m, n = (middle, near), (middle, WIDTH - near)
        triangles += [(a, b, m), (c, d, n), (a, m, n), (a, n, d), (m, b, c), (m, c, n)]
    return np.array([[[*corner, 0.0] for corner in triangle] for triangle in triangles])


PLATE = np.array([[[0, 0, -0.05], [0, WIDTH, -0.05], [0, WIDTH, 0.05]], [[0, 0, -0.05], [0, WIDTH, 0.05], [0, 0, 0.05]]])


def _build(cells: int, max_edge: float | str | None):
    def build(folder: Path) -> Path:
        parts = [gltf.Part("fin", "fin", _fin(cells)), gltf.Part("plate", "plate", PLATE)]
        dark = "[orbit]\naltitude = 408e3\n[attitude]\nmode = \"inertial\"\nquaternion = [1, 0, 0, 0]\n[environment]\nbackground_temperature = 0\n"
        fin = scenes.material("fin", 0.5, EMISSIVITY, CAPACITY, (0.5, EMISSIVITY), conducts=SHEET)
        # It conducts so well that it has one temperature.
        plate = scenes.material("plate", 0.5, PLATE_EMISSIVITY, PLATE_CAPACITY, (0.5, PLATE_EMISSIVITY), conducts=100.0)
        joined = f'[[contact]]\nbetween = ["fin", "plate"]\nconductance = {CONTACT}\n[[heater]]\npart = "plate"\npower = {POWER}\n'
        time = f"step = {STEP}\nsteps = {STEPS}\ndraw_steps = {DRAWN}\n"
        return scenes.write(folder, parts, [dark, fin, plate, joined], CAMERA, time, INITIAL, max_edge)

    return build


def _truth(cells: int = 4000) -> list:
    """Heat along the fin in one dimension, by cells of 0.25 mm."""
    from scipy.integrate import solve_ivp
    from scipy.sparse import lil_matrix

    length = LENGTH / cells
    area = 0.1 * WIDTH

    def rate(_: float, kelvin: np.ndarray) -> np.ndarray:
        fin, plate = kelvin[:-1], kelvin[-1]
        flow = np.zeros(cells + 1)
        flow[1:-1] = SHEET * WIDTH * (fin[:-1] - fin[1:]) / length
        flow[0] = (plate - fin[0]) / (1 / CONTACT + length / 2 / (SHEET * WIDTH))
        of_fin = (flow[:-1] - flow[1:]) / (WIDTH * length) - 2 * EMISSIVITY * SIGMA * fin**4
        return np.append(of_fin / CAPACITY, ((POWER - flow[0]) / area - 2 * PLATE_EMISSIVITY * SIGMA * plate**4) / PLATE_CAPACITY)

    pattern = lil_matrix((cells + 1, cells + 1))
    for off in (-1, 0, 1):
        pattern.setdiag(1, off)
    pattern[0, cells] = pattern[cells, 0] = 1
    times = [STEP * step for step in DRAWN]
    found = solve_ivp(rate, (0, times[-1]), np.full(cells + 1, INITIAL), "BDF", times, rtol=1e-8, atol=1e-6, jac_sparsity=pattern.tocsr())
    origins, directions = CAMERA.rays()
    places = origins - directions * (origins[:, 2] / directions[:, 2])[:, None]
    pixel = 1.6 / (0.5 * CAMERA.width / np.tan(np.radians(CAMERA.fov_deg) / 2))
    inside = (places[:, 0] > 1.5 * pixel) & (places[:, 0] < LENGTH - 1.5 * pixel) & (np.abs(places[:, 1] - WIDTH / 2) < WIDTH / 2 - 1.5 * pixel)
    along = (np.arange(cells) + 0.5) * length
    rows = []
    for number, step in enumerate(DRAWN):
        kelvin = np.interp(places[:, 0], along, found.y[:-1, number])
        rows += [(step, int(at % CAMERA.width), int(at // CAMERA.width), 0, float(kelvin[at])) for at in np.flatnonzero(inside)]
    return rows


FINDS = "borders of obtuse triangles that conduct too well, and heat through a contact that counts as curvature"
CASES = [
    Case("fin", _build(25, None), _truth, Bounds(rms=0.5), data="fin", parts=["fin", "plate"], finds=FINDS),
    Case("fin_file", _build(40, '"file"'), _truth, Bounds(rms=0.5), data="fin", parts=["fin", "plate"], finds=FINDS),
]
