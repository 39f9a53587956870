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

    Second: the tilt of the edge against the columns."""
    values = image.signal()
    values = (values - values.min()) / (values.max() - values.min())
    height, width = values.shape
    gradient = np.abs(np.diff(values, axis=1))
    columns = (gradient * (np.arange(width - 1) + 1.0)).sum(1) / gradient.sum(1)
    tilt, start = np.polyfit(np.arange(height) + 0.5, columns, 1)
    # Over these rows the edge moves by whole pixels, so that the bins are evenly filled.
    values = values[: int(int(height * abs(tilt)) / abs(tilt))]
    x, y = np.arange(width) + 0.5, np.arange(len(values)) + 0.5
    distance = (x[None, :] - (start + tilt * y[:, None])) / np.hypot(1.0, tilt)
    parts, reach = 8, 24
    bins = np.floor(distance * parts).astype(int) + reach * parts
    use = (bins >= 0) & (bins < 2 * reach * parts)

    def mean(of):
        sums = np.bincount(bins[use], of[use], minlength=2 * reach * parts)
        return sums[count > 0] / count[count > 0]

    count = np.bincount(bins[use], minlength=2 * reach * parts)
    profile, place = mean(values), mean(distance)
    spread = np.diff(profile)
    wave = np.exp(-2j * np.pi * np.outer(frequencies, 0.5 * (place[1:] + place[:-1])))
    # Bins average the profile, and differences are taken between them.
    return np.abs(wave @ spread) / np.abs(spread.sum()) / np.sinc(frequencies / parts) ** 2, tilt


def gaussian(frequencies, sigma):
    """Transfer function of a Gaussian with a standard deviation [px]."""
    return np.exp(-2.0 * (np.pi * sigma * frequencies) ** 2)


def airy(frequencies, scale):
    """Transfer function of a round aperture. `scale` is wavelength x f-number over the distance of pixels (Goodman, Introduction to Fourier Optics, 6-32)."""
    share = np.minimum(frequencies * scale, 1.0)
    return 2.0 / np.pi * (np.arccos(share) - share * np.sqrt(1.0 - share**2))


def pixel(frequencies, tilt, fill=1.0):
    """Transfer function of a square pixel across an edge with this tilt."""
    across, down = np.array([1.0, tilt]) / np.hypot(1.0, tilt)
    return np.sinc(fill * across * frequencies) * np.sinc(fill * down * frequencies)


def lag(images, rate):
    """Time by which a plate is behind a ramp [s] of this many kelvin a second, in the mean of the second half of the images."""
    behind = []
    for image in images[len(images) // 2 :]:
        shown = float(brightness(image.about["band_um"], np.median(middle(image.radiance()))))
        behind.append((300.0 + rate * image.time - shown) / rate)
    return float(np.mean(behind))


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
