"""The cases, in the order in which they run."""

from . import abutting, box_on_deck, can, comb, eclipse, fin, floor_wall, gap, hinge, hole, plain, rise, sandwich, slab, spin, station_cut, struts, tube, wedge

ALL = [
    *abutting.CASES,
    *eclipse.CASES,
    *slab.CASES,
    *comb.CASES,
    *tube.CASES,
    *fin.CASES,
    *gap.CASES,
    *spin.CASES,
    *struts.CASES,
    *can.CASES,
    *plain.CASES,
    *hole.CASES,
    *box_on_deck.CASES,
    *floor_wall.CASES,
    *wedge.CASES,
    *sandwich.CASES,
    *rise.CASES,
    *hinge.CASES,
    *station_cut.CASES,
]
