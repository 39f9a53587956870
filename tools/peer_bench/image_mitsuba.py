"""The image by Mitsuba 3: every triangle an area emitter of its own radiance, no light goes further than the camera.

    python -m peer_bench.image_mitsuba FOLDER VARIANT SAMPLES,.. FRAMES OUT.npz
    python -m peer_bench.image_mitsuba FOLDER reference SAMPLES PASSES OUT.npz

FOLDER is what `peers image` left. The reference interpolates temperature instead of radiance and applies Planck's law where
a ray meets the surface, with so many samples a pixel in each pass.
"""

import json
import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]

# A sheet's back lies so far behind its front [m].
SHEET = 1e-4
# Planck's law [W m2, m K], CODATA 2018.
FIRST, SECOND = 1.191042972e-16, 1.438776877e-2
# Points of Gauss and Legendre's rule over the band: exact to seven digits at the temperatures of a craft.
POINTS = 16


@dataclass(frozen=True)
class Surface:
    """Triangles with the temperatures of their corners and one emissivity."""

    corners: Floats
    kelvin: Floats
    emissivity: Floats


def read(folder: Path) -> tuple[Surface, dict]:
    """What is drawn, and the camera; sheets become two surfaces, and triangles without area are left out."""
    described = json.loads((folder / "image.json").read_text())
    corners = np.fromfile(folder / "corners.f32", np.float32).reshape(-1, 3, 3)
    kelvin = np.fromfile(folder / "temperatures.f32", np.float32).reshape(-1, 3)
    emissivity = np.fromfile(folder / "emissivities.f32", np.float32).reshape(-1, 2)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    solid = length > 0.0
    corners, kelvin, emissivity = corners[solid], kelvin[solid], emissivity[solid]
    normal = normal[solid] / length[solid, None]
    sheet = emissivity[:, 1] > 0.0
    back = corners[sheet][:, ::-1] - SHEET * normal[sheet][:, None, :]
    surface = Surface(
        corners=np.concatenate([corners, back]).astype(np.float32),
        kelvin=np.concatenate([kelvin, kelvin[sheet][:, ::-1]]),
        emissivity=np.concatenate([emissivity[:, 0], emissivity[sheet][:, 1]]),
    )
    return surface, described


def rule(band: list[float]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Wavelengths [m] and weights [m]."""
    places, weights = np.polynomial.legendre.leggauss(POINTS)
    half = 0.5 * (band[1] - band[0])
    return band[0] + half * (1.0 + places), half * weights


def radiance(band: list[float], kelvin: NDArray[np.float64]) -> NDArray[np.float64]:
    """In-band radiance of a blackbody [W m-2 sr-1]."""
    total = np.zeros_like(kelvin)
    for wavelength, weight in zip(*rule(band), strict=True):
        total += weight * FIRST / wavelength**5 / np.expm1(SECOND / (wavelength * kelvin))
    return total


def scene(mi, surface: Surface, described: dict, ply: Path):  # noqa: ANN001, ANN201 - Mitsuba comes with a variant
    """The scene, its mesh through a file so that the emitter may read an attribute of it."""
    count = len(surface.kelvin)
    mesh = mi.Mesh("craft", vertex_count=3 * count, face_count=count)
    emissivity = np.repeat(surface.emissivity, 3)
    kelvin = surface.kelvin.ravel()
    emitted = emissivity * radiance(described["band_m"], kelvin.astype(np.float64))
    mesh.add_attribute("vertex_radiance", 1, emitted.astype(np.float32))
    mesh.add_attribute("vertex_kelvin", 1, kelvin)
    mesh.add_attribute("vertex_emissivity", 1, emissivity)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = surface.corners.ravel()
    parameters["faces"] = np.arange(3 * count, dtype=np.uint32)
    parameters.update()
    mesh.write_ply(str(ply))
    camera = described["camera"]
    pose = np.eye(4)
    pose[:3, :3] = np.array(camera["camera_from_body_columns"]).T
    pose[:3, 3] = camera["camera_from_body_translation"]
    # Mitsuba looks along +Z too, with +X to the left and +Y up.
    to_world = np.linalg.inv(pose) @ np.diag([-1.0, -1.0, 1.0, 1.0])
    across = 2.0 * np.degrees(np.arctan(0.5 * camera["width"] / camera["focal_px"][0]))
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 1},
            "craft": {
                "type": "ply",
                "filename": str(ply),
                "face_normals": True,
                "bsdf": {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.0}},
                "emitter": {"type": "area", "radiance": {"type": "mesh_attribute", "name": "vertex_radiance"}},
            },
            "sensor": {
                "type": "perspective",
                "fov_axis": "x",
                "fov": float(across),
                "near_clip": 0.1,
                "far_clip": 1e5,
                "to_world": mi.ScalarTransform4f(to_world),
                "sampler": {"type": "multijitter"},
                "film": {
                    "type": "hdrfilm",
                    "width": camera["width"],
                    "height": camera["height"],
                    "rfilter": {"type": "box"},
                    "pixel_format": "luminance",
                    "component_format": "float32",
                },
            },
        }
    )


def draw(mi, scene, samples: int, seed: int) -> Floats:  # noqa: ANN001
    """One image on the host, one number a pixel."""
    image = mi.render(scene, spp=samples, seed=seed)
    return np.array(image, dtype=np.float32)[..., 0]


def timed(mi, scene, samples: int, frames: int) -> dict[str, NDArray]:  # noqa: ANN001
    """Images and milliseconds, by the clock and of the processors; the first two compile."""
    clocks, image = [], np.empty(0, np.float32)
    for number in range(frames + 2):
        began, busy = time.perf_counter(), time.process_time()
        image = draw(mi, scene, samples, number)
        if number >= 2:
            clocks.append([1e3 * (time.perf_counter() - began), 1e3 * (time.process_time() - busy)])
    return {f"image_{samples}": image, f"clock_ms_{samples}": np.array(clocks)}


def reference(mi, scene, described: dict, samples: int, passes: int) -> dict[str, NDArray]:  # noqa: ANN001
    """The image with Planck's law at every meeting of a ray and the surface, and that of half the passes."""
    import drjit as dr

    places = zip(*rule(described["band_m"]), strict=True)
    terms = [(float(weight * FIRST / place**5), float(SECOND / place)) for place, weight in places]

    class Planck(mi.SamplingIntegrator):
        def sample(self, scene, sampler, ray, medium=None, active=True):  # noqa: ANN001, ANN202, ARG002
            met = scene.ray_intersect(ray, active)
            hit = active & met.is_valid()
            kelvin = met.shape.eval_attribute_1("vertex_kelvin", met, hit)
            emissivity = met.shape.eval_attribute_1("vertex_emissivity", met, hit)
            total = mi.Float(0.0)
            for scale, exponent in terms:
                total += scale / (dr.exp(exponent / kelvin) - 1.0)
            facing = mi.Frame3f.cos_theta(met.wi) > 0.0
            value = dr.select(hit & facing, emissivity * total, 0.0)
            return mi.Color1f(value), hit, []

    mi.register_integrator("planck", lambda properties: Planck(properties))
    integrator = mi.load_dict({"type": "planck"})
    total, half = np.zeros(1), np.zeros(1)
    for number in range(passes):
        image = np.array(mi.render(scene, integrator=integrator, spp=samples, seed=1000 + number), dtype=np.float64)
        total = total + image[..., 0]
        half = total.copy() if number + 1 == passes // 2 else half
    return {"image": total / passes, "half": half / max(1, passes // 2)}


def main() -> None:
    folder, variant, samples = Path(sys.argv[1]), sys.argv[2], sys.argv[3]
    count, output = int(sys.argv[4]), sys.argv[5]
    llvm = Path("/usr/lib/x86_64-linux-gnu/libLLVM-15.so.1")
    if "DRJIT_LIBLLVM_PATH" not in os.environ and llvm.exists():
        os.environ["DRJIT_LIBLLVM_PATH"] = str(llvm)
    import mitsuba as mi

    mi.set_variant("llvm_ad_mono" if variant == "reference" else variant)
    surface, described = read(folder)
    drawn = scene(mi, surface, described, folder / f"craft_{variant}.ply")
    if variant == "reference":
        np.savez(output, **reference(mi, drawn, described, int(samples), count))
        return
    found: dict[str, NDArray] = {}
    for number in samples.split(","):
        found |= timed(mi, drawn, int(number), count)
    np.savez(output, **found)


if __name__ == "__main__":
    main()
