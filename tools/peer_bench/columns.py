"""Heat conduction in columns of regolith: Isotherm's network beside kalast's step, on the same device."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from peer_bench.network_cases import SIGMA, Floats
from peer_bench.record import Comparison, Error, Goal, Row, Times
from peer_bench.workshop import Unavailable, Workshop, build_kalast, run, tell

# Version of the files in tools/peer_bench/kalast.
KALAST = "0.5.14"
# Thermal inertia 286 J m-2 K-1 s-1/2, turning in 8000 s: the size of Dimorphos' and Didymos' (kalast's own use).
CASE: dict[str, Any] = {
    "nodes": 34,
    "spacing": 0.0034,
    "conductivity": 0.0637,
    "heat_capacity": 2146.0 * 600.0,
    "emissivity": 0.9,
    "absorbed": 1220.0,
    "start": 250.0,
    "frames": 40,
    "frame_s": 200.0,
    "sub_steps": 10,
}
# How many times finer the reference's columns are, and its step [s].
FINER, FINE_STEP = 8, 1.0
# Stages and sub-steps a frame of Isotherm: kalast's own steps, and longer ones of order 2.
METHODS = [(1, 10), (3, 2)]


def case(facets: int, runs: int) -> dict[str, Any]:
    """What both programs read."""
    followed = np.linspace(0, facets - 1, 32).astype(int).tolist()
    return CASE | {"facets": facets, "followed": followed, "runs": runs}


def reference(made: dict[str, Any]) -> Floats:
    """Temperatures [frame, followed facet, node] of columns with 8 times the nodes, by Runge-Kutta 4 in f64."""
    facets, fine = np.array(made["followed"]), (made["nodes"] - 1) * FINER + 1
    z = 1.0 - (2.0 * facets + 1.0) / made["facets"]
    longitude = facets * np.pi * (3.0 - np.sqrt(5.0))
    spacing = made["spacing"] / FINER
    rate = made["conductivity"] / (made["heat_capacity"] * spacing**2)
    surface = 2.0 / (made["heat_capacity"] * spacing)

    def slope(t: Floats, absorbed: Floats) -> Floats:
        change = np.empty_like(t)
        change[1:-1] = rate * (t[:-2] - 2.0 * t[1:-1] + t[2:])
        change[0] = 2.0 * rate * (t[1] - t[0]) + surface * (absorbed - made["emissivity"] * SIGMA * t[0] ** 4)
        change[-1] = 2.0 * rate * (t[-2] - t[-1])
        return change

    t = np.full((fine, len(facets)), made["start"])
    rows = []
    for frame in range(made["frames"]):
        turn = 2.0 * np.pi * (frame + 0.5) / made["frames"]
        absorbed = made["absorbed"] * np.maximum(0.0, np.sqrt(1.0 - z * z) * np.cos(longitude - turn))
        for _ in range(round(made["frame_s"] / FINE_STEP)):
            a = slope(t, absorbed)
            b = slope(t + 0.5 * FINE_STEP * a, absorbed)
            c = slope(t + 0.5 * FINE_STEP * b, absorbed)
            d = slope(t + FINE_STEP * c, absorbed)
            t = t + FINE_STEP / 6.0 * (a + 2.0 * (b + c) + d)
        rows.append(t[::FINER].T)
    return np.array(rows)


def error(file: Path, exact: Floats) -> Error:
    """Of all followed nodes at the ends of all frames."""
    away = np.fromfile(file, np.float32).reshape(exact.shape) - exact
    return Error(float(np.sqrt(np.mean(away**2))), float(np.abs(away).max()), "K")


def measure(shop: Workshop) -> Comparison:
    """Turn by turn: Isotherm, kalast, Isotherm, ..."""
    facets, rounds = (2000, 2) if shop.quick else (10_000, 5)
    comparison = Comparison(
        key="columns",
        title="Heat conduction: Isotherm's network and kalast's step",
        about=(
            f"{facets} columns of {CASE['nodes']} nodes through one turn of 8000 s from 250 K, sunlight constant over 200 s. "
            "kalast steps by 20 s (forward Euler, its surface balanced by Newton's method with its own defaults); Isotherm takes "
            "the same steps with a carried residual, and RKL2 by 100 s with 3 stages. Times are of a turn, by the host's clock, until "
            "the device is done."
        ),
        reference=f"Runge-Kutta 4 in f64 on columns {FINER} times as fine, steps of {FINE_STEP:g} s; all nodes at the ends of the frames",
    )
    made = case(facets, 2)
    file = shop.work / "columns.json"
    file.write_text(json.dumps(made), encoding="utf-8")
    exact = reference(made)
    kalast: Path | None = None
    try:
        tell("building kalast")
        kalast = build_kalast()
    except Unavailable as reason:
        comparison.missing.append(f"kalast: {reason}")
    samples: dict[str, list[dict[str, Any]]] = {}
    for _ in range(rounds):
        for stages, sub_steps in METHODS:
            output = shop.work / f"columns_{stages}.f32"
            words: list[str | Path] = ["--output", output, "--stages", str(stages), "--sub-steps", str(sub_steps)]
            found = shop.isotherm("columns", file, *words)
            samples.setdefault(found["method"], []).append(found | {"error": error(output, exact)})
        if kalast is not None:
            output = shop.work / "columns_kalast.f32"
            found = json.loads(run([kalast, file, output], 1800.0))
            samples.setdefault("kalast", []).append(found | {"error": error(output, exact)})
    rows(shop, comparison, samples)
    return comparison


def rows(shop: Workshop, comparison: Comparison, samples: dict[str, list[dict[str, Any]]]) -> None:
    """A row a program and method, and the goal."""
    rates: dict[str, float] = {}
    for name, found in samples.items():
        clocks = [clock for one in found for clock in one["clock_ms"]]
        device = [ms for one in found for ms in one.get("device_ms", [])]
        times = Times.of(clocks, device)
        rates[name] = 1e3 * found[0]["node_steps"] / shop.judged(times)
        steps = 1e-3 * found[0]["node_steps"]
        busy = f"; {steps / times.processor.median:.0f} a second of processor" if times.processor else ""
        is_peer = name == "kalast"
        comparison.rows.append(
            Row(
                work=f"one turn, {found[0]['node_steps'] / 1e6:.0f} million node-steps",
                program="kalast, forward Euler" if is_peer else f"Isotherm, {name}",
                version=KALAST if is_peer else shop.isotherm_version,
                times=times,
                unit="ms a turn",
                error=found[0]["error"],
                note=f"{steps / times.wall.median:.0f} million node-steps a second{busy}",
                size=rates[name],
            )
        )
        comparison.device = found[0]["device"] if not is_peer else comparison.device
    euler = next((name for name in rates if name.startswith("Euler")), None)
    if "kalast" in rates and euler is not None:
        compare_turns(comparison)
        comparison.goals.append(goal(comparison, rates, euler))
    if samples.get("kalast") and samples["kalast"][0]["device"] != comparison.device:
        comparison.missing.append(f"kalast ran on {samples['kalast'][0]['device']}, not on {comparison.device}")


def compare_turns(comparison: Comparison) -> None:
    """Ratios of the times of a turn."""
    peer = next(row for row in comparison.rows if row.program.startswith("kalast"))

    def with_ratio(row: Row) -> Row:
        if row is peer or row.times.processor is None or peer.times.processor is None:
            return row
        ratio = peer.times.wall.median / row.times.wall.median
        busy = peer.times.processor.median / row.times.processor.median
        return Row(**{**vars(row), "ratio": ratio, "ratio_processor": busy})

    comparison.rows = [with_ratio(row) for row in comparison.rows]


def goal(comparison: Comparison, rates: dict[str, float], euler: str) -> Goal:
    """Node-steps a second: the same explicit steps, or stages of RKL2; and the turn at no more error."""
    own = max(rate for name, rate in rates.items() if name != "kalast")
    met = own > rates["kalast"]
    each = ", ".join(f"{name}: {rate / 1e6:.0f}" for name, rate in rates.items())
    peer = next(row for row in comparison.rows if row.program.startswith("kalast"))
    as_good = [
        f"{row.program.removeprefix('Isotherm, ')} {row.ratio:.2f} times (processors {row.ratio_processor:.2f})"
        for row in comparison.rows
        if row.ratio and row.ratio_processor and row.error and peer.error and row.error.rms <= peer.error.rms
    ]
    turn = f"; the turn at no more error as fast as kalast: {', '.join(as_good)}" if as_good else ""
    return Goal(
        text="Isotherm takes more node-steps a second than kalast",
        measured=f"million a second: {each} ({rates[euler] / rates['kalast']:.2f} times kalast by Euler){turn}",
        met=met,
        reason=""
        if met
        else (
            "kalast's stencil finds neighbours by arithmetic and shares its coefficients among columns; a network "
            "reads neighbours, conductances, heat and a carried residual of every node from memory"
        ),
    )
