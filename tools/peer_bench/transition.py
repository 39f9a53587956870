"""The thermal pass of transitions beside a hand-written rayon loop."""

from typing import Any

from peer_bench.record import Comparison, Error, Goal, Row, Spread, Times
from peer_bench.workshop import ROOT, Workshop, locked_version

# Isotherm may take so many times as long as the loop.
GOAL = 5.0
SIZES, QUICK_SIZES = "10000,100000,1000000,10000000", "10000,1000000"
NAMES = {
    "rayon": "rayon loop, as cargo builds it",
    "rayon_avx2": "rayon loop, AVX2 and FMA",
}


def measure(shop: Workshop) -> Comparison:
    """Both in one process, step by step in turn."""
    found = shop.isotherm(
        "transition",
        "--nodes",
        QUICK_SIZES if shop.quick else SIZES,
        "--steps",
        "20" if shop.quick else "40",
    )
    comparison = Comparison(
        key="transition",
        title="Transitions: Isotherm's pass and a hand-written rayon loop",
        about=(
            f"One step of every node, both in one process and in turn; {found['threads']} rayon threads. Isotherm's time is the "
            "device's own (its pass knows many materials and any function; the loop has one material and no branch it does "
            "not need). Errors are those of 4096 nodes over all 360 steps of an orbit."
        ),
        reference="the f64 twin of the pass (`thermal::reference`), on the same loads in f64",
        device=found["device"],
    )
    rayon = locked_version(ROOT / "Cargo.lock", "rayon")
    for one in found["rows"]:
        comparison.rows += rows_of(one, shop.isotherm_version, rayon)
    comparison.goals.append(goal(shop, comparison))
    return comparison


def rows_of(one: dict[str, Any], isotherm: str, rayon: str) -> list[Row]:
    """Isotherm first, then both builds of the loop [ns a node and step]."""
    nodes = one["nodes"]
    scale = 1e6 / nodes

    def row(key: str, program: str, version: str, device: list[float] | None) -> Row:
        error = one["error_k"][key]
        return Row(
            work=one["work"],
            program=program,
            version=version,
            times=Times.of(one["clock_ms"][key], device).scaled(scale),
            unit="ns a node",
            error=Error(error["rms"], error["max"], "K"),
            size=nodes,
        )

    own = row("device", "Isotherm", isotherm, one["device_ms"])
    rows = [own]
    for key, name in NAMES.items():
        loop = row(key, name, rayon, None)
        rows.append(compared(loop, own))
    return rows


def compared(loop: Row, own: Row) -> Row:
    """With the ratio of its time to that of Isotherm's pass on the device."""
    on_device: Spread = own.times.device or own.times.wall
    busy, own_busy = loop.times.processor, own.times.processor
    ratio_processor = busy.median / own_busy.median if busy and own_busy and own_busy.median > 0.0 else None
    ratios = {
        "ratio": loop.times.wall.median / on_device.median,
        "ratio_processor": ratio_processor,
    }
    return Row(**{**vars(loop), **ratios})


def goal(shop: Workshop, comparison: Comparison) -> Goal:
    """The loop's better build counts, at every size."""
    slower: dict[tuple[str, float], float] = {}
    for row in comparison.rows:
        ratio = row.ratio_processor if shop.loaded else row.ratio
        if ratio is not None and row.size is not None:
            key = (row.work, row.size)
            slower[key] = max(slower.get(key, 0.0), 1.0 / ratio)
    over = {key: factor for key, factor in slower.items() if factor > GOAL}
    by = "by processor time" if shop.loaded else "by the device's clock"
    listed = "; ".join(f"{work}, {size:.0e} nodes: {factor:.1f} times" for (work, size), factor in over.items())
    why = "lavapipe pays for every invocation and every access of a buffer, a vectorised loop does not"
    return Goal(
        text=f"the pass takes at most {GOAL:g} times as long as the loop",
        measured=f"{min(slower.values()):.2f} to {max(slower.values()):.2f} times as long {by}",
        met=not over,
        reason=f"{listed}; {why}" if over else "",
    )
