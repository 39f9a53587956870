"""The Sun on a circular orbit with the nadir attitude, and the profile of an eclipse. Needs numpy alone."""

import numpy as np

SUN_RADIUS, SUN_DISTANCE, MU = 6.957e8, 149_597_870_700.0, 3.986004418e14


def period(radius: float) -> float:
    """Kepler's [s] for the radius of an orbit of the Earth [m]."""
    return float(2 * np.pi * np.sqrt(radius**3 / MU))


def sun_of_body(angle: float, beta: float) -> np.ndarray:
    """Unit vector to the Sun: +X along the velocity, +Z to nadir, at an angle from orbit noon [rad]."""
    sun = np.array([np.cos(beta), 0.0, np.sin(beta)])
    along, zenith = np.array([-np.sin(angle), np.cos(angle), 0.0]), np.array([np.cos(angle), np.sin(angle), 0.0])
    return np.array([sun @ along, -sun[2], -(sun @ zenith)])


def lit(angle: float, beta: float, planet: float, orbit: float) -> float:
    """Share of the Sun's disc that a sphere leaves free, by counting places on the disc: no formula of two circles."""
    craft = orbit * np.array([np.cos(angle), np.sin(angle), 0.0])
    to_sun = SUN_DISTANCE * np.array([np.cos(beta), 0.0, np.sin(beta)]) - craft
    sun = to_sun / np.linalg.norm(to_sun)
    down = -craft / orbit
    size, limb = np.arcsin(SUN_RADIUS / np.linalg.norm(to_sun)), np.arcsin(planet / orbit)
    between = np.arccos(np.clip(sun @ down, -1, 1))
    if between > limb + size:
        return 1.0
    if between < limb - size:
        return 0.0
    across = np.cross(sun, down)
    across /= np.linalg.norm(across)
    other = np.cross(sun, across)
    grid = (np.arange(400) + 0.5) / 200 - 1
    x, y = np.meshgrid(grid, grid)
    inside = x * x + y * y < 1
    spread = np.tan(size) * np.column_stack([x[inside], y[inside]])
    directions = sun + spread[:, :1] * across + spread[:, 1:] * other
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return float(np.mean(directions @ down < np.cos(limb)))


class Eclipse:
    """The lit share over time, with a table around each contact."""

    def __init__(self, phase: float, beta: float, planet: float, orbit: float, end: float) -> None:
        turn = 2 * np.pi / period(orbit)
        times = np.arange(0.0, end + 1.0)
        share = np.array([lit(phase + turn * time, beta, planet, orbit) for time in times])
        # Every second near a contact is divided into twenty.
        partial = (share > 0) & (share < 1)
        near = partial | np.roll(partial, 1) | np.roll(partial, -1) | (np.abs(np.gradient(share)) > 0)
        fine = np.unique(np.concatenate([times, *(time + np.arange(-20, 21) / 20 for time in times[near])]))
        self.times = fine[(fine >= 0) & (fine <= end)]
        self.share = np.array([lit(phase + turn * time, beta, planet, orbit) for time in self.times])

    def __call__(self, time: float) -> float:
        return float(np.interp(time, self.times, self.share))
