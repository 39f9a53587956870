"""The four networks of docs/numerics.md 3 at about 10,000 nodes, as arrays that every program is given.

The paper's cube, a thin sheet with a moving spot, the same with slivers, and a blanket over a structure; an orbit of
6017 s in 360 steps. Outlines and loads are this file's own, as `src/bench/cases.rs` has them at 1000 nodes: sunlight, planet
infrared and a spot of reflected sunlight, stated every ten steps and linear between, so that all programs solve the same
equations. SI units.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SIGMA = 5.670374419e-8
SPACE = 2.7
PERIOD, STEPS = 6017.0, 360
STEP = PERIOD / STEPS
# Steps between two stated heats, and between two compared rows.
EVERY, STRIDE = 10, 36
SOLAR, PLANET_IR = 1361.0, 237.0
# View factor of a plate that looks to nadir at 772 km.
NADIR_FACTOR = (6371.0 / 7143.0) ** 2
# Aluminium 6061 of the paper: W/(m K), J/(m3 K).
CONDUCTIVITY, HEAT_CAPACITY = 200.0, 2700.0 * 900.0
SKIN = 1e-3
# White paint on both faces of the sheet.
PAINT_ABSORPTIVITY, PAINT_EMISSIVITY = 0.25, 0.85
# Brightest place [W/m2], radius [m] and orbit (share of the sheet's edge) of the spot.
SPOT, SPOT_RADIUS, SPOT_ORBIT = 400.0, 0.03, 0.3
SLIVERS = (2e-4, 4e-4)
# Goldized MLI of the paper, effective emittance to the structure, and heat of boxes on a quarter of it [W/m2].
MLI_ABSORPTIVITY, MLI_EMISSIVITY, EFFECTIVE_EMITTANCE, DISSIPATION = 0.19, 0.02, 0.02, 60.0


@dataclass(frozen=True)
class Network:
    """Nodes, conductors and heat; a capacitance of 0 is an arithmetic node."""

    key: str
    title: str
    capacitance: Floats
    emissive_area: Floats
    start: Floats
    linear: Ints
    conductance: Floats
    radiative: Ints
    exchange_area: Floats
    # Heat [W] by time (rows) and node.
    heat: Floats

    @property
    def nodes(self) -> int:
        return len(self.capacitance)

    def heat_at(self, now: float) -> Floats:
        """Heat of every node at a time [s]."""
        place = now / (STEP * EVERY)
        row = min(int(place), len(self.heat) - 2)
        share = place - row
        return self.heat[row] * (1.0 - share) + self.heat[row + 1] * share


def heat_times() -> Floats:
    """Times at which heat is stated [s]."""
    return STEP * EVERY * np.arange(STEPS // EVERY + 1, dtype=np.float64)


def row_times() -> Floats:
    """Times at which temperatures are compared [s], the start among them."""
    return STEP * np.arange(0, STEPS + 1, STRIDE, dtype=np.float64)


def sun_directions() -> Floats:
    """The Sun in the orbit frame (x along the velocity, z to the zenith), behind no planet; noon is at 20 degrees."""
    angle = np.radians(20.0) + 2 * np.pi * heat_times() / PERIOD
    return np.stack([-np.sin(angle), np.zeros_like(angle), np.cos(angle)], axis=1)


def grid_links(widths: Floats, heights: Floats, thickness: float) -> tuple[Ints, Floats]:
    """Neighbours of a sheet of rectangles, row by row, and their conductances: k x section / distance of the centres."""
    columns, rows = len(widths), len(heights)
    number = np.arange(columns * rows).reshape(rows, columns)
    across = np.stack([number[:, :-1].ravel(), number[:, 1:].ravel()], axis=1)
    along = np.stack([number[:-1].ravel(), number[1:].ravel()], axis=1)
    between_columns = np.outer(heights, 2.0 / (widths[:-1] + widths[1:])).ravel()
    between_rows = np.outer(2.0 / (heights[:-1] + heights[1:]), widths).ravel()
    conductance = CONDUCTIVITY * thickness * np.concatenate([between_columns, between_rows])
    return np.concatenate([across, along]), conductance


def none() -> tuple[Ints, Floats]:
    return np.empty((0, 2), dtype=np.int64), np.empty(0)


def cube(side: int = 41) -> Network:
    """Six panels of 1 m x 1 m x 0.1 m, joined at the cube's edges."""
    axes = np.eye(3, dtype=int)
    panels = [(sign * axes[i], axes[(i + 1) % 3], axes[(i + 2) % 3]) for i in range(3) for sign in (1, -1)]
    at = 2 * np.arange(side) - (side - 1)
    centres = [(side * n + a * u + b * v) for n, u, v in panels for b in at for a in at]
    number = {tuple(centre): node for node, centre in enumerate(centres)}
    pairs = set()
    for node, centre in enumerate(centres):
        normal, u, v = panels[node // (side * side)]
        for step in (u, -u, v, -v):
            other = number.get(tuple(centre + 2 * step))
            if other is None:
                other = number[tuple(centre + step - normal)]
            pairs.add((min(node, other), max(node, other)))
    linear = np.array(sorted(pairs), dtype=np.int64)
    nodes, area, thickness = len(centres), side**-2.0, 0.1
    normals = np.repeat(np.array([n for n, _, _ in panels]), side * side, axis=0)
    sunlight = SOLAR * 0.18 * area * np.maximum(0.0, sun_directions() @ normals.T)
    return Network(
        key="cube",
        title=f"the paper's cube, {side} x {side} cells a face",
        capacitance=np.full(nodes, HEAT_CAPACITY * thickness * area),
        emissive_area=np.full(nodes, 0.21 * area),
        start=np.full(nodes, 257.0),
        linear=linear,
        # Squares side by side: section k x thickness x edge over a length of an edge; the same over an edge of the cube.
        conductance=np.full(len(linear), CONDUCTIVITY * thickness),
        radiative=none()[0],
        exchange_area=none()[1],
        heat=sunlight,
    )


def sheet(slivers: bool, side: int = 100) -> Network:
    """1 mm aluminium in 1 cm cells, painted on both faces, one to the zenith, with a spot that goes round once an orbit."""
    heights = np.full(side, 0.01)
    widths = np.insert(heights, side // 2, SLIVERS) if slivers else heights
    x, y = np.cumsum(widths) - 0.5 * widths, np.cumsum(heights) - 0.5 * heights
    area = np.outer(heights, widths).ravel()
    xs, ys = np.tile(x, side), np.repeat(y, len(widths))
    edge = 0.01 * side
    angle = 2 * np.pi * heat_times()[:, None] / PERIOD
    away = (xs - edge * (0.5 + SPOT_ORBIT * np.cos(angle))) ** 2 + (ys - edge * (0.5 + SPOT_ORBIT * np.sin(angle))) ** 2
    spot = SPOT * np.exp(-0.5 * away / SPOT_RADIUS**2)
    sunlight = SOLAR * PAINT_ABSORPTIVITY * np.abs(sun_directions()[:, 2:])
    infrared = PLANET_IR * PAINT_EMISSIVITY * NADIR_FACTOR
    linear, conductance = grid_links(widths, heights, SKIN)
    name = f"1 mm sheet, {side} x {side} cells of 1 cm"
    return Network(
        key="slivers" if slivers else "sheet",
        title=f"{name}, two columns of slivers 0.2 and 0.4 mm wide" if slivers else name,
        capacitance=HEAT_CAPACITY * SKIN * area,
        emissive_area=2.0 * PAINT_EMISSIVITY * area,
        start=np.full(len(area), 270.0),
        linear=linear,
        conductance=conductance,
        radiative=none()[0],
        exchange_area=none()[1],
        heat=area * (sunlight + infrared + spot),
    )


def blanket(side: int = 71) -> Network:
    """MLI that stores no heat and faces the zenith, over 1 mm of aluminium in 2 cm cells with boxes on a quarter."""
    cell = np.full(side, 0.02)
    cells, area = side * side, 0.02 * 0.02
    linear, conductance = grid_links(cell, cell, SKIN)
    structure = np.arange(cells)
    sunlight = SOLAR * MLI_ABSORPTIVITY * area * np.maximum(0.0, sun_directions()[:, 2:])
    boxes = (structure % side < side // 2) & (structure // side < side // 2)
    times = len(heat_times())
    dissipated = np.tile(np.where(boxes, DISSIPATION * area, 0.0), (times, 1))
    return Network(
        key="blanket",
        title=f"MLI (C = 0) over 1 mm of aluminium, {side} x {side} cells of 2 cm",
        capacitance=np.concatenate([np.full(cells, HEAT_CAPACITY * SKIN * area), np.zeros(cells)]),
        emissive_area=np.concatenate([np.zeros(cells), np.full(cells, MLI_EMISSIVITY * area)]),
        start=np.full(2 * cells, 270.0),
        linear=linear,
        conductance=conductance,
        radiative=np.stack([structure, structure + cells], axis=1),
        exchange_area=np.full(cells, EFFECTIVE_EMITTANCE * area),
        heat=np.concatenate([dissipated, np.tile(sunlight, (1, cells))], axis=1),
    )


def make(key: str) -> Network:
    """A case by its short name."""
    makers = {"cube": cube, "sheet": lambda: sheet(False), "slivers": lambda: sheet(True), "blanket": blanket}
    return makers[key]()


def toml(network: Network) -> str:
    """The file that `isotherm network` reads."""

    def numbers(values: Floats) -> str:
        return "[" + ", ".join(repr(float(value)) for value in values) + "]"

    lines = [f"space_temperature = {SPACE}", "", "[output]", f"times = {numbers(row_times())}"]
    times = numbers(heat_times())
    for node in range(network.nodes):
        powers = network.heat[:, node]
        constant = bool(np.all(powers == powers[0]))
        heat = repr(float(powers[0])) if constant else f"{{ time = {times}, power = {numbers(powers)} }}"
        kind = "diffusive" if network.capacitance[node] > 0.0 else "arithmetic"
        lines += [
            "\n[[node]]",
            f'label = "{node}"',
            f'kind = "{kind}"',
            f"capacitance = {float(network.capacitance[node])!r}",
            f"emissive_area = {float(network.emissive_area[node])!r}",
            f"temperature = {float(network.start[node])!r}",
            f"heat = {heat}",
        ]
    for (a, b), value in zip(network.linear, network.conductance, strict=True):
        lines += ["\n[[linear_conductor]]", f'nodes = ["{a}", "{b}"]', f"conductance = {float(value)!r}"]
    for (a, b), value in zip(network.radiative, network.exchange_area, strict=True):
        lines += ["\n[[radiative_conductor]]", f'nodes = ["{a}", "{b}"]', f"exchange_area = {float(value)!r}"]
    return "\n".join(lines) + "\n"
