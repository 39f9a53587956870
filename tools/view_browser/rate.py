"""Counts the images that come over the WebSocket in a second, without a browser."""

import asyncio
import json
import math
import statistics
import struct
import time
from typing import Any

import websockets

from .program import view


def _header(packet: bytes) -> dict[str, Any]:
    (length,) = struct.unpack_from("<I", packet, 4)
    return json.loads(packet[8 : 8 + length])


async def _count(address: str, seconds: float, turns: bool) -> tuple[float, dict[str, Any], float]:
    """Images a second, the last header, and the median of the time of an image on the host [ms]."""
    async with websockets.connect(address.replace("http", "ws") + "stream", max_size=None) as socket:
        hello = json.loads(await socket.recv())
        middle, radius, up = hello["middle"], hello["radius"], hello["up"]
        across = [1.0, 0.0, 0.0] if abs(up[0]) < 0.5 else [0.0, 1.0, 0.0]
        side = [up[1] * across[2] - up[2] * across[1], up[2] * across[0] - up[0] * across[2], up[0] * across[1] - up[1] * across[0]]

        async def look(number: int) -> None:
            angle = 0.05 * number
            away = [2.6 * radius * (math.cos(angle) * a + math.sin(angle) * b + 0.4 * c) for a, b, c in zip(across, side, up, strict=True)]
            position = [at + by for at, by in zip(middle, away, strict=True)]
            await socket.send(json.dumps({"do": "look", "position": position, "target": middle, "up": up}))

        if not turns:
            await socket.send(json.dumps({"do": "play", "rate": 240}))
        count, began, times = 0, 0.0, []
        header: dict[str, Any] = {}
        while True:
            message = await socket.recv()
            if isinstance(message, str):
                continue
            header = _header(message)
            await socket.send(json.dumps({"do": "shown"}))
            if turns:
                await look(count)
            count += 1
            if count == 5:
                began, times = time.monotonic(), []
            times.append(header["image_ms"])
            at_the_end = not turns and header["step"] == hello["steps"]
            if count > 5 and (time.monotonic() - began > seconds or at_the_end):
                rate = (count - 5) / (time.monotonic() - began)
                await socket.send(json.dumps({"do": "pause"}))
                return rate, header, statistics.median(times)


def print_rates(scene: str, seconds: float, more: list[str]) -> None:
    """Prints a row of a table: a craft that turns, and time that plays."""
    with view(scene, *more) as address:
        turning, header, image = asyncio.run(_count(address, seconds, True))
        playing, _, _ = asyncio.run(_count(address, seconds, False))
    device = sum(ms for _, ms in header["passes"])
    size = f"{header['width']} x {header['height']}"
    print(f"| `{scene}` | {size} | {turning:.1f} | {playing:.1f} | {image:.1f} | {device:.1f} |")
