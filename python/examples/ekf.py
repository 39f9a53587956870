"""An extended Kalman filter follows a satellite by its thermal images.

A chaser flies round the satellite of ``models/cubesat.toml``. Its filter estimates position and velocity in the satellite's orbit frame (X along the velocity,
Z to nadir) from two measurements an image: the centroid of the warm pixels, and a range finder's distance, which is the depth of the image with noise.
The loop is closed: the camera points to where the filter believes the satellite is.

    python python/examples/ekf.py
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

import isotherm

Array: TypeAlias = npt.NDArray[np.float64]

SCENE = Path(__file__).parents[2] / "models/cubesat.toml"
INTERVAL = 2.0  # Between two images [s].
RANGE_NOISE = 0.05  # Of the range finder, standard deviation [m].
PUSH = 2e-5  # Acceleration that the filter does not know, standard deviation [m/s2].
# What a centroid and a range are off from the satellite's origin, by its shape [m].
SHAPE = 0.05
NARROW = isotherm.Camera(160, 120, fx=1400)


def transition(rate: float, time: float) -> Array:
    """Clohessy and Wiltshire's motion over a time [s], about an orbit of this angular rate [rad/s]: x along the velocity, z to nadir."""
    generator = np.zeros((6, 6))
    generator[:3, 3:] = np.eye(3)
    generator[3, 5] = 2 * rate
    generator[4, 1] = -(rate**2)
    generator[5, 2], generator[5, 3] = 3 * rate**2, -2 * rate
    matrix, term = np.eye(6), np.eye(6)
    for order in range(1, 8):
        term = term @ generator * time / order
        matrix = matrix + term
    return matrix


def measured(position: Array, camera_from_orbit: Array, camera: isotherm.Camera) -> tuple[Array, Array]:
    """Pixel of the satellite's origin and its distance, and their derivatives by the chaser's position."""
    x, y, z = camera_from_orbit @ -position
    pixel = [camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy, z]
    by_camera = np.array(
        [[camera.fx / z, 0, -camera.fx * x / z**2], [0, camera.fy / z, -camera.fy * y / z**2], [0, 0, 1]]
    )
    return np.array(pixel), by_camera @ -camera_from_orbit


def observed(frame: isotherm.Frame, noise: float) -> Array | None:
    """Centroid of the warm pixels [px] and distance [m]. None where nothing is in view."""
    weights = (
        np.where(frame.radiance > 0.2 * frame.radiance.max(), 1.0, 0.0) if frame.radiance.max() > 0 else frame.radiance
    )
    if weights.sum() == 0:
        return None
    rows, columns = np.indices(weights.shape)
    column, row = (float((weights * (axis + 0.5)).sum() / weights.sum()) for axis in (columns, rows))
    depths = frame.depth[(weights > 0) & (frame.part > 0)]
    return np.array([column, row, float(depths.mean()) + noise])


def main() -> None:
    parser = argparse.ArgumentParser(description="Follow a satellite by its thermal images.")
    parser.add_argument("--images", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()

    random = np.random.default_rng(arguments.seed)
    simulation = isotherm.Simulation(SCENE)
    rate = 2 * np.pi / 5554.7
    step = transition(rate, INTERVAL)
    # A drifting ellipse: 25 m behind, with some motion across the orbit.
    truth = np.array([-25.0, 4.0, 3.0, 0.012, 0.004, -0.006])
    spread = np.diag([1.0, 1.0, 1.0, 0.02, 0.02, 0.02]) ** 2
    state = truth + np.sqrt(np.diag(spread)) * random.standard_normal(6) * 0.5
    by_push = np.vstack([np.eye(3) * INTERVAL**2 / 2, np.eye(3) * INTERVAL])
    process = by_push @ by_push.T * PUSH**2
    errors, inside, missed = [], 0, 0
    for image in range(arguments.images):
        simulation.step_to(INTERVAL * image)
        # The chaser is where it is, and looks where it believes the satellite to be.
        frame = simulation.image(position=truth[:3], look_at=truth[:3] - state[:3], frame="orbit", camera=NARROW)
        seen = observed(frame, RANGE_NOISE * random.standard_normal())
        if seen is None:
            missed += 1
        else:
            camera_from_orbit = frame.camera_from_body[:3, :3] @ simulation.sky.body_from_orbit
            expected, derivative = measured(state[:3], camera_from_orbit, frame.camera)
            along = np.hstack([derivative, np.zeros((3, 3))])
            pixels = SHAPE * frame.camera.fx / expected[2]
            noise = np.diag([pixels, pixels, np.hypot(RANGE_NOISE, SHAPE)]) ** 2
            gain = spread @ along.T @ np.linalg.inv(along @ spread @ along.T + noise)
            state = state + gain @ (seen - expected)
            keep = np.eye(6) - gain @ along
            spread = keep @ spread @ keep.T + gain @ noise @ gain.T
        error = state - truth
        errors.append(float(np.linalg.norm(error[:3])))
        inside += bool((np.abs(error[:3]) < 3 * np.sqrt(np.diag(spread)[:3])).all())
        if image % max(1, arguments.images // 10) == 0:
            sigma = 3 * np.sqrt(np.trace(spread[:3, :3]))
            temperature = float(frame.temperature.max())
            print(
                f"{simulation.time:6.0f} s  {np.linalg.norm(truth[:3]):6.2f} m away  error {errors[-1]:.3f} m, 3 sigma {sigma:.3f} m  {temperature:.1f} K"
            )
        truth = step @ truth + by_push @ (PUSH * random.standard_normal(3))
        state, spread = step @ state, step @ spread @ step.T + process
    half = errors[len(errors) // 2 :]
    print(f"{arguments.images} images, {missed} without the craft, {inside} within 3 sigma")
    print(
        f"position error of the second half, rms: {np.sqrt(np.mean(np.square(half))):.4f} m; last position error {errors[-1]:.4f} m"
    )


if __name__ == "__main__":
    main()
