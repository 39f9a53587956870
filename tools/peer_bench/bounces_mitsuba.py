"""Light that surfaces of a craft send to each other by Isotherm against Mitsuba 3: grooves, boxes, bars, a dish, tubes.

    DRJIT_LIBLLVM_PATH=libLLVM.so.19 python -m peer_bench.bounces_mitsuba ISOTHERM FOLDER [CASE ..]

ISOTHERM is the program. FOLDER takes its scenes and images. All surfaces are at 300 K before cold space, foil of emissivity
0.05 and some black ones. Mitsuba follows all reflections. Its rough conductor loses the light that facets send to each other,
so its lobes are divided by their own sum over the hemisphere, as those of Isotherm are (Turquin 2019). The column `raw` has
Mitsuba's own lobes. The script ends with 1 where a mean radiance is off by more than 1 %.
"""

import json
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
import OpenEXR
from numpy.typing import NDArray

mi.set_variant("llvm_ad_mono")

from peer_bench.image_mitsuba import radiance  # noqa: E402
from peer_bench.reflections_mitsuba import Mesh, cube, glb, inside, joined, quad  # noqa: E402

Array = NDArray[np.float64]
Numbers = list[float]

EMISSIVITY, KELVIN, BAND = 0.05, 300.0, [8e-6, 14e-6]
WIDTH, HEIGHT, SAMPLES, ALLOWED = 160, 120, 256, 0.01
# Finishes: diffuse, smooth, and rough mirrors.
FINISHES: dict[str, float | None] = {"diffuse": None, "smooth": 0.0, "0.1": 0.1, "0.2": 0.2, "0.3": 0.3, "1": 1.0}
# Views for which a lobe is summed, and draws along each of two axes. 20,000 random draws left sums of roughness 1 that were 0.2 to 0.8 % too large, and tubes
# that were 1.5 % too dark.
COSINES, DRAWS = 512, 300


def lobe_sum(alpha: float, view: float, numbers: Array) -> float:
    """Mean of Smith's masking over the directions of visible facets (Heitz 2018)."""
    slant = np.sqrt(1.0 - view * view)
    stretched = np.array([alpha * slant, 0.0, view])
    stretched /= np.linalg.norm(stretched)
    across = np.array([0.0, 1.0, 0.0])
    third = np.cross(stretched, across)
    radius, angle = np.sqrt(numbers[0]), 2.0 * np.pi * numbers[1]
    a, share = radius * np.cos(angle), 0.5 * (1.0 + stretched[2])
    b = (1.0 - share) * np.sqrt(1.0 - a * a) + share * radius * np.sin(angle)
    rest = np.sqrt(np.maximum(1.0 - a * a - b * b, 0.0))
    facet = a[:, None] * across + b[:, None] * third + rest[:, None] * stretched
    facet *= [alpha, alpha, 1.0]
    facet /= np.linalg.norm(facet, axis=1)[:, None]
    light = 2.0 * (facet @ [slant, 0.0, view]) * facet[:, 2] - view
    masked = 2.0 * light / (light + np.sqrt(alpha**2 + (1.0 - alpha**2) * light * light))
    return float(np.where(light > 0.0, masked, 0.0).mean())


class Lobe(mi.BSDF):
    """GGX facets with the separable masking of Smith, divided by their sum over the hemisphere."""

    def __init__(self, props: mi.Properties) -> None:
        """Takes `alpha` and `reflectance`."""
        mi.BSDF.__init__(self, props)
        self.alpha, self.reflectance = props.get("alpha"), props.get("reflectance")
        self.m_flags = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide
        self.m_components = [self.m_flags]
        self.facets = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self.alpha, True)
        even = (np.arange(DRAWS) + 0.5) / DRAWS
        numbers = np.array([axis.ravel() for axis in np.meshgrid(even, even)])
        sums = [lobe_sum(self.alpha, (place + 0.5) / COSINES, numbers) for place in range(COSINES)]
        self.sums = mi.Float(np.array(sums, np.float32))

    def kept(self, cosine: mi.Float, active: mi.Bool) -> mi.Float:
        """Reflectance over the sum of the lobe."""
        place = dr.clip(cosine * COSINES - 0.5, 0, COSINES - 1.001)
        first = mi.UInt32(place)
        below, above = (dr.gather(mi.Float, self.sums, first + step, active) for step in (0, 1))
        return self.reflectance / (below + (place - mi.Float(first)) * (above - below))

    def sample(self, ctx, si, sample1, sample2, active):  # noqa: ANN001, ANN201, ARG002 - Mitsuba's interface
        """A direction of a visible facet."""
        drawn = mi.BSDFSample3f()
        seen = mi.Frame3f.cos_theta(si.wi)
        facet, density = self.facets.sample(si.wi, sample2)
        drawn.wo, drawn.eta, drawn.sampled_component = mi.reflect(si.wi, facet), 1, 0
        drawn.sampled_type = +mi.BSDFFlags.GlossyReflection
        drawn.pdf = density / (4 * dr.dot(drawn.wo, facet))
        active &= (seen > 0) & (mi.Frame3f.cos_theta(drawn.wo) > 0)
        weight = self.kept(seen, active) * self.facets.smith_g1(drawn.wo, facet)
        return drawn, mi.Color1f(weight) & active

    def eval(self, ctx, si, wo, active):  # noqa: ANN001, ANN201, ARG002
        """Reflected share of a direction, times its cosine."""
        seen, lit = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
        active &= (seen > 0) & (lit > 0)
        half = dr.normalize(wo + si.wi)
        value = self.facets.eval(half) * self.facets.G(si.wi, wo, half) / (4 * seen) * self.kept(seen, active)
        return mi.Color1f(value) & active

    def pdf(self, ctx, si, wo, active):  # noqa: ANN001, ANN201, ARG002
        """Density of a direction."""
        seen, lit = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
        half = dr.normalize(wo + si.wi)
        active &= (seen > 0) & (lit > 0) & (dr.dot(wo, half) > 0)
        return dr.select(active, self.facets.eval(half) * self.facets.smith_g1(si.wi, half) / (4 * seen), 0)

    def eval_pdf(self, ctx, si, wo, active):  # noqa: ANN001, ANN201
        """Both."""
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)


mi.register_bsdf("lobe", Lobe)


@dataclass(frozen=True)
class Case:
    """Meshes by their names, `black` ones among them, and a camera."""

    meshes: dict[str, Mesh]
    eye: Numbers
    target: Numbers
    fov_deg: float
    up: Numbers = field(default_factory=lambda: [1.0, 0.0, 0.0])
    finishes: tuple[str, ...] = ("diffuse", "smooth", "0.1", "0.3", "1")


def groove(opening_deg: float) -> Mesh:
    """Two plates of 8 x 1.5 m that meet at the Y axis, at half the opening to both sides of +Z."""
    sine, cosine = (0.75 * value(np.radians(0.5 * opening_deg)) for value in (np.sin, np.cos))
    left = quad([-sine, 0.0, cosine], [0.0, 4.0, 0.0], [-sine, 0.0, cosine])
    right = quad([sine, 0.0, cosine], [0.0, -4.0, 0.0], [sine, 0.0, cosine])
    return joined([left, right])


def box(centre: Numbers) -> Mesh:
    """A cube of side 1.6."""
    whole = joined(list(cube()))
    return Mesh(whole.corners + np.array(centre), whole.normals, whole.triangles)


def turned(radii: Array, heights: Array, inward: bool, parts: int = 48) -> Mesh:
    """A surface of flat facets about +Z through rings."""
    faces = []
    angles = np.linspace(0.0, 2.0 * np.pi, parts + 1)
    for (r, z), (s, y) in zip(zip(radii[:-1], heights[:-1], strict=True), zip(radii[1:], heights[1:], strict=True), strict=True):
        for a, b in zip(angles[:-1], angles[1:], strict=True):
            ring = [[q * np.cos(t), q * np.sin(t), h] for q, t, h in ((r, a, z), (r, b, z), (s, b, y), (s, a, y))]
            corners = np.array(ring[::-1] if inward else ring)
            normal = np.cross(corners[2] - corners[0], corners[3] - corners[1])
            normals = np.tile(normal / np.linalg.norm(normal), (4, 1))
            faces.append(Mesh(corners, normals, np.array([[0, 1, 2], [0, 2, 3]], np.uint32)))
    return joined(faces)


def cases() -> dict[str, Case]:
    """All cases by name."""
    bars = [quad([0.4 * n - 0.8, 0.0, 1.5], [0.1, 0.0, 0.0], [0.0, 1.2, 0.0]) for n in range(5)]
    behind = [quad([0.4 * n - 0.8, 0.0, 1.499], [-0.1, 0.0, 0.0], [0.0, 1.2, 0.0]) for n in range(5)]
    plate = quad([0.0, 0.0, 0.0], [1.2, 0.0, 0.0], [0.0, 1.2, 0.0])
    bowl = np.linspace(0.05, 1.0, 9)
    tube, heights = np.array([1.0, 1.0]), np.array([0.0, 2.0])
    above, low = ([0.6, 0.35, 4.5], [0.0, 0.0, 0.7]), [0.0, 0.0, 0.0]
    values = ("diffuse", "smooth", "0.2")
    return {
        "groove 60": Case({"foil": groove(60.0)}, *above, 20.0, finishes=values),
        "groove 30": Case({"foil": groove(30.0)}, *above, 20.0, finishes=values),
        "corner": Case({"foil": groove(90.0)}, *above, 20.0, finishes=values),
        "boxes": Case({"foil": box([-1.1, 0.0, 0.0]), "other": box([1.1, 0.3, 0.0])}, [1.5, 2.0, 9.0], low, 30.0),
        "bars": Case({"foil": plate, "black": joined(bars + behind)}, [1.0, 0.4, 6.0], low, 30.0),
        "dish": Case({"foil": turned(bowl, 0.7 * bowl**2, inward=True)}, [0.9, 0.4, 4.5], [0.0, 0.0, 0.4], 28.0),
        "tubes": Case(
            {"foil": turned(tube, heights, inward=True), "other": turned(0.5 * tube, heights, inward=False)},
            [0.9, 0.7, 7.0],
            [0.0, 0.0, 1.0],
            20.0,
        ),
    }


def by_isotherm(program: Path, folder: Path, case: Case, roughness: float | None) -> tuple[Array, Array]:
    """Radiance over that of a blackbody, and the pixels inside the parts."""
    folder.mkdir(parents=True, exist_ok=True)
    glb(folder / "model.glb", case.meshes)
    mirror = "" if roughness is None else f"specular = 1.0\nroughness = {roughness}\n"
    rules = "".join(
        f'[[material]]\nmatch = "{name}"\nabsorptivity = 0.1\nemissivity = {1.0 if name == "black" else EMISSIVITY}\n'
        f'sides = "outside"\nresponse = "instant"\n{"" if name == "black" else mirror}'
        for name in case.meshes
    )
    scene = f"""[model]
path = "model.glb"
[time]
step = 1
steps = 1
draw_steps = [0]
[orbit]
altitude = 408e3
[attitude]
mode = "nadir"
nadir_axis = "-Z"
forward_axis = "+X"
[environment]
planet_radius = 6371e3
background_temperature = 0
[initial]
temperature = {KELVIN}
{rules}[radiance]
reflections = "traced"
[camera]
width = {WIDTH}
height = {HEIGHT}
fov_deg = {case.fov_deg}
samples = 16
frame = "body"
near = 0.01
position = {case.eye}
look_at = {case.target}
up = {case.up}
"""
    (folder / "scene.toml").write_text(scene)
    command = [program, "run", folder / "scene.toml", "-o", folder / "out", "--force"]
    subprocess.run(command, check=True, capture_output=True)
    with OpenEXR.File(str(folder / "out/frames/step_000000.exr"), separate_channels=True) as file:
        channels = {name: channel.pixels for name, channel in file.channels().items()}
    parts = [inside(channels["part"], number) for number in range(1, len(case.meshes) + 1)]
    return channels["L"] / radiance(BAND, np.array(KELVIN)), np.any(parts, axis=0)


def by_mitsuba(folder: Path, case: Case, roughness: float | None, lobe: bool) -> Array:
    """The same, with the lobes divided by their sums or as they are."""
    to_world = mi.ScalarTransform4f().look_at(origin=case.eye, target=case.target, up=case.up)
    film = {"type": "hdrfilm", "width": WIDTH, "height": HEIGHT, "rfilter": {"type": "box"}}
    scene: dict = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": -1, "rr_depth": 100},
        "sensor": {
            "type": "perspective",
            "fov_axis": "x",
            "fov": case.fov_deg,
            "to_world": to_world,
            "sampler": {"type": "independent", "sample_count": SAMPLES},
            "film": film | {"pixel_format": "luminance", "component_format": "float32"},
        },
    }
    for name, mesh in case.meshes.items():
        emissivity = 1.0 if name == "black" else EMISSIVITY
        grey = {"type": "uniform", "value": 1.0 - emissivity}
        if roughness is None or name == "black":
            bsdf = {"type": "diffuse", "reflectance": grey}
        elif roughness == 0.0:
            bsdf = {"type": "conductor", "material": "none", "specular_reflectance": grey}
        elif lobe:
            bsdf = {"type": "lobe", "alpha": roughness, "reflectance": 1.0 - emissivity}
        else:
            bsdf = {"type": "roughconductor", "material": "none", "distribution": "ggx", "alpha": roughness}
            bsdf |= {"specular_reflectance": grey}
        shape = mi.Mesh(name, len(mesh.corners), len(mesh.triangles))
        parameters = mi.traverse(shape)
        parameters["vertex_positions"] = mesh.corners.astype(np.float32).ravel()
        parameters["faces"] = mesh.triangles.ravel()
        parameters.update()
        file = folder / f"{name}.ply"
        shape.write_ply(str(file))
        light = {"type": "area", "radiance": {"type": "uniform", "value": emissivity}}
        scene[name] = {"type": "ply", "filename": str(file), "face_normals": True, "surface": bsdf, "emitter": light}
    return np.array(mi.render(mi.load_dict(scene), spp=SAMPLES, seed=1), dtype=np.float64)[..., 0]


def main() -> int:
    """Compares every case, prints a line for each, and returns the exit status."""
    program, folder = Path(sys.argv[1]), Path(sys.argv[2])
    missed, rows = 0, []
    for name, case in cases().items():
        if sys.argv[3:] and name not in sys.argv[3:]:
            continue
        for finish in case.finishes:
            roughness = FINISHES[finish]
            own, shown = by_isotherm(program, folder / name / finish, case, roughness)
            other, raw = (by_mitsuba(folder / name / finish, case, roughness, lobe) for lobe in (True, False))
            mask = shown & (other > 0.0)
            means = [float(image[mask].mean()) for image in (own, other, raw)]
            off = means[0] / means[1] - 1.0
            missed += abs(off) > ALLOWED
            rows.append({"case": name, "finish": finish, "isotherm": means[0], "mitsuba": means[1], "raw": means[2]})
            print(f"{name}, {finish}: {means[0]:.4f}, Mitsuba {means[1]:.4f} (raw {means[2]:.4f}), off by {100 * off:+.2f} %", flush=True)
    (folder / "bounces.json").write_text(json.dumps(rows))
    print(f"{missed} beyond {100 * ALLOWED} %")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
