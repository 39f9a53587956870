"""Thermal-infrared images of spacecraft whose surfaces store heat.

>>> import isotherm
>>> simulation = isotherm.Simulation("models/station.toml")
>>> simulation.step_to(1200.0)
>>> frame = simulation.image()
>>> frame.temperature.max()

Vectors have three numbers. Quaternions are scalar-first: (w, x, y, z). Camera axes are those of OpenCV: +X right, +Y down, +Z forward. All units are SI.
"""

from ._errors import DeviceError, IsothermError, RequestError, SceneError
from ._native import Camera, Frame, PartTemperature, Simulation, Sky, __version__, devices, fit, validation_messages

__all__ = [
    "Camera",
    "DeviceError",
    "Frame",
    "IsothermError",
    "PartTemperature",
    "RequestError",
    "SceneError",
    "Simulation",
    "Sky",
    "__version__",
    "devices",
    "fit",
    "validation_messages",
]
