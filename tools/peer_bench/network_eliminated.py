"""A network without its arithmetic nodes, as the ordinary differential equations that general solvers take.

Each arithmetic node here is a blanket with one radiative conductor to the structure: its balance is linear in T^4, so that
it can be taken out exactly.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse

from peer_bench.network_cases import SIGMA, SPACE, Floats, Ints, Network


@dataclass(frozen=True)
class Eliminated:
    """The nodes that store heat, and how the others follow from them."""

    network: Network
    capacitance: Floats
    # Conduction over capacitance [1/s], and area that radiates to space, through a blanket or not [m2].
    linear: scipy.sparse.csr_matrix
    sky_area: Floats
    # Of every blanket: its node, the one below, its exchange area and its own emissive area [m2].
    over: Ints
    below: Ints
    area_below: Floats
    area_sky: Floats

    @property
    def start(self) -> Floats:
        return self.network.start[: len(self.capacitance)]

    def heat(self, now: float) -> Floats:
        """Heat of the nodes at a time, with what reaches them through blankets [W]."""
        heat = self.network.heat_at(now)
        own = heat[: len(self.capacitance)].copy()
        own[self.below] += heat[self.over] * self.area_below / (self.area_below + self.area_sky)
        return own

    def rate(self, heat: Floats, t: Floats) -> Floats:
        """dT/dt [K/s] under a heat."""
        square = t * t
        return (heat - self.sky_area * SIGMA * (square * square - SPACE**4)) / self.capacitance + self.linear @ t

    def whole(self, now: float, t: Floats) -> Floats:
        """Temperatures of all nodes [K]."""
        heat = self.network.heat_at(now)[self.over]
        fourth = heat / SIGMA + self.area_below * t[self.below] ** 4 + self.area_sky * SPACE**4
        return np.concatenate([t, (fourth / (self.area_below + self.area_sky)) ** 0.25])


def eliminate(network: Network) -> Eliminated:
    """Takes the arithmetic nodes, which come last, out of the unknowns."""
    count = int(np.count_nonzero(network.capacitance))
    capacitance = network.capacitance[:count]
    a, b = network.linear.T
    pairs = np.concatenate([a, b]), np.concatenate([b, a])
    links = scipy.sparse.coo_matrix((np.tile(network.conductance, 2), pairs), shape=(count, count)).tocsr()
    balanced = links - scipy.sparse.diags(np.asarray(links.sum(axis=1)).ravel())
    below, over = network.radiative.T
    area_below, area_sky = network.exchange_area, network.emissive_area[over]
    # Two exchanges in series.
    sky_area = network.emissive_area[:count].copy()
    sky_area[below] += area_below * area_sky / (area_below + area_sky)
    linear = (scipy.sparse.diags(1.0 / capacitance) @ balanced).tocsr()
    return Eliminated(network, capacitance, linear, sky_area, over, below, area_below, area_sky)
