"""Truth of plates that conduct nothing: an ordinary differential equation at each place."""

import numpy as np
from scipy.integrate import solve_ivp

from .case import SIGMA


def temperatures(absorbed: np.ndarray, emissivity: np.ndarray, capacity: np.ndarray, initial: float, times: list[float]) -> np.ndarray:
    """Temperatures (times, places) under a constant absorbed flux [W/m2]. `emissivity` is the sum over the sides."""

    def rate(_: float, kelvin: np.ndarray) -> np.ndarray:
        return (absorbed - emissivity * SIGMA * kelvin**4) / capacity

    start = np.full(len(absorbed), float(initial))
    found = solve_ivp(rate, (0, max(times)), start, "DOP853", times, rtol=1e-9, atol=1e-6)
    return found.y.T
