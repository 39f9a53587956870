"""Heat of a surface over time: conduction by finite elements, radiation, light, and a second-order Rosenbrock method."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from .case import SIGMA
from .radiosity import Radiosity, Side
from .surface import Surface

GAMMA = 1 - 1 / np.sqrt(2)


@dataclass
class Finish:
    """What a material is: optics, heat capacity [J/(m2 K)], conductivity times thickness [W/K], the other side, and a structure below."""

    absorptivity: float
    emissivity: float
    capacity: float
    back: tuple[float, float] | None = None
    conducts: float = 0.0
    # Effective emittance, heat capacity [J/(m2 K)] and conductivity times thickness [W/K].
    over: tuple[float, float, float] | None = None


class Balance:
    """All vertices of a surface, and after them the structures below."""

    def __init__(self, surface: Surface, finishes: dict[str, Finish]) -> None:
        self.surface = surface
        of_parts = [finishes[part.material] for part in surface.parts]

        def of(numbers: list[float], index: np.ndarray) -> np.ndarray:
            return np.array(numbers)[index]

        front = np.arange(len(surface.faces))
        two = of([float(f.back is not None) for f in of_parts], surface.part_of) > 0
        face = np.concatenate([front, front[two]])
        sign = np.concatenate([np.ones(len(front)), -np.ones(int(two.sum()))])
        emissivity = np.concatenate([of([f.emissivity for f in of_parts], surface.part_of), of([f.back[1] if f.back else 0.0 for f in of_parts], surface.part_of[two])])
        absorptivity = np.concatenate([of([f.absorptivity for f in of_parts], surface.part_of), of([f.back[0] if f.back else 0.0 for f in of_parts], surface.part_of[two])])
        self.side = Side(face, sign, emissivity, absorptivity)
        count = len(surface.vertices)
        below = np.flatnonzero(of([float(f.over is not None) for f in of_parts], surface.vertex_part) > 0)
        self.below, self.count = below, count
        over = [f.over or (0.0, 0.0, 0.0) for f in of_parts]
        area = surface.vertex_area
        self.area = np.concatenate([area, area[below]])
        self.capacity = np.concatenate([area * of([f.capacity for f in of_parts], surface.vertex_part), area[below] * of([o[1] for o in over], surface.vertex_part[below])])
        skin = surface.conduction(of([f.conducts for f in of_parts], surface.part_of))
        structure = surface.conduction(of([o[2] for o in over], surface.part_of))[below][:, below]
        self.stiffness = sparse.block_diag([skin, structure]).tocsr()
        self.emissive = np.zeros(len(self.area))
        sums = np.bincount(face, emissivity, len(front))
        self.emissive[:count] = surface.to_vertices @ sums
        self.coupling = area[below] * of([o[0] for o in over], surface.vertex_part[below])

    def rate(self, kelvin: np.ndarray, absorbed: np.ndarray) -> np.ndarray:
        """K/s under a flux [W/m2] that the vertices absorb."""
        fourth = SIGMA * kelvin**4
        power = -(self.stiffness @ kelvin) - self.area * self.emissive * fourth
        power[: self.count] += self.surface.vertex_area * absorbed
        exchanged = self.coupling * (fourth[self.count :] - fourth[self.below])
        power[self.below] += exchanged
        power[self.count :] -= exchanged
        return power / self.capacity

    def solver(self, kelvin: np.ndarray, step: float):
        """Factors of 1 - gamma h J, without what other faces send."""
        slope = 4 * SIGMA * kelvin**3
        diagonal = self.area * self.emissive * slope
        outer, inner = self.coupling * slope[self.below], self.coupling * slope[self.count :]
        diagonal[self.below] += outer
        diagonal[self.count :] += inner
        size, first = len(self.area), np.arange(len(self.below)) + self.count
        cross = sparse.csr_matrix((np.concatenate([inner, outer]), (np.concatenate([self.below, first]), np.concatenate([first, self.below]))), (size, size))
        jacobian = sparse.diags(1 / self.capacity) @ (cross - self.stiffness - sparse.diags(diagonal))
        return splu(sparse.csc_matrix(sparse.identity(size) - GAMMA * step * jacobian))

    def run(self, initial: float, step: float, steps: int, absorbed: Callable[[float, np.ndarray], np.ndarray], keep: list[int], renew: int = 4, parts: int = 1) -> dict[int, np.ndarray]:
        """Temperatures of the vertices after some steps. `absorbed` gives a flux of the vertices at a time and a state; a step is taken in parts."""
        kelvin = np.full(len(self.area), float(initial))
        found = {}
        small = step / parts
        for number in range(steps * parts):
            if number % parts == 0 and number // parts in keep:
                found[number // parts] = kelvin[: self.count].copy()
            if number % renew == 0:
                factors = self.solver(kelvin, small)
            # Slightly inside the step, so that a load that jumps between steps is the right one.
            begin, end = (number + 1e-6) * small, (number + 1 - 1e-6) * small
            first = factors.solve(self.rate(kelvin, absorbed(begin, kelvin[: self.count])))
            guess = kelvin + small * first
            second = factors.solve(self.rate(guess, absorbed(end, guess[: self.count])) - 2 * first)
            kelvin = kelvin + small * (1.5 * first + 0.5 * second)
        if steps in keep:
            found[steps] = kelvin[: self.count].copy()
        return found


class Absorbed:
    """What vertices absorb: light of Sun and planet on the sides, and the infrared that sides send each other."""

    def __init__(self, balance: Balance, exchange: Radiosity | None) -> None:
        self.balance, self.exchange = balance, exchange
        self.side, self.surface = balance.side, balance.surface
        self.faces = sparse.csr_matrix((np.ones(len(self.side.face)), (self.side.face, np.arange(len(self.side.face)))), (len(self.surface.faces), len(self.side.face)))

    def light(self, direct: np.ndarray, infrared: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Flux of the vertices from sunlight (with the planet's) that arrives on the sides [W/m2], and the infrared that arrives from outside."""
        if self.exchange is not None:
            direct = self.exchange.received(np.zeros_like(direct), direct, 1)
        return self.surface.to_vertices @ (self.faces @ (self.side.absorptivity * direct)), infrared

    def total(self, light: np.ndarray, infrared: np.ndarray, kelvin: np.ndarray) -> np.ndarray:
        if self.exchange is not None:
            sent = self.side.emissivity * SIGMA * (self.surface.of_corners @ kelvin**4)[self.side.face]
            infrared = self.exchange.received(sent, infrared, 0)
        return light + self.surface.to_vertices @ (self.faces @ (self.side.emissivity * infrared))
