"""A loop: each image decides where the camera goes next."""

from pathlib import Path

import isotherm

simulation = isotherm.Simulation(Path(__file__).parents[2] / "models/cubesat.toml")
position = [4.0, 1.0, -2.0]
for second in range(0, 50, 10):
    simulation.step_to(second)
    frame = simulation.image(position=position, look_at=(0, 0, 0))
    seen = frame.part > 0
    print(f"{second} s: {frame.temperature[seen].mean():.2f} K, {frame.depth[seen].min():.2f} m")
    position = [0.9 * value for value in position]
