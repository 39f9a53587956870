"""The telemetry and the element sets of Delfi-PQ."""

import csv
import datetime
from dataclasses import dataclass
from pathlib import Path

import numpy

PANELS = ("panel_yp", "panel_ym", "panel_xp", "panel_xm")
DAY = datetime.timedelta(days=1)
UTC = datetime.timezone.utc


@dataclass
class Day:
    """The samples of a day, and the element set that was the newest when it began."""

    start: datetime.datetime
    elements: list
    times: numpy.ndarray  # [s] after the start
    panels: numpy.ndarray  # mean of the four panels [K]


def epoch(line):
    """The date of the first line of an element set."""
    year, day = 2000 + int(line[18:20]), float(line[20:32])
    return datetime.datetime(year, 1, 1, tzinfo=UTC) + datetime.timedelta(days=day - 1)


def element_sets(path: Path):
    lines = [line.rstrip() for line in path.read_text().splitlines() if line.strip()]
    pairs = [
        lines[i : i + 2] for i in range(len(lines) - 1) if lines[i].startswith("1 ")
    ]
    return sorted(((epoch(pair[0]), pair) for pair in pairs), key=lambda one: one[0])


def read(folder: Path):
    """Days with samples after the first element set, and the number of repeated samples that were left out.

    A sample that repeats all values of an earlier one is an old frame that was sent again.
    """
    sets = element_sets(folder / "delfi_pq.tle")
    known, repeated, by_day = set(), 0, {}
    with (folder / "delfi_pq_temperatures.csv").open() as file:
        for row in csv.DictReader(file):
            time = datetime.datetime.fromisoformat(row["time"].replace("Z", "+00:00"))
            values = tuple(
                value for name, value in row.items() if name != "time"
            )
            if values in known:
                repeated += 1
                continue
            known.add(values)
            if time < sets[0][0]:
                continue
            mean = sum(float(row[name]) for name in PANELS) / 4 + 273.15
            day = time.replace(hour=0, minute=0, second=0)
            by_day.setdefault(day, []).append(((time - day).total_seconds(), mean))
    days = []
    for start, samples in sorted(by_day.items()):
        before = [pair for at, pair in sets if at <= start]
        samples = numpy.array(sorted(samples))
        days.append(
            Day(start, before[-1] if before else sets[0][1], samples[:, 0], samples[:, 1])
        )
    return days, repeated
