"""The cases, in the order in which they run."""

from . import abutting, can, comb, eclipse, floor_wall, hinge, hole, plain, rise, sandwich, slab, spin, station_cut, tube, wedge

ALL = [
    *abutting.CASES,
    *eclipse.CASES,
    *slab.CASES,
    *comb.CASES,
    *tube.CASES,
    *spin.CASES,
    *can.CASES,
    *plain.CASES,
    *hole.CASES,
    *floor_wall.CASES,
    *wedge.CASES,
    *sandwich.CASES,
    *rise.CASES,
    *hinge.CASES,
    *station_cut.CASES,
]
