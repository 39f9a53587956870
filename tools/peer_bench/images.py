"""Images of one scene: Isotherm's frame beside Mitsuba 3, at several samples a pixel."""

import json
import os
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from peer_bench.record import Comparison, Error, Goal, Row, Times
from peer_bench.workshop import ROOT, TARGET, Unavailable, Workshop, llvm, tell, version

WIDTH, HEIGHT = 640, 512
# Isotherm takes more samples by a larger image, whose pixels are then averaged.
SCALES, QUICK_SCALES = (1, 2, 4), (1, 2)
SAMPLES, QUICK_SAMPLES = (1, 4, 16, 64), (1, 4, 16)
VARIANTS = {"llvm_ad_mono": "Mitsuba, LLVM", "scalar_rgb": "Mitsuba, scalar"}
# Samples of the reference a pass, and passes.
REFERENCE = (16, 24)


def scene_text() -> str:
    """models/station.toml at its start without memory: the balance of the moment, in the file's pose, 640 x 512."""
    kept, skip = [], False
    for line in (ROOT / "models" / "station.toml").read_text(encoding="utf-8").splitlines():
        if line.startswith("["):
            skip = line in ("[[joint]]", "[[probe]]")
        if not skip:
            kept.append(line)
    text = "\n".join(kept) + "\n"
    for old, new in (
        ('path = "station.glb"', f'path = "{ROOT / "models" / "station.glb"}"'),
        ('response = "transition"', 'response = "instant"'),
        ("width = 1024", f"width = {WIDTH}"),
        ("height = 768", f"height = {HEIGHT}"),
    ):
        if old not in text:
            raise Unavailable(f"models/station.toml no longer has `{old}`")
        text = text.replace(old, new)
    return text


def error(image: NDArray[np.floating[Any]], exact: NDArray[np.float64]) -> Error:
    """Over the pixels where either shows the craft, relative to the craft's mean radiance."""
    drawn = (exact > 0.0) | (image > 0.0)
    away = (image[drawn] - exact[drawn]) / exact[exact > 0.0].mean()
    return Error(float(np.sqrt(np.mean(away**2))), float(np.abs(away).max()), "of the mean radiance")


class Images:
    """What both programs drew."""

    def __init__(self, shop: Workshop) -> None:
        self.shop = shop
        self.scene = shop.work / "station.toml"
        self.scene.write_text(scene_text(), encoding="utf-8")
        self.folder = shop.work / "image"
        self.described: dict[str, Any] = {}
        self.clocks: dict[tuple[str, int], list[list[float]]] = {}
        self.device: dict[tuple[str, int], list[float]] = {}
        self.pictures: dict[tuple[str, int], NDArray[np.float32]] = {}
        self.frames = 3 if shop.quick else 6

    def isotherm(self) -> None:
        """Frames at every scale; the mean over pixels counts to the time."""
        scales = ",".join(str(scale) for scale in (QUICK_SCALES if self.shop.quick else SCALES))
        words = ["image", self.scene, "--output", self.folder, "--scale", scales, "--frames", str(self.frames)]
        self.described = self.shop.isotherm(*words)
        (self.folder / "image.json").write_text(json.dumps(self.described), encoding="utf-8")
        for row in self.described["rows"]:
            scale = row["scale"]
            pixels = np.fromfile(self.folder / row["radiance"], np.float32)
            began, busy = time.perf_counter(), time.process_time()
            blocks = pixels.reshape(HEIGHT, scale, WIDTH, scale)
            picture = blocks.mean(axis=(1, 3)) if scale > 1 else blocks[:, 0, :, 0]
            mean = [1e3 * (time.perf_counter() - began), 1e3 * (time.process_time() - busy)]
            key = ("Isotherm", scale * scale)
            self.clocks.setdefault(key, []).extend([[a + mean[0], b + mean[1]] for a, b in row["clock_ms"]])
            self.device.setdefault(key, []).extend(row["device_ms"])
            self.pictures[key] = picture

    def mitsuba(self, variant: str) -> None:
        """Frames at every number of samples."""
        output = self.shop.work / f"{variant}.npz"
        samples = QUICK_SAMPLES if self.shop.quick else SAMPLES
        listed = ",".join(str(count) for count in samples)
        self.shop.python("image_mitsuba", self.folder, variant, listed, str(self.frames), output)
        found = np.load(output)
        for count in samples:
            key = (VARIANTS[variant], count)
            self.clocks.setdefault(key, []).extend(found[f"clock_ms_{count}"].tolist())
            self.pictures[key] = found[f"image_{count}"]

    def reference(self) -> tuple[NDArray[np.float64], Error]:
        """By rays with Planck's law at every meeting; and how far half of the samples are from it."""
        output = self.shop.work / "reference.npz"
        samples, passes = REFERENCE[0], REFERENCE[1] // (4 if self.shop.quick else 1)
        self.shop.python("image_mitsuba", self.folder, "reference", str(samples), str(passes), output)
        found = np.load(output)
        return found["image"], error(found["half"], found["image"])


def measure(shop: Workshop) -> Comparison:
    """Frame rates in turn, then the reference."""
    comparison = Comparison(
        key="images",
        title="Images: Isotherm's frame and Mitsuba 3",
        about="",
    )
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", str(llvm()))
    images = Images(shop)
    given_up: set[str] = set()
    for _ in range(1 if shop.quick else 3):
        tell("images: Isotherm")
        images.isotherm()
        for variant in VARIANTS:
            if variant in given_up:
                continue
            tell(f"images: Mitsuba, {variant}")
            try:
                images.mitsuba(variant)
            except Unavailable as reason:
                given_up.add(variant)
                comparison.missing.append(f"Mitsuba, {variant}: {reason}")
    tell("images: the reference")
    exact, doubt = images.reference()
    comparison.device = images.described["device"]
    comparison.about = (
        f"The station of models/station.toml at time 0, each node at the balance of the moment: {images.described['triangles']} "
        f"triangles, {WIDTH} x {HEIGHT} pixels, 8 to 14 um. A frame is from the call until its pixels are on the host, the scene "
        "loaded before; Isotherm's camera moves every frame, Mitsuba's stands still with new samples. Isotherm samples the "
        "centres of pixels: more samples are a larger image and the mean of its pixels, counted. Mitsuba has the same triangles as area emitters with "
        "the radiance of their corners, path tracer of depth 1, multijittered samples, box filter."
    )
    comparison.reference = (
        f"rays through Mitsuba that interpolate temperature and apply Planck's law in f32, {REFERENCE[0] * REFERENCE[1]} samples a "
        f"pixel (the first half of them is {doubt.rms:.1e} away)"
    )
    rows(comparison, images, exact)
    comparison.goals.append(goal(comparison))
    np.savez(TARGET / "work" / "pictures.npz", exact=exact, **{f"{k[0]}_{k[1]}": v for k, v in images.pictures.items()})
    return comparison


def rows(comparison: Comparison, images: Images, exact: NDArray[np.float64]) -> None:
    """A row a program and number of samples."""
    numbers = {"Isotherm": images.shop.isotherm_version}
    for (program, samples), clocks in images.clocks.items():
        comparison.rows.append(
            Row(
                work=f"{WIDTH} x {HEIGHT}",
                program=f"{program}, {samples} samples a pixel",
                version=numbers.get(program) or version("mitsuba"),
                times=Times.of(clocks, images.device.get((program, samples))),
                unit="ms a frame",
                error=error(images.pictures[program, samples], exact),
                size=samples,
            )
        )


def goal(comparison: Comparison) -> Goal:
    """For every image of Mitsuba's, the fastest of Isotherm's that errs no more."""
    own = [row for row in comparison.rows if row.program.startswith("Isotherm")]
    factors, beyond = {}, []
    for peer in (row for row in comparison.rows if row.program.startswith("Mitsuba")):
        as_good = [row for row in own if row.error and peer.error and row.error.rms <= peer.error.rms]
        if as_good:
            fastest = min(row.times.wall.median for row in as_good)
            factors[peer.program] = peer.times.wall.median / fastest
        else:
            beyond.append(peer.program)
    slower = [f"{name}: {factor:.2f} times" for name, factor in factors.items() if factor <= 1.0]
    reason = "; ".join(slower + [f"no image of Isotherm's errs as little as {name}" for name in beyond])
    measured = ", ".join(f"{factor:.1f} times against {name}" for name, factor in factors.items())
    return Goal("images faster than Mitsuba's at equal error", measured or "nothing to compare", not reason, reason)
