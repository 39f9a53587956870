"""Cameras and poses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support import Scenes

import isotherm


def rotation(quaternion: tuple[float, float, float, float]) -> np.ndarray:
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def test_look_at_is_the_pose_of_the_scene(scene: Path) -> None:
    simulation = isotherm.Simulation(scene)
    own = simulation.image()
    again = simulation.image(position=(1.9, 1.3, -1.5), look_at=np.zeros(3), up=[0, 0, -1])
    assert (own.camera_from_body == again.camera_from_body).all()
    assert (own.radiance == again.radiance).all()
    other = simulation.image(position=(1.9, 1.3, -1.4), look_at=(0, 0, 0), up=(0, 0, -1))
    assert (own.radiance != other.radiance).any()


def test_a_quaternion_rotates_camera_axes_into_the_frame(scene: Path) -> None:
    simulation = isotherm.Simulation(scene)
    # Half a turn about X: the camera looks along -Z of the body, down from above.
    above = simulation.image(position=(0, 0, 3), quaternion=(0, 1, 0, 0))
    assert np.allclose(above.camera_from_body[:3, :3], rotation((0, 1, 0, 0)).T)
    assert np.allclose(above.camera_from_body @ [0, 0, 0, 1], [0, 0, 3, 1])
    looked = simulation.image(position=(0, 0, 3), look_at=(0, 0, 0), up=(0, 1, 0))
    assert np.allclose(above.camera_from_body, looked.camera_from_body, atol=1e-12)
    middle = (above.camera.height // 2, above.camera.width // 2)
    assert above.depth[middle] == pytest.approx(3 - 0.05, abs=1e-5)


def test_a_point_of_the_craft_is_seen_where_the_matrix_says(scene: Path) -> None:
    simulation = isotherm.Simulation(scene)
    frame = simulation.image(position=(0, 2, -4), look_at=(0, 0.3, 0), up=(1, 0, 0))
    # The wings have turned to the Sun, about an axis through the middle of the craft.
    for sign, name in ((-1, "wing_port"), (1, "wing_starboard")):
        point = frame.camera_from_body @ [0, sign * 0.42, 0, 1]
        column, row, scale = frame.camera.matrix @ point[:3]
        pixel = round(row / scale), round(column / scale)
        assert simulation.parts[frame.part[pixel] - 1] == name
        assert frame.depth[pixel] == pytest.approx(point[2], abs=0.03)


def test_poses_in_the_frames_of_orbit_and_space(scene: Path) -> None:
    simulation = isotherm.Simulation(scene)
    simulation.step_to(1000)
    sky = simulation.sky
    assert np.allclose(sky.body_from_orbit, np.eye(3), atol=1e-9), "the craft flies nadir-pointing"
    for name, body_from in (("orbit", sky.body_from_orbit), ("inertial", sky.body_from_inertial)):
        position = body_from.T @ [2.0, 1.0, -1.0]
        up = body_from.T @ [0.0, 0.0, -1.0]
        there = simulation.image(position=position, look_at=(0, 0, 0), up=up, frame=name)  # type: ignore[arg-type]
        body = simulation.image(position=(2, 1, -1), look_at=(0, 0, 0), up=(0, 0, -1), frame="body")
        assert np.allclose(there.camera_from_body, body.camera_from_body, atol=1e-9)
    assert abs(np.linalg.norm(sky.sun_direction) - 1) < 1e-12 and 0 <= sky.lit_fraction <= 1


def test_another_camera(scene: Path) -> None:
    simulation = isotherm.Simulation(scene)
    own = simulation.image()
    narrow = simulation.camera.replace(width=40, height=30, cx=20, cy=15)
    frame = simulation.image(camera=narrow)
    assert frame.radiance.shape == (30, 40) and frame.camera.width == 40
    # The middle of the image is the same: the first pixel of the small one is pixel (21, 28) of the large one.
    assert (own.part[21:51, 28:68] == frame.part).all()
    assert np.allclose(own.depth[21:51, 28:68], frame.depth, atol=1e-5)
    assert (simulation.image().radiance == own.radiance).all()
    wide = isotherm.Camera(64, 48, fx=30, distortion=[0.1, 0, 0, 0], distortion_model="fisheye")
    assert wide.distortion == [0.1, 0, 0, 0] and (wide.cx, wide.fy) == (32, 30)
    assert wide.model == wide.distortion_model == wide.replace(fx=31).model == "fisheye"
    opencv = isotherm.Camera(64, 48, fx=60, distortion=[-0.1, 0.02, 0.001, 0])
    assert opencv.model == "brown_conrady" and opencv.distortion == [-0.1, 0.02, 0.001, *[0] * 9]
    assert isotherm.Camera(64, 48, fx=60).model == "pinhole"
    assert simulation.image(camera=wide).temperature.max() > 100


def test_a_scene_without_a_camera(scenes: Scenes) -> None:
    scene = scenes.write(("draw_every = 10", "draw_every = 0"))
    text = scene.read_text()
    start = text.index("[camera]")
    scene.write_text(text[:start] + text[text.index("[[probe]]") :])
    simulation = isotherm.Simulation(scene)
    with pytest.raises(isotherm.RequestError, match="no camera"):
        simulation.image()
    camera = isotherm.Camera(32, 24, fx=40)
    frame = simulation.image(camera=camera, position=(2, 0, 0), look_at=(0, 0, 0))
    assert (frame.part > 0).any()
