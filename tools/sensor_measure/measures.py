"""What a sensor is, measured from its images and the JSON beside them."""

import numpy as np

from .files import brightness, slope


def middle(values, margin=4):
    """A part of an image without its borders."""
    return values[..., margin:-margin, margin:-margin]


def netd(images):
    """Measured and stated NETD [K], from the change of each pixel over the images."""
    about = images[0].about
    noise = about["noise"]
    works = images[0].works()
    cube = np.array([image.signal() for image in images])
    sigma = np.sqrt(cube.var(axis=0, ddof=1)[works].mean())
    per_kelvin = about["optics"]["transmission"] * slope(about["band_um"], noise["temperature_K"])
    return sigma / per_kelvin, noise["netd_at_f_number_K"]


def time_constant(images):
    """Measured and stated time constant [s], from a step: a line through the logarithm of what is left."""
    level = np.array([np.median(middle(image.signal())) for image in images])
    times = np.array([image.time for image in images])
    jump = np.argmax(np.abs(np.diff(level))) + 1
    left = np.abs(level[jump - 1 :] - level[-1])
    use = left > 0.01 * left[0]
    rate = np.polyfit(times[jump - 1 :][use], np.log(left[use]), 1)[0]
    return -1.0 / rate, images[0].about["time_constant_s"]


def transfer(image, frequencies):
    """Transfer function across a slanted edge (ISO 12233): the edge is fitted, its profile is sampled finely, and its slope is transformed.

    Second: that of the kernel in the JSON."""
    values = image.signal()
    values = (values - values.min()) / (values.max() - values.min())
    height, width = values.shape
    gradient = np.abs(np.diff(values, axis=1))
    columns = (gradient * (np.arange(width - 1) + 1.0)).sum(1) / gradient.sum(1)
    tilt, start = np.polyfit(np.arange(height) + 0.5, columns, 1)
    x, y = np.arange(width) + 0.5, np.arange(height) + 0.5
    distance = (x[None, :] - (start + tilt * y[:, None])) / np.hypot(1.0, tilt)
    parts, reach = 8, 12
    bins = np.floor(distance * parts).astype(int)
    use = np.abs(bins) < reach * parts
    count = np.bincount(bins[use] + reach * parts, minlength=2 * reach * parts)
    profile = np.bincount(bins[use] + reach * parts, values[use], minlength=2 * reach * parts) / np.maximum(count, 1)
    spread = np.diff(profile[count > 0])
    at = np.arange(len(spread)) / parts
    wave = np.exp(-2j * np.pi * np.outer(frequencies, at))
    # Bins average the profile, and differences are taken between them.
    measured = np.abs(wave @ spread) / np.abs(spread.sum()) / np.sinc(frequencies / parts) ** 2
    weights = np.array(image.about["point_spread"]["weights"])
    place = np.arange(len(weights)) - image.about["point_spread"]["radius_px"]
    across, down = np.array([1.0, -tilt]) / np.hypot(1.0, tilt)
    waves = [np.exp(-2j * np.pi * np.outer(frequencies * by, place)) for by in (across, down)]
    return measured, np.abs(np.einsum("fx,fy,yx->f", *waves, weights))


def pattern(cold, hot):
    """Measured and stated offsets [K] and gains, from the mean images of two plates."""
    about = cold[0].about
    works = cold[0].works()
    means = [np.mean([image.signal() for image in images], axis=0) for images in (cold, hot)]
    levels = [np.median(mean[works]) for mean in means]
    gain = (means[1] - means[0]) / (levels[1] - levels[0]) - 1.0
    offset = means[0] - levels[0] - gain * (levels[0] - about["pattern"]["gain_level_signal"])
    temperature = about["noise"]["temperature_K"] if about["noise"] else 300.0
    per_kelvin = about["optics"]["transmission"] * slope(about["band_um"], temperature)
    stated = about["pattern"]
    return (offset[works].std() / per_kelvin, stated["offset_K"]), (gain[works].std(), stated["gain"])


def kelvin(image, emissivity):
    """Mean temperature of a plate of known emissivity [K], from digital numbers, and mean of the radiometric output."""
    about, works = image.about, image.works()
    radiance = middle(image.radiance())[middle(works)].mean() / emissivity
    return float(brightness(about["band_um"], radiance)), float(middle(image.kelvin())[middle(works)].mean())
