"""A network by scipy's Radau, as one would call it: a sparse exact Jacobian, and no step over a corner of the heat's.

python -m peer_bench.network_radau CASE TOLERANCE OUT.npz
"""

import sys
import time

import numpy as np
import scipy.integrate
import scipy.sparse

from peer_bench import network_cases as cases
from peer_bench.network_cases import SIGMA, Floats
from peer_bench.network_eliminated import Eliminated, eliminate


def solve(problem: Eliminated, tolerance: float) -> tuple[Floats, int]:
    """Rows [K] at the compared times, and evaluations."""
    linear = problem.linear.tocsc()
    radiated = 4.0 * problem.sky_area * SIGMA / problem.capacitance

    def jacobian(_: float, t: Floats) -> scipy.sparse.csc_matrix:
        return linear - scipy.sparse.diags(radiated * t**3, format="csc")

    times = cases.row_times()
    found = scipy.integrate.solve_ivp(
        lambda now, t: problem.rate(problem.heat(now), t),
        (0.0, cases.PERIOD),
        problem.start,
        method="Radau",
        jac=jacobian,
        t_eval=times,
        rtol=1e-9,
        atol=tolerance,
        max_step=cases.EVERY * cases.STEP,
    )
    if not found.success:
        raise RuntimeError(found.message)
    rows = [problem.whole(now, t) for now, t in zip(times, found.y.T, strict=True)]
    return np.array(rows), int(found.nfev)


def main() -> None:
    key, tolerance, output = sys.argv[1], float(sys.argv[2]), sys.argv[3]
    problem = eliminate(cases.make(key))
    began, processor = time.perf_counter(), time.process_time()
    rows, evaluations = solve(problem, tolerance)
    seconds, busy = time.perf_counter() - began, time.process_time() - processor
    np.savez(output, rows=rows, seconds=seconds, processor=busy, evaluations=evaluations)


if __name__ == "__main__":
    main()
