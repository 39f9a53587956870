"""What faces send each other and get from the planet: rays of Embree, and linear systems of patches."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.linalg import lu_factor, lu_solve

from .rays import Rays, hemisphere, in_triangles, numbers
from .surface import Surface


@dataclass
class Side:
    """One side of every face that has it: sides are numbered one after the other."""

    face: np.ndarray
    # 1 along the normal, -1 against it.
    sign: np.ndarray
    emissivity: np.ndarray
    absorptivity: np.ndarray


class Radiosity:
    """View factors from sides to patches, and to the planet in the direction `down` (unit, body frame) of an angular radius [rad]. `alone`: faces see no other."""

    def __init__(self, surface: Surface, side: Side, patch: float, rays: int, planet: tuple[np.ndarray, float] | None = None, triangles: np.ndarray | None = None, seed: int = 1, patches: tuple[np.ndarray, int] | None = None, alone: bool = False) -> None:
        placed = surface.triangles if triangles is None else triangles
        normals = np.cross(placed[:, 1] - placed[:, 0], placed[:, 2] - placed[:, 0])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-15)
        self.side, self.area = side, surface.area[side.face]
        self.patch_of, self.count = patches if patches is not None else patches_of(surface, side, patch)
        scene = Rays(placed)
        number = np.full((len(surface.faces), 2), -1)
        number[side.face, (side.sign < 0).astype(int)] = np.arange(len(side.face))
        out = normals[side.face] * side.sign[:, None]
        counts = sparse.csr_matrix((len(side.face), self.count))
        self.inner = np.zeros(len(side.face))
        self.planet_rays: list[tuple[np.ndarray, np.ndarray]] = []
        random = np.random.default_rng(seed)
        shift = random.random((len(side.face), 4))
        everyone = np.arange(len(side.face))
        for unit in numbers(rays, 4, seed):
            turned = (unit + shift) % 1.0
            origins = in_triangles(placed[side.face], turned[:, :2]) + 1e-4 * out
            directions = hemisphere(out, turned[:, 2:])
            hit = np.full(len(origins), -1) if alone else scene.first(origins, directions)[0]
            against = (directions * normals[hit]).sum(1) > 0
            met = np.where(hit >= 0, number[hit, against.astype(int)], -1)
            inner = (hit >= 0) & (met < 0)
            self.inner += inner
            good = met >= 0
            counts = counts + sparse.csr_matrix((np.ones(good.sum()), (everyone[good], self.patch_of[met[good]])), counts.shape)
            if planet is not None:
                self._planet(hit < 0, directions, planet)
        self.factors = counts / rays
        self.inner /= rays
        self.rays = rays
        weights = sparse.csr_matrix((self.area, (self.patch_of, everyone)), (self.count, len(everyone)))
        self.patch_area = np.asarray(weights.sum(1)).ravel()
        self.means = sparse.diags(1 / self.patch_area) @ weights
        # What meets the inner side of a skin comes back to where it started.
        between = (self.means @ self.factors).toarray() + np.diag(self.means @ self.inner)
        self.solvers = [self._solver(between, 1 - self.means @ of) for of in (side.emissivity, side.absorptivity)]
        self.scene, self.normals, self.number = scene, normals, number

    def _planet(self, free: np.ndarray, directions: np.ndarray, planet: tuple[np.ndarray, float]) -> None:
        """Keeps which sides see the planet along these directions, and its outward normal there."""
        down, angular = planet
        sees = np.flatnonzero(free & (directions @ down > np.cos(angular)))
        cosine = directions[sees] @ down
        sine = np.sin(angular)
        # Distances in units of the orbit's radius; the planet's radius is the sine of its apparent radius.
        distance = cosine - np.sqrt(np.maximum(0.0, sine**2 - 1 + cosine**2))
        normal = (distance[:, None] * directions[sees] - down) / sine
        self.planet_rays.append((sees, normal.astype(np.float32)))

    @staticmethod
    def _solver(between: np.ndarray, reflectivity: np.ndarray):
        if not reflectivity.any():
            return reflectivity, None
        return reflectivity, lu_factor(np.eye(len(between)) - reflectivity[:, None] * between)

    def planet_share(self) -> np.ndarray:
        """Share of each side's rays that meet the planet."""
        share = np.zeros(len(self.side.face))
        for sees, _ in self.planet_rays:
            share[sees] += 1 / self.rays
        return share

    def albedo_share(self, sun: np.ndarray) -> np.ndarray:
        """The same, each weighted with the cosine of the Sun on the planet."""
        share = np.zeros(len(self.side.face))
        for sees, normal in self.planet_rays:
            share[sees] += np.maximum(0.0, normal @ sun.astype(np.float32)) / self.rays
        return share

    def received(self, own: np.ndarray, arrives: np.ndarray, light: int) -> np.ndarray:
        """What arrives on each side [W/m2], where sides send `own` themselves and `arrives` comes from outside. `light`: 0 infrared, 1 sunlight."""
        sent = self.sent(own, arrives, light)
        return arrives + self.factors @ sent + self.inner * sent[self.patch_of]

    def sent(self, own: np.ndarray, arrives: np.ndarray, light: int) -> np.ndarray:
        """What leaves each patch [W/m2], with all reflections."""
        reflectivity, factors = self.solvers[light]
        sent = self.means @ own + reflectivity * (self.means @ arrives)
        return sent if factors is None else lu_solve(factors, sent)

    def seen_from(self, places: np.ndarray, normals: np.ndarray, rays: int, seed: int = 3) -> np.ndarray:
        """View factors (n, patches) from small plates of these unit normals."""
        factors = np.zeros((len(places), self.count))
        shift = np.random.default_rng(seed).random((len(places), 2))
        for unit in numbers(rays, 2, seed):
            directions = hemisphere(normals, (unit + shift) % 1.0)
            hit = self.scene.first(places + 1e-4 * normals, directions)[0]
            against = (directions * self.normals[hit]).sum(1) > 0
            met = np.where(hit >= 0, self.number[hit, against.astype(int)], -1)
            good = np.flatnonzero(met >= 0)
            factors[good, self.patch_of[met[good]]] += 1 / rays
        return factors


def patches_of(surface: Surface, side: Side, size: float) -> tuple[np.ndarray, int]:
    """Numbers of patches: sides of one part and normal in one cell of a grid."""
    centre = surface.triangles[side.face].mean(1)
    normal = surface.normals[side.face] * side.sign[:, None]
    key = np.column_stack([surface.part_of[side.face], side.sign, np.round(normal * 2), np.floor(centre / size + 0.5e-6)])
    _, patch = np.unique(key, axis=0, return_inverse=True)
    return patch.ravel(), int(patch.max()) + 1
