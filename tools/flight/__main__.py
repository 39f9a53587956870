"""Runs Delfi-PQ without and with a fit, and writes docs/validation.md."""

import argparse
import csv
import sys
from pathlib import Path

import numpy

from . import page
from .craft import HANDBOOK, Program
from .fit import at_samples, error_of, fit, rms
from .telemetry import read

ROOT = Path(__file__).resolve().parents[2]
FLIGHT = ROOT.parent / "shared/data/flight"

# Samples of a day from which on it is used in a fit.
LARGE = 5
# Longest time between two samples of a slope [s].
PAIR = 130.0


def slopes(times, kelvin, umbras):
    """Cooling between neighbouring samples in umbra [K/min]."""
    found = []
    for i in range(len(times) - 1):
        length = times[i + 1] - times[i]
        inside = any(a + 60 <= times[i] and times[i + 1] <= b for a, b in umbras)
        if inside and 20 <= length <= PAIR:
            found.append(60 * (kelvin[i] - kelvin[i + 1]) / length)
    return found


def phase(time, umbras):
    """Minutes since the last contact of the umbra, and whether it has begun. `None` before the first contact."""
    contacts = [(a, True) for a, _ in umbras] + [(b, False) for _, b in umbras]
    before = [one for one in contacts if one[0] <= time]
    if not before:
        return None
    at, dark = max(before)
    return dark, (time - at) / 60


def main():
    parser = argparse.ArgumentParser(prog="tools/validation", description=__doc__)
    parser.add_argument("program")
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--paper", type=Path, help="folder of isotherm paper, for its checks.csv")
    parser.add_argument("--page", type=Path, default=ROOT / "docs/validation.md")
    options = parser.parse_args()
    if not FLIGHT.is_dir():
        sys.exit(f"validation: {FLIGHT} is absent: the flight data are not part of this repository, and nothing was written")
    options.output.mkdir(parents=True, exist_ok=True)
    program = Program(options.program, options.output)
    days, repeated = read(FLIGHT)
    print(f"{sum(len(day.times) for day in days)} samples of {len(days)} days; {repeated} repeated frames left out")

    # Every second day is fitted, and the others are judged; then the other way round. No day is judged by a fit that has seen it.
    halves = [[day for day in days[half::2] if len(day.times) >= LARGE] for half in (0, 1)]
    fits = [fit(program, half, HANDBOOK, print) for half in halves]

    kinds = {"before": [], "after": []}
    samples, slope = [], {"flight": [], "before": [], "after": []}
    for i, day in enumerate(days):
        umbras = program.umbras(day)
        judge = 1 - i % 2
        runs = {"before": program.run(day, HANDBOOK, uncertain=True), "after": error_of(program, day, *fits[judge])}
        slope["flight"] += slopes(day.times, day.panels, umbras)
        for kind, run in runs.items():
            kelvin = at_samples(run, day)
            slope[kind] += slopes(day.times, kelvin, umbras)
            kinds[kind].append(kelvin)
        sigma = {kind: numpy.interp(day.times, run.times, run.sigma) for kind, run in runs.items()}
        for n, time in enumerate(day.times):
            sample = {"phase": phase(time, umbras), "flight": day.panels[n], "judge": judge}
            for kind in kinds:
                sample[kind], sample[f"{kind}_sigma"] = kinds[kind][-1][n], sigma[kind][n]
            samples.append(sample)
    of = lambda kind, judges: [s[kind] - s["flight"] for s in samples if s["judge"] in judges]
    off = {(kind, judges): rms(of(kind, judges)) for kind in kinds for judges in ((0,), (1,), (0, 1))}
    mean = {kind: float(numpy.mean(of(kind, (0, 1)))) for kind in kinds}
    checks = None
    if options.paper:
        with (options.paper / "checks.csv").open() as file:
            checks = list(csv.DictReader(file))
    result = page.Result(
        days=[day.start for day in days], halves=[len(half) for half in halves], samples=samples,
        repeated=repeated, fits=fits, off=off, mean=mean, slope=slope, runs=program.count,
        checks=checks,
    )
    options.page.write_text(page.text(result))
    print(page.summary(result))
    print(options.page)


if __name__ == "__main__":
    main()
