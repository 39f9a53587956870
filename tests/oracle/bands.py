"""Radiances of a black body through a response curve by scipy's quad, for the test in src/thermal/radiance/tests.rs.

Run: python3 tests/oracle/bands.py > tests/oracle/response_radiance.in
"""

import math

from scipy.integrate import quad

H, C, K = 6.62607015e-34, 299792458.0, 1.380649e-23
CURVE = [(7.0, 0.0), (9.0, 0.6), (10.0, 1.2), (13.0, 0.1)]
LARGEST = max(value for _, value in CURVE)


def radiance(kelvin):
    total = 0.0
    for (low, first), (high, second) in zip(CURVE, CURVE[1:]):

        def spectral(um):
            metres = um * 1e-6
            response = (first + (second - first) * (um - low) / (high - low)) / LARGEST
            return response * 2 * H * C * C / metres**5 / math.expm1(H * C / (metres * K * kelvin)) * 1e-6

        total += quad(spectral, low, high, epsabs=0, epsrel=1e-12)[0]
    return total


print("[" + ", ".join(f"({t:.1f}, {radiance(t)!r})" for t in [40.0, 77.0, 150.0, 300.0, 450.0, 1000.0, 5772.0]) + "]")
