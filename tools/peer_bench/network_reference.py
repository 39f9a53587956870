"""The solution that all networks are held against: Runge-Kutta of order 4 in f64, so finely that three quarters of the steps differ by less
than a hundredth of the errors in question.

    python -m peer_bench.network_reference CASE OUT.npz

Steps end where the heat has a corner. The slivers relax too fast for an explicit method: theirs is scipy's Radau at 1e-7 K.
"""

import sys

import numpy as np

from peer_bench import network_cases as cases
from peer_bench.network_cases import Floats
from peer_bench.network_eliminated import Eliminated, eliminate
from peer_bench.network_radau import solve

# Product of the fastest rate and the step; stable is up to 2.78.
PRODUCT = 1.3
RADAU_TOLERANCE = 1e-7


def fastest(problem: Eliminated) -> float:
    """Fastest rate of conduction [1/s]; radiation adds a thousandth of it in these cases."""
    return float(2.0 * np.abs(problem.linear.diagonal()).max())


def runge_kutta(problem: Eliminated, parts: int) -> Floats:
    """Rows [K] at the compared times with so many steps in each of the orbit's 360."""
    t, span = problem.start.copy(), cases.STEP / parts
    rows = [problem.whole(0.0, t)]
    for step in range(cases.STEPS):
        for part in range(parts):
            now = (step + part / parts) * cases.STEP
            first, last = problem.heat(now), problem.heat(now + span * (1.0 - 1e-12))
            middle = 0.5 * (first + last)
            a = problem.rate(first, t)
            b = problem.rate(middle, t + 0.5 * span * a)
            c = problem.rate(middle, t + 0.5 * span * b)
            d = problem.rate(last, t + span * c)
            t = t + span / 6.0 * (a + 2.0 * (b + c) + d)
        if (step + 1) % cases.STRIDE == 0:
            rows.append(problem.whole((step + 1) * cases.STEP, t))
    return np.array(rows)


def reference(key: str) -> tuple[Floats, str, float]:
    """Rows [K], what made them, and how far a coarser solution is from them [K]."""
    problem = eliminate(cases.make(key))
    parts = 2 * int(np.ceil(0.5 * fastest(problem) * cases.STEP / PRODUCT))
    if parts > 500:
        rows, coarse = solve(problem, RADAU_TOLERANCE)[0], solve(problem, 10.0 * RADAU_TOLERANCE)[0]
        return rows, f"scipy Radau, {RADAU_TOLERANCE:g} K", float(np.abs(rows - coarse).max())
    rows, coarse = runge_kutta(problem, parts), runge_kutta(problem, max(1, parts * 3 // 4))
    return rows, f"Runge-Kutta 4, steps of {1e3 * cases.STEP / parts:.0f} ms", float(np.abs(rows - coarse).max())


def main() -> None:
    key, output = sys.argv[1], sys.argv[2]
    rows, name, doubt = reference(key)
    np.savez(output, rows=rows, name=name, doubt=doubt)


if __name__ == "__main__":
    main()
