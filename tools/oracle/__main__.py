"""Makes the references anew, or holds a program against them. `check` needs numpy alone."""

import argparse
import csv
import json
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from opencv_points import exr

from .case import Case

# `check` runs where numpy alone is installed. What `make` needs is hidden from it, so that a case that asks for more fails on every machine.
if sys.argv[1:2] == ["check"]:
    sys.modules.update({"scipy": None, "embreex": None})

from .cases import ALL  # noqa: E402

HERE = Path(__file__).resolve().parent
DATA = HERE / "data"
# Truths are stored to 1 mK.
ROUNDED = 0.0005


def chosen(names: list[str], long: bool) -> list[Case]:
    """The cases of some names, or that a text begins where no case has it as its name; all short ones without any."""
    if names:
        whole = {case.name for case in ALL}
        return [case for case in ALL if any(case.name == name if name in whole else case.name.startswith(name) for name in names)]
    return [case for case in ALL if long or not case.long]


def make(cases: list[Case]) -> None:
    """Computes each table of truth once."""
    done: set[str] = set()
    for case in cases:
        if case.table() in done:
            continue
        done.add(case.table())
        began = time.monotonic()
        rows = case.truth()
        with (DATA / f"{case.table()}.csv").open("w", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(["step", "u", "v", "part", "kelvin"])
            writer.writerows((step, u, v, part, f"{kelvin:.3f}") for step, u, v, part, kelvin in rows)
        print(f"{case.table()}: {len(rows)} rows in {time.monotonic() - began:.1f} s", flush=True)


def differences(case: Case, table: np.ndarray, folder: Path) -> tuple[np.ndarray, np.ndarray | None]:
    """Kelvin of the program less the truth at each row, and what the program states of its error."""
    off, stated = np.full(len(table), np.nan), np.full(len(table), np.nan)
    for step in np.unique(table[:, 0]).astype(int):
        rows = table[:, 0] == step
        channels, _ = exr.read(folder / "frames" / f"step_{step:06}.exr")
        u, v = table[rows, 1].astype(int), table[rows, 2].astype(int)
        off[rows] = channels["T"][v, u] - table[rows, 4]
        if "T_error" in channels:
            stated[rows] = channels["T_error"][v, u]
    return off, None if np.isnan(stated).all() else stated


def probed(case: Case, table: np.ndarray, folder: Path) -> np.ndarray:
    """The same for a truth of probes: `u` is the number of the probe."""
    with (folder / "series.csv").open() as file:
        lines = [line for line in csv.reader(file) if not line[0].startswith("#")]
    series = np.array([[float(value) for value in line] for line in lines[1:]])
    first = lines[0].index(case.parts[0])
    step = table[:, 0].astype(int)
    return series[step, first + table[:, 1].astype(int)] - table[:, 4]


@dataclass
class Row:
    """A case in the table: its cells, and the bounds that it misses."""

    cells: list[str]
    missed: list[str]


HEADS = ["case", "nodes", "device, ms a step", "rms [K]", "bound", "99 % below", "bound", "largest", "bound", "within twice `T_error`", "`T_error` over true, rms", "verdict", "whole run [s]"]


def verdict(case: Case, off: np.ndarray, stated: np.ndarray | None) -> Row:
    """Errors of a case beside their bounds [K], and how well the program knows them."""
    size = np.abs(off)
    found = {"rms": float(np.sqrt(np.mean(off**2))), "p99": float(np.quantile(size, 0.99)), "largest": float(size.max())}
    missed, cells = [], []
    if not np.isfinite(off).all():
        missed.append("nothing seen")
    for name, value in found.items():
        bound = getattr(case.bounds, name)
        cells += [f"{value:.3f}", "" if bound is None else f"{bound:g}"]
        if bound is not None and not value <= bound:
            missed.append(name)
    if stated is None:
        return Row([*cells, "", ""], missed)
    within, ratio = float(np.mean(size <= 2 * stated + ROUNDED)), float(np.sqrt(np.mean(stated**2)) / max(found["rms"], 1e-9))
    if within < 0.9:
        missed.append("T_error too small")
    if ratio > 4 and found["rms"] > 0.05:
        missed.append("T_error too large")
    return Row([*cells, f"{100 * within:.0f} %", f"{ratio:.2f}"], missed)


def line(cells: list[str]) -> None:
    print(f"| {' | '.join(cells)} |", flush=True)


def costs(folder: Path) -> list[str]:
    """Nodes of a run, and the milliseconds of a step on the device."""
    report = json.loads((folder / "report.json").read_text())
    took = report["speed"]["step_ms"]
    return [str(report["model"]["nodes"]), "" if took is None else f"{took:.3g}"]


def check(cases: list[Case], program: Path, work: Path, device: str | None, error: bool = False) -> bool:
    """Runs the program on all cases; prints a table."""
    line(HEADS)
    line(["---"] * len(HEADS))
    good = True
    for case in cases:
        scene = case.build(work / case.name)
        if error:
            scene.write_text(scene.read_text() + "\n[output]\nerror = true\n")
        out = work / case.name / "out"
        command = [str(program), "run", str(scene), "-o", str(out), "--force", "--check=1", *(["--device", device] if device else [])]
        began = time.monotonic()
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            print(f"{case.name}: the program ends with {done.returncode}: {done.stderr[-600:]}")
            good = False
            continue
        took = f"{time.monotonic() - began:.1f}"
        table = np.loadtxt(DATA / f"{case.table()}.csv", delimiter=",", skiprows=1, ndmin=2)
        table[:, 0] /= case.table_steps
        of_probes = (table[:, 3] < 0).all()
        off, stated = (probed(case, table, out), None) if of_probes else differences(case, table, out)
        row = verdict(case, off, stated)
        np.savetxt(work / case.name / "off.csv", np.column_stack([table, off]), fmt="%.4f", delimiter=",", header="step,u,v,part,kelvin,off")
        line([case.name, *costs(out), *row.cells, f"MISSED: {', '.join(row.missed)}" if row.missed else "ok", took])
        good &= not row.missed
    return good


def main() -> None:
    parser = argparse.ArgumentParser(prog="tools/oracle/run", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    making = commands.add_parser("make", help="compute the references anew (Embree, scipy)")
    checking = commands.add_parser("check", help="hold a program against them")
    commands.add_parser("silhouettes", help="count the areas that craft show to the Sun anew (Embree), for tests/it/silhouette.rs")
    for one in (making, checking):
        one.add_argument("names", nargs="*", help="cases, or how their names begin [default: all]")
        one.add_argument("--long", action="store_true", help="also the long cases")
    checking.add_argument("--isotherm", type=Path, required=True, help="the program")
    checking.add_argument("--work", type=Path, default=HERE.parent.parent / "target" / "oracle" / "work", help="folder for scenes and runs")
    checking.add_argument("--error", action="store_true", help="ask for the channel T_error, and hold it against the truth")
    checking.add_argument("--device", help="device of the program")
    asked = parser.parse_args()
    if asked.command == "silhouettes":
        from . import silhouettes

        silhouettes.make()
        return
    cases = chosen(asked.names, asked.long)
    if not cases:
        parser.error("no case has such a name")
    if asked.command == "make":
        make(cases)
        return
    left_out = [case.name for case in ALL if case not in cases]
    if left_out:
        print(f"left out: {', '.join(left_out)}" + ("" if asked.names else " (--long runs them)") + "\n")
    if not check(cases, asked.isotherm.resolve(), asked.work.resolve(), asked.device, asked.error):
        sys.exit(1)


if __name__ == "__main__":
    main()
