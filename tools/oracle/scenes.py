"""The text of scenes. Needs numpy alone."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from . import gltf
from .camera import Camera


def still_sun(beta_deg: float) -> str:
    """A craft whose body axes are the inertial ones, before a Sun at (cos beta, 0, sin beta), without planet."""
    return (
        f"[orbit]\naltitude = 408e3\nbeta_deg = {beta_deg}\n[attitude]\nmode = \"inertial\"\nquaternion = [1, 0, 0, 0]\n"
        "[environment]\nsolar_constant = 1361.0\neclipse = false\n"
    )


def spin(beta_deg: float, rate_deg: float) -> str:
    """The same, but the craft turns about its +Z by so many degrees a second."""
    return still_sun(beta_deg).replace('mode = "inertial"', f'mode = "spin"\nspin_axis = "+Z"\nrate_deg = {rate_deg}')


def turning_sun(beta_deg: float, rate_deg: float) -> Callable[[float], tuple[np.ndarray, float]]:
    """Direction of the Sun in the body of such a craft at a time, and its flux [W/m2]."""

    def sun(time: float) -> tuple[np.ndarray, float]:
        turn, beta = np.radians(rate_deg * time), np.radians(beta_deg)
        return np.array([np.cos(beta) * np.cos(turn), -np.cos(beta) * np.sin(turn), np.sin(beta)]), 1361.0

    return sun


def material(name: str, absorptivity: float, emissivity: float, capacity: float, back: tuple[float, float] | None = None, conducts: float | None = None) -> str:
    """A plate of a heat capacity [J/(m2 K)]; `conducts` is conductivity times thickness [W/K] of a network."""
    text = f"[[material]]\nmatch = \"{name}\"\nabsorptivity = {absorptivity}\nemissivity = {emissivity}\n"
    text += f"heat_capacity_per_area = {capacity}\nthickness = 0.001\n"
    text += "sides = \"outside\"\n" if back is None else f"sides = \"both\"\nback = {{ absorptivity = {back[0]}, emissivity = {back[1]} }}\n"
    return text + ("response = \"radiative\"\n" if conducts is None else f"response = \"network\"\nconductivity = {conducts / 0.001}\n")


def write(folder: Path, parts: list[gltf.Part], sections: list[str], camera: Camera, time: str, initial: float | None, max_edge: float | str | None) -> Path:
    """A scene and its model in a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    gltf.write(folder / "model.glb", parts)
    model = "[model]\npath = \"model.glb\"\n" + (f"max_edge = {max_edge}\n" if max_edge else "")
    start = f"[initial]\ntemperature = {initial}\n" if initial else ""
    path = folder / "scene.toml"
    path.write_text("\n".join([f"name = \"{folder.name}\"", model, f"[time]\n{time}", start, camera.toml(), *sections]) + "\n")
    return path
