"""docs/validation.md."""

from dataclasses import dataclass

import numpy

from .craft import HANDBOOK
from .fit import FITTED, OWN, SHARED

# Minutes of a bin of the table.
BIN = 8


@dataclass
class Result:
    """What was found."""

    days: list
    halves: list  # fitted days of each half
    samples: list
    repeated: int
    fits: list  # values and covariance of each half
    off: dict  # rms by kind and by the halves whose fits judge
    mean: dict
    slope: dict
    runs: int
    checks: list


def slope_words(result):
    of = {kind: float(numpy.median(values)) for kind, values in result.slope.items()}
    count = len(result.slope["flight"])
    spread = 1.25 * numpy.std(result.slope["flight"]) / count**0.5
    return of, count, float(spread)


def summary(result):
    of, count, spread = slope_words(result)
    return (
        f"panel mean, each day by the fit of the other days: {result.off['before', (0, 1)]:.2f} K rms before, "
        f"{result.off['after', (0, 1)]:.2f} K after (halves {result.off['after', (0,)]:.2f} and {result.off['after', (1,)]:.2f} K); "
        f"slope in umbra {of['flight']:.3f} +- {spread:.3f} K/min flown, {of['before']:.3f} before, {of['after']:.3f} after ({count} pairs)"
    )


def phases(result):
    rows = []
    bins = {}
    for sample in result.samples:
        if sample["phase"]:
            dark, minutes = sample["phase"]
            bins.setdefault((dark, int(minutes // BIN)), []).append(sample)
    for (dark, number), samples in sorted(bins.items(), key=lambda one: (not one[0][0], one[0][1])):
        if len(samples) < 4:
            continue
        column = lambda name: numpy.array([sample[name] for sample in samples])
        flown = column("flight")
        error = flown.std(ddof=1) / len(flown) ** 0.5
        cell = lambda kind: f"{column(kind).mean() - 273.15:.1f} +- {column(kind + '_sigma').mean():.1f}"
        where = "umbra" if dark else "sunlight"
        rows.append(
            f"| {where}, {BIN * number} to {BIN * (number + 1)} min | {len(samples)} | {flown.mean() - 273.15:.1f} +- {error:.1f} "
            f"| {cell('before')} | {cell('after')} |"
        )
    return "\n".join(rows)


def value_rows(result):
    units = {"absorptivity": "", "emissivity": "", "panel": "J/(m2 K)", "inner": "J/(m2 K)", "coupling": ""}
    words = {
        "absorptivity": "absorptivity", "emissivity": "emissivity", "panel": "heat capacity of the panels",
        "inner": "heat capacity inside, over the area of the panels",
        "coupling": "effective emittance between both",
    }
    sources = {
        "absorptivity": "gallium arsenide cell, `models/materials.toml`; 0.76 to 0.92",
        "emissivity": "the same; 0.76 to 0.88",
        "panel": "1.6 mm of circuit board of 1850 kg/m3 and 1100 J/(kg K); 30 %",
        "inner": "0.6 kg less the panels, 900 J/(kg K)",
        "coupling": "two faces of emissivity 0.8",
    }
    rows = []
    for name in units:
        fitted = []
        for values, covariance in result.fits:
            error = " (kept)"
            if name in FITTED:
                error = f" +- {100 * float(covariance[FITTED.index(name)][FITTED.index(name)]) ** 0.5:.1f} %"
            fitted.append(f"{values[name]:.4g}{error}")
        rows.append(f"| {words[name]} | {HANDBOOK[name]:.4g} {units[name]} | {sources[name]} | {' | '.join(fitted)} |")
    return "\n".join(rows)


def paper(result):
    if result.checks is None:
        return "The statements were not run with this page: `isotherm paper -o out/paper`, then `--paper out/paper`.\n"
    # Points of curves are many and alike, so each figure of them has one row.
    curves, rows = {}, []
    for row in result.checks:
        if row["statement"].startswith("figure "):
            curves.setdefault(row["statement"].split(".")[0], []).append(row)
        else:
            name, agrees = row["statement"].removeprefix("scenario: "), "yes" if row["agrees"] == "true" else "**no**"
            rows.append(f"| {name} | {row['expected']} | {float(row['computed']):.6g} | {agrees} |")
    points = [
        f"| {name}, {len(of)} points of curves | | at most {max(abs(float(row['computed']) - float(row['expected'])) for row in of):.1g} K off "
        f"| {sum(row['agrees'] == 'true' for row in of)} of {len(of)} |"
        for name, of in curves.items()
    ]
    return "| statement | paper | computed | agrees |\n|---|---|---|---|\n" + "\n".join([*points, *rows]) + "\n"


def text(result):
    of, count, spread = slope_words(result)
    met = lambda good: "met" if good else "missed"
    slope_off = 100 * (of["after"] / of["flight"] - 1)
    return f"""# Validation

Against what was measured in flight and published elsewhere. `tools/validation` writes this page:

```sh
isotherm paper -o out/paper
tools/validation target/release/isotherm -o out/validation --paper out/paper
```

## Delfi-PQ in flight
Delfi-PQ is a PocketQube of 5 x 5 x 17.8 cm that was launched in January 2022 and spins freely. The public telemetry of its four side panels (January to March 2022) and its element sets lie in
`../shared/data/flight`. No licence is stated, so the repository holds none of it. Without this folder the tool says so and writes nothing.

The model is a closed box of its real size. Each face is a panel (response `radiative`) over an inner structure (`over`). The orbit is that of the newest element set before each day, by SGP4. `attitude.mode = "tumble"` gives
the mean loads over all orientations. A run is a day in steps of 60 s after four orbits of warm-up.

{len(result.samples)} samples of {len(result.days)} days were used, those after the first element set. {result.repeated} frames that repeat all values of an earlier frame were left out. Four values were fitted to every
second day, and then to the other days (scipy `least_squares`, {result.runs} runs in all; {result.halves[0]} and {result.halves[1]} days with at least five samples). Each sample below is judged by the fit of the other days, which has not seen it.

A fit takes an error of {SHARED} K that all samples of a pass share, and {OWN} K of each sample by itself. The craft tumbles, so one pass is warmer than another by some kelvins, but within a pass the samples lie on a smooth curve to better
than 0.1 K, so the cooling within passes is known well. An earlier fit took each sample as independent: 2.77 K rms on days that were not fitted, but .722 K/min in umbra, by a heat capacity that is too large.

| mean of the four panels | rms | mean difference |
|---|---|---|
| handbook values | {result.off["before", (0, 1)]:.2f} K | {result.mean["before"]:+.2f} K |
| fitted values, each day by the fit of the other days | {result.off["after", (0, 1)]:.2f} K | {result.mean["after"]:+.2f} K |
| days of the second half by the fit of the first | {result.off["after", (0,)]:.2f} K | |
| days of the first half by the fit of the second | {result.off["after", (1,)]:.2f} K | |

The bound is 3.3 K on days that were not fitted: {met(result.off["after", (0, 1)] <= 3.3)} by all samples together, {met(result.off["after", (0,)] <= 3.3)} and {met(result.off["after", (1,)] <= 3.3)} by the samples of the second and the first half.

| cooling in umbra, median of {count} pairs of samples | K/min |
|---|---|
| flown | {of["flight"]:.3f} +- {spread:.3f} |
| handbook values | {of["before"]:.3f} |
| fitted values | {of["after"]:.3f} ({slope_off:+.1f} %) |

The bound is 10 % of 0.98 K/min, with fitted values: {met(abs(of["after"] / 0.98 - 1) <= 0.1)}.

By the time since the last contact of the umbra, in deg C. The error of the flown mean is its standard error; that of the handbook values is T_sigma by the ranges below, albedo (0.2 to 0.4) and planet infrared (210 to 260 W/m2)
([numerics.md 12](numerics.md#12-uncertainty)); that of the fitted values is of their covariance.

| place | samples | flown | handbook | fitted |
|---|---|---|---|---|
{phases(result)}

| value | handbook | from; range of 95 % | fitted to the first half | to the second |
|---|---|---|---|---|
{value_rows(result)}

The emissivity was kept, because temperatures fix the ratio of absorptivity and emissivity alone. A fitted absorptivity is therefore that of emissivity {HANDBOOK["emissivity"]}. The mass of 0.6 kg is from a public description
(isr.spoc.rtaf.mi.th/2022-02-03-delfi-n3xt-nanosatellite).

## The paper
`isotherm paper` reproduces figures 2 to 7 of Vural, Martin, Dunstan and Sanchez-Gestido (2023) and holds its statements, some of which compare with ESATAN-TMS.

{paper(result)}
## Public decks
A solution of ESATAN-TMS, `DISCTR_TRANSIENT.TMD` of pycanha-core, is shown in every pixel to 0.3 mK, and a published network of five nodes is met to 2 mK ([network.md](network.md#from-and-to-esatan); `tests/it/network/esatan.rs`).

## What is not validated
| what | why |
|---|---|
| infrared images of a craft in orbit | no public image with its craft's materials, orbit and radiometric calibration was found |
| shadows, exchange and conduction between parts in flight | the four panels of a small box show none of them; they are held to Embree, Mitsuba and closed forms ([numerics.md](numerics.md)) |
| absorptivity and emissivity apart | telemetry fixes their ratio alone |
| single panels and attitude | no attitude was published with the telemetry, and a single panel scatters by 3.9 K |
| battery and microcontroller | their telemetry holds glitches, and the model has no node for each |
"""
