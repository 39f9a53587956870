"""Images of one scene: Isotherm's frame beside Mitsuba 3, at several samples a pixel."""

import json
import os
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from peer_bench.image_scenes import HEIGHT, SCENES, WIDTH
from peer_bench.record import Comparison, Error, Goal, Row, Times
from peer_bench.workshop import Unavailable, Workshop, llvm, tell, version

# Isotherm takes more samples by a larger image, whose pixels are then averaged.
SCALES = (1, 2, 4)
SAMPLES, QUICK_SAMPLES = (1, 4, 16, 64), (1, 4, 16)
VARIANTS = {"llvm_ad_mono": "Mitsuba, LLVM", "scalar_rgb": "Mitsuba, scalar"}
# Passes of a frame whose times are shown.
SHOWN = ("cull", "radiance", "read radiance", "read identity")
# Samples of the reference a pass, and passes.
REFERENCE = (16, 24)


def error(image: NDArray[np.floating[Any]], exact: NDArray[np.float64]) -> Error:
    """Over the pixels where either shows the craft, relative to the craft's mean radiance."""
    drawn = (exact > 0.0) | (image > 0.0)
    away = (image[drawn] - exact[drawn]) / exact[exact > 0.0].mean()
    return Error(float(np.sqrt(np.mean(away**2))), float(np.abs(away).max()), "of the mean radiance")


class Images:
    """What both programs drew of a scene."""

    def __init__(self, shop: Workshop, name: str) -> None:
        self.shop, self.name = shop, name
        self.scene = shop.work / "scene.toml"
        self.scene.write_text(SCENES[name](shop.work), encoding="utf-8")
        self.folder = shop.work / "image"
        self.described: dict[str, Any] = {}
        self.clocks: dict[tuple[str, int], list[list[float]]] = {}
        self.device: dict[tuple[str, int], list[float]] = {}
        self.pictures: dict[tuple[str, int], NDArray[np.float32]] = {}
        self.frames = 3 if shop.quick else 6

    def isotherm(self) -> None:
        """Frames at every scale; the mean over pixels counts to the time."""
        scales = ",".join(str(scale) for scale in SCALES)
        words: list[str | Path] = [
            "image",
            self.scene,
            "--output",
            self.folder,
            "--scale",
            scales,
            "--frames",
            str(self.frames),
        ]
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
    """Scene by scene: the programs in turn, then the reference."""
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", str(llvm()))
    comparison = Comparison(
        key="images",
        title="Images: Isotherm's frame and Mitsuba 3",
        about=(
            f"Emitted radiance, 8 to 14 um, of {WIDTH} x {HEIGHT} pixels. A frame is from the call until its pixels are on the host, "
            "the scene loaded before (Mitsuba's tree of boxes too); Isotherm's camera moves with every frame, Mitsuba's stands "
            "still with new samples. Isotherm samples the centres of pixels: more samples are a larger image and the mean of its "
            "pixels, whose time is counted. Mitsuba has the same triangles as area emitters with the radiance of their corners, "
            "the path tracer at depth 1, multijittered samples, a box filter. spp: samples a pixel."
        ),
    )
    references = []
    for name in SCENES:
        images = Images(shop, name)
        exact, doubt = draw(images, comparison)
        comparison.device = images.described["device"]
        comparison.rows += rows(images, exact)
        comparison.goals.append(goal(shop, name, images, comparison.rows))
        references.append(f"{name}: {doubt.rms:.1e}")
    samples = REFERENCE[0] * REFERENCE[1] // (4 if shop.quick else 1)
    comparison.reference = (
        "rays by Mitsuba that interpolate temperature and apply Planck's law where they meet the surface, "
        f"{samples} samples a pixel (the first half of them differ from all by {', '.join(references)})"
    )
    return comparison


def draw(images: Images, comparison: Comparison) -> tuple[NDArray[np.float64], Error]:
    """All programs in turn; the reference."""
    given_up: set[str] = set()
    for _ in range(1 if images.shop.quick else 3):
        tell(f"images: {images.name}, Isotherm")
        images.isotherm()
        for variant in VARIANTS:
            if variant in given_up:
                continue
            tell(f"images: {images.name}, Mitsuba {variant}")
            try:
                images.mitsuba(variant)
            except Unavailable as reason:
                given_up.add(variant)
                comparison.missing.append(f"{images.name}, Mitsuba {variant}: {reason}")
    tell(f"images: {images.name}, reference")
    return images.reference()


def rows(images: Images, exact: NDArray[np.float64]) -> list[Row]:
    """A row a program and number of samples."""
    passes = {row["scale"] ** 2: row["passes_ms"] for row in images.described["rows"]}
    made = []
    for (program, samples), clocks in images.clocks.items():
        own = program == "Isotherm"
        spent = passes.get(samples, {}) if own else {}
        made.append(
            Row(
                work=f"{images.name}: {images.described['triangles']} triangles",
                program=f"{program}, {samples} spp",
                version=images.shop.isotherm_version if own else version("mitsuba"),
                times=Times.of(clocks, images.device.get((program, samples))),
                unit="ms a frame",
                error=error(images.pictures[program, samples], exact),
                size=samples,
                note=", ".join(f"{name} {ms:.1f} ms" for name, ms in spent.items() if name in SHOWN),
            )
        )
    return made


def goal(shop: Workshop, name: str, images: Images, rows: list[Row]) -> Goal:
    """For every image of Mitsuba's, the fastest of Isotherm's that errs no more."""
    of_scene = [row for row in rows if row.work.startswith(f"{name}:")]
    own = [row for row in of_scene if row.program.startswith("Isotherm")]
    factors, beyond = {}, []
    for peer in (row for row in of_scene if row.program.startswith("Mitsuba")):
        as_good = [row for row in own if row.error and peer.error and row.error.rms <= peer.error.rms]
        if as_good:
            factors[peer.program] = min(as_good, key=lambda row: shop.judged(row.times)), peer
        else:
            beyond.append(peer.program.removeprefix("Mitsuba, "))
    said, slower = [], {}
    for program, (best, peer) in factors.items():
        factor = shop.judged(peer.times) / shop.judged(best.times)
        clock = peer.times.wall.median / best.times.wall.median
        against = f"{program.removeprefix('Mitsuba, ')} ({best.program.removeprefix('Isotherm, ')} of Isotherm)"
        said.append(f"{against} {factor:.2f} times ({clock:.2f} by the clock)")
        if factor <= 1.0:
            slower[best.program] = best.note
    spent = "; ".join(f"{program} spends on the device: {note}" for program, note in slower.items())
    reason = f"rasterising sets up every triangle and fills and reads every pixel of the larger image; {spent}"
    reason = reason if slower else ""
    if beyond:
        reason += f"{'; ' if reason else ''}no image of Isotherm's errs as little as {', '.join(beyond)}"
    text = f"{name}: faster than Mitsuba at no more error"
    return Goal(text, ", ".join(said) or "nothing to compare", bool(said) and not slower, reason)
