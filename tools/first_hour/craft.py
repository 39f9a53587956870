"""A craft of the newcomer's own as glTF, and what a hand calculation says of its temperatures."""

from pathlib import Path

import numpy as np
from oracle import gltf

SIGMA = 5.670374419e-8
EARTH_RADIUS = 6371e3
# Half lengths of the bus [m], and the wings: sheets along +Y and -Y at its upper edges.
BUS = np.array([0.4, 0.3, 0.5])
WING = (0.4, 1.2)
# The telescope on the bus: a closed cylinder with its radius, height and number of sides.
TELESCOPE = (0.22, 0.5, 16)


def _quads() -> dict[str, tuple[str, list[np.ndarray]]]:
    """Faces of each part, counter-clockwise from outside, with the material of the part."""
    x, y, z = BUS
    corner = lambda *signs: BUS * signs  # noqa: E731
    sides = [
        [corner(1, -1, -1), corner(1, 1, -1), corner(1, 1, 1), corner(1, -1, 1)],
        [corner(-1, 1, -1), corner(-1, -1, -1), corner(-1, -1, 1), corner(-1, 1, 1)],
        [corner(1, 1, -1), corner(-1, 1, -1), corner(-1, 1, 1), corner(1, 1, 1)],
        [corner(-1, -1, -1), corner(1, -1, -1), corner(1, -1, 1), corner(-1, -1, 1)],
    ]
    top = [corner(-1, -1, 1), corner(1, -1, 1), corner(1, 1, 1), corner(-1, 1, 1)]
    bottom = [corner(-1, 1, -1), corner(1, 1, -1), corner(1, -1, -1), corner(-1, -1, -1)]
    radius, height, count = TELESCOPE
    angles = 2 * np.pi * np.arange(count + 1) / count
    rim = np.stack([radius * np.cos(angles), radius * np.sin(angles), np.full(count + 1, z)], 1)
    up, middle = np.array([0, 0, height]), np.array([0, 0, z])
    tube = [[rim[i], rim[i + 1], rim[i + 1] + up, rim[i] + up] for i in range(count)]
    tube += [[middle + up, rim[i] + up, rim[i + 1] + up] for i in range(count)]
    tube += [[middle, rim[i + 1], rim[i]] for i in range(count)]
    wide, long = WING
    wing = lambda sign: [  # noqa: E731
        [np.array([sx * wide, sign * (y + t * long), z]) for sx, t in ((-1, 0), (1, 0), (1, 1), (-1, 1))][:: int(sign)]
    ]
    parts = {
        "Bus": ("PAINT_WHITE", [*sides, top]),
        "Nadir_Deck": ("MLI_GOLD", [bottom]),
        "Telescope": ("PAINT_WHITE", tube),
        "Wing_L": ("CELLS", wing(1.0)),
        "Wing_R": ("CELLS", wing(-1.0)),
    }
    assert x == wide, "the wings are as wide as the bus"
    return {name: (material, [np.array(face, float) for face in faces]) for name, (material, faces) in parts.items()}


def write(path: Path) -> None:
    """Writes the craft as one binary glTF with flat normals."""
    triangles = {
        name: [face[[0, i, i + 1]] for face in faces for i in range(1, len(face) - 1)] for name, (_, faces) in _quads().items()
    }
    gltf.write(path, [gltf.Part(name, material, np.array(triangles[name])) for name, (material, _) in _quads().items()])


def corners() -> np.ndarray:
    """All corners of the craft, body frame [m]."""
    return np.concatenate([place for _, faces in _quads().values() for place in faces])


class HandCalculation:
    """One node for the whole craft on the orbit of the tutorial, and bounds that no surface can leave.

    surfaces are the tables of the tutorial's `surfaces.toml` by the material of the model; orbit and environment those of its scene.
    """

    def __init__(self, surfaces: dict[str, dict], orbit: dict, environment: dict) -> None:
        self.radius = EARTH_RADIUS + orbit["altitude"]
        self.beta = np.radians(orbit["beta_deg"])
        self.sun, self.albedo, self.infrared = (environment[key] for key in ("solar_constant", "albedo", "planet_ir"))
        self.surfaces = surfaces
        self.faces = []
        for material, faces in _quads().values():
            surface = surfaces[material]
            for face in faces:
                area = 0.5 * sum((np.cross(face[i] - face[0], face[i + 1] - face[0]) for i in range(1, len(face) - 1)), np.zeros(3))
                self.faces.append((area, surface["absorptivity"], surface["emissivity"]))
                if surface.get("sides") == "both":
                    self.faces.append((-area, surface["back"]["absorptivity"], surface["back"]["emissivity"]))

    def _to_planet(self, normal: np.ndarray) -> float:
        """View factor of a face to the planet: closed forms for faces down, up and level (Gilmore, appendix of view factors)."""
        share = EARTH_RADIUS / self.radius
        level = (np.arcsin(share) - share * np.sqrt(1 - share**2)) / np.pi
        return share**2 if normal[2] < -0.5 else 0.0 if normal[2] > 0.5 else level

    def mean(self, absorbs: float = 1.0) -> float:
        """Temperature of the whole craft as one node in the mean of an orbit [K]. Faces do not shade or see each other. The absorptivities are taken times `absorbs`."""
        angles = 2 * np.pi * (np.arange(360) + 0.5) / 360
        cos_beta = np.cos(self.beta)
        sun = np.stack([-cos_beta * np.sin(angles), np.full(360, np.sin(self.beta)), cos_beta * np.cos(angles)], 1)
        lit = sun[:, 2] > -np.sqrt(1 - (EARTH_RADIUS / self.radius) ** 2)
        gained = emitted = 0.0
        for area, alpha, epsilon in self.faces:
            size = np.linalg.norm(area)
            seen = self._to_planet(area / size)
            direct = (np.clip(sun @ area, 0, None) * lit).mean()
            reflected = self.albedo * seen * size * np.clip(sun[:, 2], 0, None).mean()
            gained += absorbs * alpha * self.sun * (direct + reflected) + epsilon * seen * size * self.infrared
            emitted += epsilon * size * SIGMA
        return (gained / emitted) ** 0.25

    def bounds(self) -> tuple[float, float]:
        """The coldest and the hottest that any surface can be [K].

        The hottest face is insulated and has the Sun overhead and the whole planet before it. The coldest sheet begins the eclipse at the mean of the craft and then radiates
        to the sky alone: 1/T^3 = 1/T0^3 + 3 sigma epsilon t / C.
        """
        hottest, coldest = 0.0, np.inf
        period = 2 * np.pi * np.sqrt(self.radius**3 / 3.986004418e14)
        eclipse = period * np.arcsin(EARTH_RADIUS / self.radius) / np.pi
        for surface in self.surfaces.values():
            sides = [surface] + ([surface["back"]] if "back" in surface else [])
            for side in sides:
                load = side["absorptivity"] * self.sun * (1 + self.albedo) + side["emissivity"] * self.infrared
                hottest = max(hottest, (load / side["emissivity"] / SIGMA) ** 0.25)
            capacity = surface["thickness"] * surface["density"] * surface["specific_heat"]
            rate = 3 * SIGMA * sum(side["emissivity"] for side in sides) * eclipse / capacity
            coldest = min(coldest, (self.mean() ** -3 + rate) ** (-1 / 3))
        return coldest, hottest
