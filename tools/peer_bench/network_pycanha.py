"""A network by pycanha-core's implicit solver (Crank-Nicolson), in a process of its own.

    python -m peer_bench.network_pycanha CASE STEPS OUT.npz

Building the network is not counted, nor is the time of handing over the heat at every step, which is Python's.
"""

import ctypes
import sys
import time
from typing import Any

import numpy as np
import pycanha_core

from peer_bench import network_cases as cases
from peer_bench.network_cases import SPACE, Network


def build(network: Network) -> pycanha_core.tmm.ThermalMathematicalModel:
    """The model; the last node is space.

    pycanha 0.6.0 has no arithmetic nodes: they are diffusive ones without capacitance.
    """
    tmm = pycanha_core.tmm
    model = tmm.ThermalMathematicalModel(network.key)
    for number in range(network.nodes + 1):
        node = tmm.Node(number)
        node.type = tmm.DIFFUSIVE if number < network.nodes else tmm.BOUNDARY
        if number < network.nodes:
            node.T, node.C, node.qs = network.start[number], network.capacitance[number], 1.0
        else:
            node.T = SPACE
        model.add_node(node)
    for (a, b), value in zip(network.linear, network.conductance, strict=True):
        model.add_conductive_coupling(int(a), int(b), float(value))
    for (a, b), value in zip(network.radiative, network.exchange_area, strict=True):
        model.add_radiative_coupling(int(a), int(b), float(value))
    for radiating in np.flatnonzero(network.emissive_area):
        model.add_radiative_coupling(int(radiating), network.nodes, float(network.emissive_area[radiating]))
    return model


def solve(network: Network, steps: int) -> dict[str, Any]:
    """Rows [K], seconds of the solver by the clock and of the processor, and those of handing over."""
    model = build(network)
    # Diffusive nodes come first inside pycanha, as they do here.
    pointers = np.array([model.nodes.get_qs_value_pointer(node) for node in range(network.nodes)], dtype=np.int64)
    if not np.all(np.diff(pointers) == 8):
        raise RuntimeError("the solar heat of this pycanha-core is not one array")
    solar = np.ctypeslib.as_array((ctypes.c_double * network.nodes).from_address(int(pointers[0])))
    handing = 0.0

    def hand_over(*_: object) -> None:
        nonlocal handing
        began = time.perf_counter()
        solar[:] = network.heat_at(min(model.time, cases.PERIOD))
        handing += time.perf_counter() - began

    solar[:] = network.heat_at(0.0)
    model.python_extern_callback_transient_time_change = hand_over
    model.python_callbacks_active = True
    solver = pycanha_core.solvers.TSCNRLDS(model)
    solver.MAX_ITERS = 100
    solver.set_simulation_time(0.0, cases.PERIOD, cases.PERIOD / steps, cases.STRIDE * cases.STEP)
    began, processor = time.perf_counter(), time.process_time()
    solver.initialize()
    solver.solve()
    seconds, busy = time.perf_counter() - began, time.process_time() - processor
    table = np.array(model.thermal_data.get_table("TSCNRLDS_OUTPUT"))
    return {
        "rows": table[:, 1 : network.nodes + 1],
        "seconds": seconds - handing,
        "processor": busy - handing,
        "handing": handing,
    }


def main() -> None:
    key, steps, output = sys.argv[1], int(sys.argv[2]), sys.argv[3]
    np.savez(output, **solve(cases.make(key), steps))


if __name__ == "__main__":
    main()
