"""Images in sunlight by Mitsuba 3: a plate behind a blocker, a sphere with its terminator, the day side of the Earth up to its limb.

    python -m peer_bench.sunlit_mitsuba tools/oracle/data/sunlit.json

The Sun is a sphere of its solid angle with a radiance of 1. The file has the mean radiance of each block of 16 x 16 pixels, row after row.
`tests/it/sunlit.rs` holds Isotherm to it, in 3 to 5 um and in visible light. Needs mitsuba 3.9.1 and numpy.
"""

import json
import sys
from pathlib import Path

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")

WIDTH, HEIGHT, BLOCK, SAMPLES = 64, 48, 16, 1024
# Sine of the Sun's radius (IAU 2015), and its distance here.
SUN_SINE, SUN_DISTANCE = 695_700.0 / 149_597_870.7, 2e4


def sun(direction: list[float]) -> dict:
    """A sphere that emits, in a direction."""
    centre = SUN_DISTANCE * np.array(direction) / np.linalg.norm(direction)
    light = {"type": "area", "radiance": {"type": "rgb", "value": 1.0}}
    return {"type": "sphere", "center": centre.tolist(), "radius": SUN_DISTANCE * SUN_SINE, "emitter": light}


def grey(reflectance: float) -> dict:
    """A diffuse surface of two sides."""
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": reflectance}}}


def square(size: float, height: float, reflectance: float) -> dict:
    """A square across Z."""
    to_world = mi.ScalarTransform4f().translate([0, 0, height]).scale(size)
    return {"type": "rectangle", "to_world": to_world, "bsdf": grey(reflectance)}


def blocks(shapes: dict, place: list[float], target: list[float], fov_deg: float) -> list[float]:
    """Mean radiance of the blocks of an image."""
    film = {"type": "hdrfilm", "width": WIDTH, "height": HEIGHT, "pixel_format": "luminance", "rfilter": {"type": "box"}}
    to_world = mi.ScalarTransform4f().look_at(origin=place, target=target, up=[0, 0, 1])
    camera = {"type": "perspective", "fov": fov_deg, "fov_axis": "x", "near_clip": 1e-3, "to_world": to_world, "film": film}
    scene = mi.load_dict({"type": "scene", "integrator": {"type": "path", "max_depth": 2, "hide_emitters": True}, "sensor": camera, **shapes})
    image = np.array(mi.render(scene, spp=SAMPLES), np.float64).reshape(HEIGHT // BLOCK, BLOCK, WIDTH // BLOCK, BLOCK)
    return image.mean(axis=(1, 3)).ravel().tolist()


def main() -> None:
    """Renders the scenes."""
    phase = np.radians(80.0)
    sphere = {"type": "sphere", "radius": 1.0, "bsdf": grey(0.8)}
    earth = {"type": "sphere", "center": [0, 0, -6.779], "radius": 6.371, "bsdf": grey(0.3)}
    day = sun([-np.sin(phase), 0.0, np.cos(phase)])
    results = {
        "plate": blocks({"plate": square(1.0, 0.0, 0.8), "blocker": square(0.5, 1.0, 0.0), "sun": sun([0.3, 0.2, 1.0])}, [2.5, -2.5, 2.2], [0, 0, 0], 50.0),
        "sphere": blocks({"sphere": sphere, "sun": sun([1.0, 0.0, 0.0])}, [3.0, -5.0, 0.0], [0, 0, 0], 25.0),
        "earth": blocks({"earth": earth, "sun": day}, [0, 0, 0], [1.43, 0.0, -1.0], 60.0),
    }
    command = "python -m peer_bench.sunlit_mitsuba tools/oracle/data/sunlit.json"
    about = {"command": command, "program": f"mitsuba {mi.__version__}", "samples": SAMPLES}
    Path(sys.argv[1]).write_text(json.dumps({**about, **results}, indent=1) + "\n")


if __name__ == "__main__":
    main()
