"""Reads the log of `isotherm run --mcap` with rosbags and mcap-ros2-support, and compares it with the EXR files of the run."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
from mcap_ros2.reader import read_ros2_messages
from opencv_points.exr import read
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore


def check_log(isotherm: str, folder: Path) -> tuple[bool, str]:
    """Whether both readers see the run, and a sentence about it."""
    log, out = folder / "run.mcap", folder / "run"
    shutil.rmtree(out, ignore_errors=True)
    subprocess.run([isotherm, "run", "craft.toml", "-o", str(out), "--mcap", str(log)], cwd=folder, check=True, timeout=600)
    files = sorted((out / "frames").glob("*.exr"))
    frames = [read(file) for file in files]

    def right(messages: dict[str, list]) -> bool:
        good = {topic: len(found) for topic, found in messages.items()} == dict.fromkeys(
            ("/camera/temperature", "/camera/radiance", "/camera/camera_info", "/craft/pose", "/tf"), len(frames)
        )
        for number, (channels, header) in enumerate(frames):
            picture, floats = messages["/camera/temperature"][number], messages["/camera/radiance"][number]
            shape = channels["T"].shape
            kelvin = np.frombuffer(bytes(picture.data), "<u2").reshape(shape) * 0.01
            good &= picture.encoding == "mono16" and bool(np.abs(kelvin - channels["T"]).max() < 0.00501)
            good &= floats.encoding == "32FC1" and bytes(floats.data) == channels["L"].astype("<f4").tobytes()
            info = messages["/camera/camera_info"][number]
            matrix = np.array(getattr(info, "K", getattr(info, "k", None))).reshape(3, 3)
            good &= bool(np.allclose(matrix, header["isotherm_camera_opencv_matrix"]))
            frames_of_tf = {one.child_frame_id: one for one in messages["/tf"][number].transforms}
            good &= {"camera", "inertial", "planet"} <= set(frames_of_tf)
            craft, planet = messages["/craft/pose"][number], frames_of_tf["planet"].transform.translation
            place = craft.pose.position
            good &= craft.header.frame_id == "planet" and 6.4e6 < np.linalg.norm([place.x, place.y, place.z]) < 5e7
            good &= [place.x, place.y, place.z] == [-planet.x, -planet.y, -planet.z]
            for transform in messages["/tf"][number].transforms:
                if transform.child_frame_id != "camera":
                    continue
                q, t = transform.transform.rotation, transform.transform.translation
                x, y, z, w = q.x, q.y, q.z, q.w
                turn = np.array([
                    [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                    [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                    [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
                ])
                body = np.array(header["isotherm_camera_from_body"])
                good &= bool(np.allclose(turn.T, body[:3, :3], atol=1e-9) and np.allclose(-turn.T @ [t.x, t.y, t.z], body[:3, 3], atol=1e-9))
        return good

    by_mcap: dict[str, list] = {}
    for message in read_ros2_messages(str(log)):
        by_mcap.setdefault(message.channel.topic, []).append(message.ros_msg)
    by_rosbags: dict[str, list] = {}
    with AnyReader([log], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        for connection, _, data in reader.messages():
            by_rosbags.setdefault(connection.topic, []).append(reader.deserialize(data, connection.msgtype))
    good = [right(by_mcap), right(by_rosbags)]
    return all(good) and len(frames) > 2, f"mcap-ros2-support and rosbags read {len(frames)} images of the log: {good}"
