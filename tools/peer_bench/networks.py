"""Thermal networks of about 10,000 nodes: Isotherm beside pycanha-core and scipy's Radau."""

import resource
import time
from pathlib import Path

import numpy as np

from peer_bench import network_cases as cases
from peer_bench.network_cases import Floats
from peer_bench.record import Comparison, Error, Goal, Row, Times
from peer_bench.workshop import TARGET, Unavailable, Workshop, tell, version

GOAL = 7.0
KEYS, QUICK_KEYS = ("cube", "sheet", "blanket", "slivers"), ("cube",)
# Errors to aim for [K]: Isotherm's default is 0.005, and Radau's of one step is what its name says.
TOLERANCES, QUICK_TOLERANCES = (0.05, 0.005, 0.0005), (0.005, 0.0005)
RADAU_TOLERANCES = (1e-2, 1e-4)
# Steps of pycanha through the orbit; the frame's own first.
PYCANHA_STEPS, QUICK_PYCANHA_STEPS = (360, 720), (360,)
# Seconds after which a peer is given up.
LIMIT, QUICK_LIMIT = 1800.0, 900.0


class Case:
    """A network with its file and its reference, and what every program made of it."""

    def __init__(self, shop: Workshop, key: str) -> None:
        self.shop = shop
        self.network = cases.make(key)
        self.file = shop.work / f"{key}.toml"
        self.file.write_text(cases.toml(self.network), encoding="utf-8")
        self.exact, self.exact_name, self.doubt = reference(shop, key)
        self.clocks: dict[tuple[str, str, str], list[list[float]]] = {}
        self.device: dict[tuple[str, str, str], list[float]] = {}
        self.errors: dict[tuple[str, str, str], Error] = {}
        self.notes: dict[tuple[str, str, str], str] = {}
        self.device_name = ""

    def error(self, rows: Floats) -> Error:
        """Of all nodes at all compared times but the start [mK]."""
        if rows.shape != self.exact.shape:
            raise Unavailable(f"{rows.shape} temperatures in place of {self.exact.shape}")
        away = 1e3 * (rows - self.exact)[1:]
        return Error(float(np.sqrt(np.mean(away**2))), float(np.abs(away).max()), "mK")

    def isotherm(self, tolerance: float) -> None:
        """The solution alone, then the whole command."""
        output = self.shop.work / "network.f64"
        words: list[str | Path] = [
            "network",
            self.file,
            "--output",
            output,
            "--tolerance",
            repr(tolerance),
            "--runs",
            "1",
        ]
        found = self.shop.isotherm(*words)
        rows = np.fromfile(output).reshape(found["rows"], -1)
        key = ("Isotherm", self.shop.isotherm_version, f"tolerance {1e3 * tolerance:g} mK")
        self.clocks.setdefault(key, []).extend(found["clock_ms"])
        self.device.setdefault(key, []).extend(found.get("device_ms", []))
        self.errors[key] = self.error(rows)
        self.notes[key] = f"{found['stages']} stages in {found['sub_steps']} sub-steps"
        self.device_name = found["device"]

    def command(self, tolerance: float) -> None:
        """`isotherm network` from its start to its end, reading 10,000 nodes of TOML and compiling kernels included."""
        output = self.shop.work / "network.csv"
        began, busy = time.perf_counter(), children_seconds()
        self.shop.command_line("network", self.file, "-o", output, "--tolerance", repr(tolerance))
        seconds, busy = time.perf_counter() - began, children_seconds() - busy
        rows = np.loadtxt(output, delimiter=",", skiprows=1)[:, 1:]
        key = ("isotherm network, whole command", self.shop.isotherm_version, f"tolerance {1e3 * tolerance:g} mK")
        self.clocks.setdefault(key, []).append([1e3 * seconds, 1e3 * busy])
        self.errors[key] = self.error(rows)

    def peer(self, program: str, module: str, setting: str, label: str, limit: float) -> None:
        """A solution by a Python module in a process of its own."""
        output = self.shop.work / f"{module}.npz"
        self.shop.python(module, self.network.key, setting, output, limit=limit)
        found = np.load(output)
        key = (program, version({"network_pycanha": "pycanha-core", "network_radau": "scipy"}[module]), label)
        self.clocks.setdefault(key, []).append([1e3 * float(found["seconds"]), 1e3 * float(found["processor"])])
        self.errors[key] = self.error(found["rows"])
        if "handing" in found:
            self.notes[key] = f"and {float(found['handing']):.1f} s to hand over the heat, which is not counted"

    def rows(self) -> list[Row]:
        """Isotherm's first; ratios are to Isotherm at its default tolerance."""
        own = self.clocks.get(("Isotherm", self.shop.isotherm_version, "tolerance 5 mK"))
        made = []
        for key, clocks in self.clocks.items():
            times = Times.of(clocks, self.device.get(key))
            program, number, label = key
            is_peer = not program.lower().startswith("isotherm")
            base = Times.of(own) if own and is_peer else None
            made.append(
                Row(
                    work=f"{self.network.key}: {self.network.nodes} nodes, one orbit",
                    program=f"{program}, {label}",
                    version=number,
                    times=times,
                    unit="ms an orbit",
                    error=self.errors[key],
                    ratio=times.wall.median / base.wall.median if base else None,
                    ratio_processor=_ratio(times, base),
                    note=self.notes.get(key, ""),
                )
            )
        return made


def children_seconds() -> float:
    """Processor time of the programs that have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _ratio(times: Times, base: Times | None) -> float | None:
    if base is None or times.processor is None or base.processor is None:
        return None
    return times.processor.median / base.processor.median


def reference(shop: Workshop, key: str) -> tuple[Floats, str, float]:
    """Rows [K] that all are held against; kept, for they take long."""
    kept = TARGET / "references" / f"{key}.npz"
    if not kept.exists():
        tell(f"solving the reference of '{key}'")
        kept.parent.mkdir(parents=True, exist_ok=True)
        made = shop.work / f"reference_{key}.npz"
        shop.python("network_reference", key, made, limit=3.0 * LIMIT)
        made.replace(kept)
    found = np.load(kept)
    return found["rows"], str(found["name"]), float(found["doubt"])


def measure(shop: Workshop, programs: set[str]) -> Comparison:
    """Case by case; within a case the programs in turn."""
    comparison = Comparison(
        key="networks",
        title="Thermal networks at 10,000 nodes: Isotherm, pycanha-core and scipy's Radau",
        about=(
            "The networks of docs/numerics.md 3 through one orbit of 6017 s; temperatures are compared at ten times. Building "
            "a network is not counted, handing over the heat neither. Isotherm's time is that of the solution by the host's "
            "clock, transfers included; the row of the whole command has everything from the start of the process to the file."
        ),
    )
    names = []
    for key in QUICK_KEYS if shop.quick else KEYS:
        try:
            case = Case(shop, key)
        except Unavailable as reason:
            comparison.missing.append(f"{key}: no reference: {reason}")
            continue
        names.append(f"{key}: {case.exact_name} (a coarser one is within {1e3 * case.doubt:.1g} mK)")
        solve(case, comparison, programs)
        comparison.rows += case.rows()
        comparison.device = case.device_name
        if "pycanha" in programs:
            comparison.goals.append(goal(case))
    comparison.reference = "; ".join(names)
    return comparison


def solve(case: Case, comparison: Comparison, programs: set[str]) -> None:
    """All programs, in turn."""
    shop = case.shop
    rounds = 1 if shop.quick else 3
    limit = QUICK_LIMIT if shop.quick else LIMIT
    given_up: set[str] = set()

    def attempt(name: str, work: object, *arguments: object) -> None:
        if name in given_up:
            return
        tell(f"networks: {case.network.key}, {name}")
        try:
            work(*arguments)  # type: ignore[operator]
        except Unavailable as reason:
            given_up.add(name)
            comparison.missing.append(f"{case.network.key}, {name}: {reason}")

    for number in range(rounds):
        for tolerance in QUICK_TOLERANCES if shop.quick else TOLERANCES:
            attempt(f"Isotherm {tolerance:g} K", case.isotherm, tolerance)
        attempt("isotherm network", case.command, 0.005)
        # The frame's own step in every round, finer ones once.
        if "pycanha" in programs:
            for steps in (QUICK_PYCANHA_STEPS if shop.quick else PYCANHA_STEPS)[: 1 if number > 0 else None]:
                label = f"{steps} steps"
                attempt(f"pycanha {label}", case.peer, "pycanha-core", "network_pycanha", str(steps), label, limit)
        if "radau" in programs and number == 0:
            for tolerance in RADAU_TOLERANCES[: 1 if shop.quick else None]:
                label = f"atol {1e3 * tolerance:g} mK"
                attempt(f"Radau {label}", case.peer, "scipy Radau", "network_radau", repr(tolerance), label, limit)


def goal(case: Case) -> Goal:
    """The fastest of Isotherm's solutions that errs no more than pycanha's, by rms and at most."""
    text = f"{case.network.key}: at least {GOAL:g} times faster than pycanha-core at no more error"
    peers = [key for key in case.clocks if key[0] == "pycanha-core"]
    if not peers:
        return Goal(text, "pycanha-core gave no solution", False, "nothing to compare with: see what could not run")
    best: tuple[float, str] | None = None
    peer = min(peers, key=lambda key: case.shop.judged(Times.of(case.clocks[key])))
    for key in case.clocks:
        own, other = case.errors[key], case.errors[peer]
        if key[0] != "Isotherm" or own.rms > other.rms or own.largest > other.largest:
            continue
        times, theirs = Times.of(case.clocks[key]), Times.of(case.clocks[peer])
        factor = case.shop.judged(theirs) / case.shop.judged(times)
        both = f"{theirs.wall.median / times.wall.median:.1f} by the clock, {_ratio(theirs, times) or 0.0:.1f} by processors"
        said = f"{factor:.1f} times at {key[2]} against {peer[2]} ({both})"
        if best is None or factor > best[0]:
            best = (factor, said)
    if best is None:
        return Goal(
            text,
            "no solution of Isotherm's errs as little",
            False,
            "pycanha's error is below that of all tolerances tried",
        )
    return Goal(text, best[1], best[0] >= GOAL, "" if best[0] >= GOAL else "see the times of processors")
