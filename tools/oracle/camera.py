"""A pinhole camera as scenes state it: +X right, +Y down, +Z forward. Needs numpy alone."""

from dataclasses import dataclass

import numpy as np


@dataclass
class Camera:
    position: tuple[float, float, float]
    look_at: tuple[float, float, float]
    fov_deg: float
    width: int = 160
    height: int = 120
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)

    def rays(self) -> tuple[np.ndarray, np.ndarray]:
        """Origins and unit directions through the centres of all pixels, row by row."""
        forward = np.subtract(self.look_at, self.position).astype(float)
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, self.up)
        right /= np.linalg.norm(right)
        down = np.cross(forward, right)
        focal = 0.5 * self.width / np.tan(np.radians(self.fov_deg) / 2)
        u, v = np.meshgrid(np.arange(self.width) + 0.5 - self.width / 2, np.arange(self.height) + 0.5 - self.height / 2)
        directions = (u.ravel()[:, None] * right + v.ravel()[:, None] * down) / focal + forward
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        return np.broadcast_to(np.asarray(self.position, float), directions.shape), directions

    def toml(self) -> str:
        return (
            f"[camera]\nwidth = {self.width}\nheight = {self.height}\nfov_deg = {self.fov_deg}\nsamples = 1\nframe = \"body\"\n"
            f"position = {list(map(float, self.position))}\nlook_at = {list(map(float, self.look_at))}\nup = {list(map(float, self.up))}\n"
        )
