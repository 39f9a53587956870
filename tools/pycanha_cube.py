#!/usr/bin/env python3
"""The paper's cube meshed to 10,086 nodes, by pycanha-core 0.6.0 and as a file for `isotherm network`.

    python3.12 -m venv .venv && .venv/bin/pip install numpy pycanha-core==0.6.0
    .venv/bin/python tools/pycanha_cube.py write cube.toml
    .venv/bin/python tools/pycanha_cube.py solve                # seconds, and the error against a finer solution
    .venv/bin/python tools/pycanha_cube.py check series.csv     # the error of `isotherm network cube.toml -o series.csv`

Six panels of 1 m x 1 m x 0.1 m in aluminium 6061, 41 x 41 nodes each, joined at the cube's edges; one orbit of 6017 s in
360 steps from 257 K, space at 2.7 K. The heat of a panel is its absorbed sunlight every 10 steps, linear between, so
that both programs solve the same equations. SI units.
"""

import argparse
import ctypes
import sys
import time

import numpy as np

SIDE = 41
STEPS, PERIOD, EVERY = 360, 6017.0, 10
STEP = PERIOD / STEPS
SIGMA, SPACE, START = 5.670374419e-8, 2.7, 257.0
SOLAR, ABSORPTIVITY, EMISSIVITY = 1361.0, 0.18, 0.21
CONDUCTIVITY, DENSITY, SPECIFIC_HEAT, THICKNESS = 200.0, 2700.0, 900.0, 0.1
CELL = 1.0 / SIDE
CAPACITANCE = DENSITY * SPECIFIC_HEAT * THICKNESS * CELL**2
# Squares side by side: section k = thickness x edge, length = edge; the same over an edge of the cube.
CONDUCTANCE = CONDUCTIVITY * THICKNESS
EMISSIVE_AREA = EMISSIVITY * CELL**2
NODES = 6 * SIDE * SIDE
# Rows that are written and compared: every 36 steps.
STRIDE = 36
# Normal and the two axes of each panel, in the orbit frame: x along the velocity, z to the zenith.
AXES = np.eye(3, dtype=int)
PANELS = [(sign * AXES[i], AXES[(i + 1) % 3], AXES[(i + 2) % 3]) for i in range(3) for sign in (1, -1)]


def cells():
    """Centres of all cells in half cells from the middle of the cube, panel by panel."""
    at = 2 * np.arange(SIDE) - (SIDE - 1)
    return [(SIDE * n + a * u + b * v) for n, u, v in PANELS for b in at for a in at]


def conductors():
    """Pairs of neighbours: within a panel a cell apart, over an edge half a cell apart in two directions."""
    number = {tuple(cell): node for node, cell in enumerate(cells())}
    pairs = set()
    for node, cell in enumerate(cells()):
        normal, u, v = PANELS[node // (SIDE * SIDE)]
        for step in (u, -u, v, -v):
            other = number.get(tuple(cell + 2 * step))
            if other is None:
                other = number[tuple(cell + step - normal)]
            pairs.add((min(node, other), max(node, other)))
    return sorted(pairs)


def table():
    """Times [s] and absorbed sunlight of the panels [W a node]; the start is 20 degrees after noon."""
    times = STEP * EVERY * np.arange(STEPS // EVERY + 1)
    angle = np.radians(20.0) + 2 * np.pi * times / PERIOD
    sun = np.stack([-np.sin(angle), np.zeros_like(angle), np.cos(angle)], axis=1)
    normals = np.array([n for n, _, _ in PANELS])
    return times, SOLAR * ABSORPTIVITY * CELL**2 * np.maximum(0.0, sun @ normals.T)


def heat(now):
    """Heat of every node [W] at a time [s]."""
    times, powers = table()
    return np.repeat([np.interp(now, times, powers[:, panel]) for panel in range(6)], SIDE * SIDE)


def write(path):
    times, powers = table()
    rows = [STEP * step for step in range(0, STEPS + 1, STRIDE)]
    numbers = lambda values: "[" + ", ".join(repr(float(value)) for value in values) + "]"
    with open(path, "w", encoding="utf-8") as out:
        out.write(f"space_temperature = {SPACE}\n\n[output]\ntimes = {numbers(rows)}\n")
        tables = [f"{{ time = {numbers(times)}, power = {numbers(powers[:, panel])} }}" for panel in range(6)]
        for node in range(NODES):
            out.write(
                f'\n[[node]]\nlabel = "{node}"\nkind = "diffusive"\ncapacitance = {CAPACITANCE!r}\n'
                f"emissive_area = {EMISSIVE_AREA!r}\ntemperature = {START}\nheat = {tables[node // (SIDE * SIDE)]}\n"
            )
        for a, b in conductors():
            out.write(f'\n[[linear_conductor]]\nnodes = ["{a}", "{b}"]\nconductance = {CONDUCTANCE!r}\n')


def reference(parts=32):
    """The same equations by Runge-Kutta of order 4 in f64: rows [K] at every STRIDE steps."""
    pairs = np.array(conductors())
    neighbours = [[] for _ in range(NODES)]
    for a, b in pairs:
        neighbours[a].append(b)
        neighbours[b].append(a)
    neighbours = np.array(neighbours)

    def rate(t, now):
        conducted = CONDUCTANCE * (t[neighbours].sum(axis=1) - 4.0 * t)
        return (heat(now) + conducted - EMISSIVE_AREA * SIGMA * (t**4 - SPACE**4)) / CAPACITANCE

    t, span = np.full(NODES, START), STEP / parts
    rows = [t]
    for step in range(STEPS):
        for part in range(parts):
            now = (step + part / parts) * STEP
            a = rate(t, now)
            b = rate(t + 0.5 * span * a, now + 0.5 * span)
            c = rate(t + 0.5 * span * b, now + 0.5 * span)
            d = rate(t + span * c, now + span)
            t = t + span / 6.0 * (a + 2.0 * (b + c) + d)
        if (step + 1) % STRIDE == 0:
            rows.append(t)
    return np.array(rows)


def report(name, rows, exact):
    error = rows - exact
    print(f"{name}: error rms {1e3 * np.sqrt(np.mean(error**2)):.3g} mK, max {1e3 * np.abs(error).max():.3g} mK")


def pycanha():
    """Seconds of the solution by the clock and of the processor, those spent in handing over the heat, and rows [K]."""
    import pycanha_core

    model = pycanha_core.tmm.ThermalMathematicalModel("cube")
    nodes = model.nodes
    for node in range(NODES + 1):
        new = pycanha_core.tmm.Node(node)
        new.type = pycanha_core.tmm.DIFFUSIVE if node < NODES else pycanha_core.tmm.BOUNDARY
        new.T = START if node < NODES else SPACE
        if node < NODES:
            new.C = CAPACITANCE
            new.qs = 1.0
        model.add_node(new)
    for a, b in conductors():
        model.add_conductive_coupling(int(a), int(b), CONDUCTANCE)
    for node in range(NODES):
        model.add_radiative_coupling(node, NODES, EMISSIVE_AREA)
    pointers = np.array([nodes.get_qs_value_pointer(node) for node in range(NODES)], dtype=np.int64)
    if not np.all(np.diff(pointers) == 8):
        sys.exit("the solar heat of this pycanha-core is not one array")
    solar = np.ctypeslib.as_array((ctypes.c_double * NODES).from_address(int(pointers[0])))
    handing = [0.0]

    def hand_over(*_):
        start = time.perf_counter()
        solar[:] = heat(model.time)
        handing[0] += time.perf_counter() - start

    solar[:] = heat(0.0)
    model.python_extern_callback_transient_time_change = hand_over
    model.python_callbacks_active = True
    solver = pycanha_core.solvers.TSCNRLDS(model)
    solver.MAX_ITERS = 100
    solver.set_simulation_time(0.0, PERIOD, STEP, STRIDE * STEP)
    clock, processor = time.perf_counter(), time.process_time()
    solver.initialize()
    solver.solve()
    clock, processor = time.perf_counter() - clock, time.process_time() - processor
    rows = np.array(model.thermal_data.get_table("TSCNRLDS_OUTPUT"))
    return clock, processor, handing[0], rows


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["write", "solve", "check"])
    parser.add_argument("file", nargs="?")
    arguments = parser.parse_args()
    if arguments.what == "write":
        write(arguments.file or "cube.toml")
    elif arguments.what == "check":
        rows = np.loadtxt(arguments.file or "series.csv", delimiter=",", skiprows=1)[:, 1:]
        report(arguments.file or "series.csv", rows, reference())
    else:
        clock, processor, handing, rows = pycanha()
        print(f"pycanha-core: {NODES} nodes, {STEPS} steps: {clock:.2f} s, {processor:.2f} s of the processor,")
        print(f"              {handing:.2f} s of them to hand over the heat; building the network is not counted")
        exact = reference()
        report("pycanha-core", rows[:, 1 : NODES + 1], exact)
        report("no heat at all (must be large)", np.full_like(exact, START), exact)


if __name__ == "__main__":
    main()
