"""Reflections of a planet: Isotherm's mean radiance beside Mitsuba's."""

import json
import os

from peer_bench.record import Comparison, Goal
from peer_bench.workshop import ROOT, Unavailable, Workshop, llvm, tell, version

# Largest difference of a mean radiance.
ALLOWED = 0.005


def measure(shop: Workshop) -> Comparison:
    """Every body in a process of its own, for Mitsuba's renderer."""
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", str(llvm()))
    comparison = Comparison(
        key="reflections",
        title="Reflections: Isotherm's bodies before the Earth and Mitsuba 3",
        about=(
            "Bodies that emit nothing before a planet that does, from 408 km: the mean radiance of each body's pixels. Mitsuba follows "
            "one reflection with 512 samples a pixel. What its facets send to each other is lost, so its image is divided by that of a "
            "white furnace."
        ),
        reference=f"Mitsuba {version('mitsuba')}",
        device=shop.device,
    )
    tell("reflections: Isotherm and Mitsuba")
    folder = shop.work / "reflections"
    found = folder / "reflections.json"
    found.unlink(missing_ok=True)
    try:
        shop.python("reflections_mitsuba", ROOT / "target" / "release" / "isotherm", folder)
    except Unavailable:
        # It also ends so where a body is off by more than is allowed.
        if not found.exists():
            raise
    for row in json.loads(found.read_text(encoding="utf-8")):
        measured = f"{100 * row['off']:+.2f} %, rms {row['rms']:.4f} of the planet's radiance"
        comparison.goals.append(Goal(f"{row['work']}: within 0.5 %", measured, abs(row["off"]) <= ALLOWED))
    return comparison
