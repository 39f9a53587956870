"""The fit of `tests/it/fit.rs` by scipy: integration by Radau, the minimum by scipy.optimize.least_squares.

usage: python3 tools/oracle/fitted.py tests/oracle/fit_network.csv

Writes telemetry of a network of two nodes with hidden values, noise of 0.5 K and a glitch of 8 K, and prints the fitted logarithms and their standard deviations. Needs numpy and scipy.
"""

import sys

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

SIGMA = 5.670374419e-8
START = [285.0, 288.0]
# Capacitance and emissive area of the panel, and the conductance: as the file states them, and hidden.
STATED = np.array([120.0, 0.0085, 0.35])
HIDDEN = np.array([100.0, 0.0095, 0.5])
# Two standard deviations of the logarithms of the priors.
PRIOR = np.log1p(np.array([0.4, 0.4, 1.0])) / 2
TIMES = np.arange(100.0, 5601.0, 100.0)
NOISE, SCALE = 0.5, 3.0


def temperatures(values):
    capacitance, area, conductance = values

    def slopes(_, t):
        passed = conductance * (t[0] - t[1])
        lost = area * SIGMA * (t[0] ** 4 - 2.7**4)
        return [(9.0 - lost - passed) / capacitance, passed / 450.0]

    solved = solve_ivp(slopes, (0.0, TIMES[-1]), START, "Radau", TIMES, rtol=1e-10, atol=1e-10)
    return solved.y.T.ravel()


def main():
    noise = np.random.default_rng(34).normal(0.0, NOISE, 2 * len(TIMES))
    measured = temperatures(HIDDEN) + noise
    measured[24] += 8.0
    measured = np.round(measured, 4)
    with open(sys.argv[1], "w", encoding="utf-8") as table:
        table.write("time,sensor,temperature,sigma\n")
        for row, time in enumerate(TIMES):
            for node, name in enumerate(("panel", "structure")):
                table.write(f"{time:.0f},{name},{measured[2 * row + node]:.4f},{NOISE}\n")

    def residuals(x):
        data = (temperatures(STATED * np.exp(x)) - measured) / NOISE
        return np.concatenate([data, x / PRIOR])

    fitted = least_squares(residuals, np.zeros(3), "3-point", loss="huber", f_scale=SCALE, xtol=1e-12, ftol=1e-14)
    moved = 1e-5 * np.eye(3)
    slopes = np.array([(residuals(fitted.x + step) - residuals(fitted.x - step)) / 2e-5 for step in moved]).T
    weights = np.minimum(1.0, SCALE / np.abs(residuals(fitted.x)))
    covariance = np.linalg.inv(slopes.T @ (weights[:, None] * slopes))
    deviations = np.sqrt(np.diag(covariance))
    print("logarithms", ", ".join(f"{x:.6f}" for x in fitted.x))
    print("deviations", ", ".join(f"{deviation:.6f}" for deviation in deviations))
    print("correlation of the first two", f"{covariance[0, 1] / deviations[0] / deviations[1]:.5f}")


if __name__ == "__main__":
    main()
