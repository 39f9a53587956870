"""Runs plates and measures their sensor."""

import argparse
import shutil
from pathlib import Path

import numpy as np

from . import measures, strips
from .files import band_radiance, brightness, images
from .scenes import run

WIDE = "netd = {netd}\nrange = [200, 400]\n"


def row(what, measured, stated, bound):
    """A row of the table, and whether it is within its bound."""
    difference = abs(measured / stated - 1.0)
    good = difference <= bound
    print(f"| {what} | {measured:.5g} | {stated:.5g} | {100 * difference:.2f} % | {100 * bound:g} % | {'yes' if good else 'NO'} |")
    return good


def main():
    """Measures everything, and ends with 1 where a figure is beyond its bound."""
    parser = argparse.ArgumentParser(prog="tools/sensor_check", description=__doc__)
    parser.add_argument("program", type=Path, help="isotherm")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for scenes and files, which is replaced")
    parser.add_argument("--device", help="device of isotherm")
    parser.add_argument("--only", choices=["strips"], help="measures nothing but the flux of narrow strips")
    options = parser.parse_args()
    shutil.rmtree(options.output, ignore_errors=True)
    device = ["--device", options.device] if options.device else []

    def images_of(name, sensor, **changes):
        return images(run(options.program.resolve(), options.output, name, sensor, device, **changes))

    if options.only:
        return 0 if strips_are_kept(images_of) else 1
    print("| what | measured | stated | difference | bound | within |\n|---|---|---|---|---|---|")
    good = True
    for netd in (0.05, 0.4):
        taken = images_of(f"netd_{netd}", WIDE.format(netd=netd), steps=23)
        good &= row(f"NETD {netd} K at 300 K [K]", *measures.netd(taken), 0.03)
    boson = 'preset = "boson_640"\nfov_deg = 20'
    taken = images_of("boson", "range = [200, 400]\nf_number = 1.4\nbad_pixels = 0.001\n", camera=boson, steps=7)
    good &= row("NETD of boson_640 at f/1.4 [K]", *measures.netd(taken), 0.03)

    for step in (0.004, 0.01):
        jump = f'[[joint]]\npart = "plate"\nkind = "translation"\nmode = "schedule"\naxis = "+X"\n' \
            f"schedule = {{ time = [0, {1.5 * step}, {1.5 * step}, 1], distance = [0, 0, 50, 50] }}"
        sensor = "netd = 0\nrange = [100, 320]\nbits = 16\ntime_constant = 0.012\n"
        taken = images_of(f"step_{step}", sensor, step=step, steps=48, joint=jump)
        good &= row(f"time constant, images every {1e3 * step:g} ms [s]", *measures.time_constant(taken), 0.01)

    rate = 20.0
    for hertz in (20, 60, 200):
        sensor = "netd = 0\nrange = [280, 360]\nbits = 16\ntime_constant = 0.01\n"
        taken = images_of(f"ramp_{hertz}", sensor, step=1 / hertz, steps=hertz // 2 + 20, ramp=rate)
        good &= row(f"lag behind a ramp of {rate:g} K/s at {hertz} Hz [s]", measures.lag(taken, rate), 0.01, 0.02)

    frequencies = np.array([0.1, 0.2, 0.3, 0.4, 0.5])
    lens = "f_number = {}\nwavelength_um = 10\n"
    spreads = {
        "box": ("", np.ones_like(frequencies)),
        "gaussian_0.3": ('point_spread = "gaussian"\nsigma = 0.3\n', measures.gaussian(frequencies, 0.3)),
        "gaussian_0.8": ('point_spread = "gaussian"\nsigma = 0.8\n', measures.gaussian(frequencies, 0.8)),
        "airy_1.4": ('point_spread = "airy"\n' + lens.format(1.4), measures.airy(frequencies, 1.4 * 10 / 12)),
        "airy_1.0": ('point_spread = "airy"\n' + lens.format(1.0), measures.airy(frequencies, 10 / 12)),
    }
    for name, (spread, optics) in spreads.items():
        camera = "width = 512\nheight = 512\nfocal_length = 0.00544\npixel_pitch = 12e-6"
        # Without a point spread a pixel is the mean of its samples.
        camera += "" if spread else "\nsamples = 4"
        sensor = "netd = 0\nrange = [100, 320]\nbits = 16\n" + spread
        edge = dict(camera=camera, up="[0.08715574, 0.9961947, 0]", half=2.0)
        image, _ = images_of(f"edge_{name}", sensor, **edge)
        # One edge of the plate lies in the left half.
        image.numbers = image.numbers[110:-110, : image.numbers.shape[1] // 2]
        image.about["vignetting"] = None
        measured, tilt = measures.transfer(image, frequencies)
        for frequency, own, stated in zip(frequencies, measured, optics * measures.pixel(frequencies, tilt)):
            good &= row(f"transfer of {name} at {frequency} cycles/px", own, stated, 0.05)

    sensor = WIDE.format(netd=0.02) + "offset_pattern = 0.3\ngain_pattern = 0.01\n"
    plates = [images_of(f"pattern_{t}", sensor, temperature=t, steps=15) for t in (280, 340)]
    offsets, gains = measures.pattern(*plates)
    good &= row("offset pattern [K]", *offsets, 0.03)
    good &= row("gain pattern", *gains, 0.03)

    emissivity, netd = 0.85, 0.05
    sensor = WIDE.format(netd=netd) + (
        'kelvin_per_count = 0.01\nvignetting = "cos4"\ntransmission = 0.9\nlens_temperature = 295\nhousing_temperature = 298\nbad_pixels = 0.001\n'
    )
    for temperature in (260, 310):
        image, _ = images_of(f"kelvin_{temperature}", sensor, temperature=temperature, emissivity=emissivity)
        print(f"| flags of bad and saturated pixels, plate at {temperature} K | {image.is_flagged()} | True | | | {'yes' if image.is_flagged() else 'NO'} |")
        good &= image.is_flagged()
        found, counted = measures.kelvin(image, emissivity)
        band = image.about["band_um"]
        looks = float(brightness(band, emissivity * band_radiance(band, temperature)))
        for what, value, expected in (("kelvin from digital numbers", found, temperature), ("radiometric output", counted, looks)):
            off = abs(value - expected)
            print(f"| {what}, plate at {temperature} K [K] | {value:.4f} | {expected:.4f} | {1e3 * off:.2f} mK | {1e2 * netd:g} mK | "
                  f"{'yes' if off <= netd / 10 else 'NO'} |")
            good &= off <= netd / 10
    return 0 if good and strips_are_kept(images_of) else 1


def strips_are_kept(images_of):
    """Prints the flux of strips of 0.1 px by their angle, and whether all are within their bounds."""
    bounds = {4: 0.15, 16: 0.05}
    taken = {samples: images_of(f"strips_{samples}", strips.SENSOR, camera=strips.camera(samples), corners=strips.corners())[0] for samples in bounds}
    fluxes = {samples: strips.fluxes(image) for samples, image in taken.items()}
    print("\n| angle of a strip of 0.1 px [deg] | flux with 4 samples | with 16 |\n|---|---|---|")
    for angle, four, sixteen in zip(strips.ANGLES, fluxes[4], fluxes[16]):
        print(f"| {angle:.4g} | {four:.3f} | {sixteen:.3f} |")
    most = {samples: float(abs(flux - 1).max()) for samples, flux in fluxes.items()}
    print(f"\nlargest differences: {most}, bounds: {bounds}")
    return all(most[samples] <= bound for samples, bound in bounds.items())


raise SystemExit(main())
