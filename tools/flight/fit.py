"""A fit of four values to some days of telemetry, and what is left on all days.

The samples of a pass over the ground station share most of what the model leaves: the attitude of the craft before. Their errors are therefore one of 2.5 K
that a whole pass shares, and one of 0.4 K of each sample. The residuals are whitened by the covariance of both.
"""

import numpy
from scipy.linalg import solve_triangular
from scipy.optimize import least_squares

FITTED = ("absorptivity", "panel", "inner", "coupling")
BOUNDS = {"absorptivity": (0.3, 0.999), "panel": (500, 2e4), "inner": (500, 5e4), "coupling": (0.02, 0.999)}

# Errors that the samples of a pass share, and of a sample by itself [K]; time without samples that ends a pass [s].
SHARED, OWN, BETWEEN = 2.5, 0.4, 600.0


def at_samples(run, day):
    return numpy.interp(day.times, run.times, run.panels)


def whitened(off, times):
    """Residuals of unit variance without correlations, from the residuals of a day at its times."""
    passes = numpy.cumsum(numpy.append(0, numpy.diff(times) > BETWEEN))
    shared = SHARED**2 * (passes[:, None] == passes[None, :])
    return solve_triangular(numpy.linalg.cholesky(shared + OWN**2 * numpy.eye(len(times))), off, lower=True)


def fit(program, days, start, tell):
    """The fitted values, and the covariance of their logarithms.

    The emissivity stays: temperatures fix its ratio to the absorptivity alone. The covariance takes the errors as large as the residuals.
    """

    def values_of(x):
        values = dict(start)
        for name, logarithm in zip(FITTED, x):
            values[name] = float(numpy.exp(logarithm))
        return values

    def residuals(x):
        values = values_of(x)
        off = [at_samples(program.run(day, values), day) - day.panels for day in days]
        tell(f"rms {rms(numpy.concatenate(off)):.3f} K with {', '.join(f'{n} {values[n]:.4g}' for n in FITTED)}")
        return numpy.concatenate([whitened(one, day.times) for one, day in zip(off, days)])

    low, high = numpy.log([BOUNDS[name] for name in FITTED]).T
    first = numpy.log([start[name] for name in FITTED])
    best = least_squares(
        residuals, first, bounds=(low, high), diff_step=0.02, xtol=2e-3, ftol=1e-4, loss="soft_l1",
        f_scale=3.0, max_nfev=8,
    )
    off = best.fun
    scale = (off @ off) / max(len(off) - len(FITTED), 1)
    return values_of(best.x), scale * numpy.linalg.pinv(best.jac.T @ best.jac)


def error_of(program, day, values, covariance):
    """The run of a day and one standard deviation of its panels by the covariance [K]."""
    run = program.run(day, values)
    columns = []
    for name in FITTED:
        step = -0.02 if values[name] > 0.97 else 0.02
        moved = program.run(day, {**values, name: values[name] * numpy.exp(step)})
        columns.append((moved.panels - run.panels) / step)
    columns = numpy.array(columns)
    run.sigma = numpy.sqrt(numpy.einsum("it,ij,jt->t", columns, covariance, columns))
    return run


def rms(values):
    return float(numpy.sqrt(numpy.mean(numpy.square(values))))
