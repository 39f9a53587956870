"""The page in Chromium: what it shows is held against EXR images of `isotherm render`."""

import os
import re
import subprocess
import time
from base64 import b64decode
from pathlib import Path

import numpy as np
from opencv_points.exr import read
from playwright.sync_api import Browser, BrowserContext, Page

SCENE = "models/cubesat.toml"
SIZE = [320, 240]
STEP = 10.0
LATER = 40
STATION = ["models/station_transition.toml", "--size", "1024x768"]
STATION_STEP = 262
TOLERANCE = 0.05
PATIENCE = 300.0
PLACES = 25
WINDOW = {"width": 1366, "height": 768}
CONTROLS = {"button", "slider", "combobox", "checkbox", "spinbutton", "textbox", "image", "img"}


def render(step: int, folder: Path, more: list[str], scene: str | Path = SCENE) -> dict[str, np.ndarray]:
    """The channels of the image at a step."""
    path = folder / f"{Path(scene).stem}_{step}.exr"
    command = [os.environ["ISOTHERM"], "render", str(scene), "--time", str(step * STEP), "-o", str(path), *more]
    subprocess.run(command, check=True, capture_output=True)
    return read(path)[0]


class Looker:
    """A tab of the page, which notes what goes wrong in it."""

    def __init__(self, context: BrowserContext, address: str) -> None:
        self.page: Page = context.new_page()
        self.wrong: list[str] = []
        self.page.on("pageerror", lambda error: self.wrong.append(str(error)))
        self.page.on("console", lambda message: self.wrong.append(message.text) if message.type in {"error", "warning"} else None)
        self.page.on("request", lambda request: self.wrong.append(request.url) if not request.url.startswith((address, "data:")) else None)
        self.page.goto(address)
        self.settle(None)

    def wait(self, condition: str) -> None:
        """Waits until a condition holds. The page's own rules forbid Playwright's way, which evaluates texts in the page."""
        end = time.monotonic() + PATIENCE
        while not self.page.evaluate(condition):
            assert time.monotonic() < end, f"it never holds that {condition}; wrong in the page: {self.wrong}"
            self.page.wait_for_timeout(100)

    def settle(self, step: int | None) -> None:
        """Waits until the image of a step is drawn."""
        self.wait("document.getElementById('speed').textContent.includes('image')")
        if step is not None:
            self.wait(f"document.getElementById('clock').dataset.step === '{step}'")
        self.page.wait_for_timeout(700)

    def seek(self, step: int) -> None:
        """Scrubs to a step."""
        self.page.locator("#time").evaluate(f"(e) => {{ e.value = {step}; e.dispatchEvent(new Event('input')); e.dispatchEvent(new Event('change')); }}")
        self.settle(step)

    def at(self, x: int, y: int) -> tuple[float, float]:
        """Where the centre of a pixel of the image lies in the window."""
        box = self.page.locator("#picture").bounding_box()
        assert box is not None
        zoom = min(box["width"] / SIZE[0], box["height"] / SIZE[1])
        left = box["x"] + (box["width"] - zoom * SIZE[0]) / 2
        top = box["y"] + (box["height"] - zoom * SIZE[1]) / 2
        return left + (x + 0.5) * zoom, top + (y + 0.5) * zoom

    def read_out(self, x: int, y: int) -> tuple[float, int, int]:
        """The temperature that the page tells, and of which pixel."""
        self.page.mouse.move(*self.at(x, y))
        text = self.page.locator("#readout").inner_text()
        kelvin = re.search(r"([\d.]+) K", text)
        pixel = re.search(r"pixel (\d+), (\d+)", text)
        assert kelvin and pixel, text
        return float(kelvin[1]), int(pixel[1]), int(pixel[2])

    def difference(self, shown: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> float:
        """Largest difference of the read-out of a shown image to another image, over places spread over the craft in both [K]."""
        rows, columns = np.nonzero((shown["part"] != 0) & (other["part"] != 0))
        places = np.linspace(0, len(rows) - 1, PLACES).astype(int)
        most = 0.0
        for place in places:
            kelvin, x, y = self.read_out(int(columns[place]), int(rows[place]))
            most = max(most, abs(kelvin - float(other["T"][y, x])))
        return most

    def canvas(self) -> np.ndarray:
        """The pixels of the canvas."""
        script = """(() => {
            const c = document.getElementById('picture');
            const copy = new OffscreenCanvas(c.width, c.height).getContext('2d', { willReadFrequently: true });
            copy.drawImage(c, 0, 0);
            const d = copy.getImageData(0, 0, c.width, c.height).data;
            let text = '';
            for (let i = 0; i < d.length; i += 8192) text += String.fromCharCode(...d.subarray(i, i + 8192));
            return btoa(text);
        })()"""
        return np.frombuffer(b64decode(self.page.evaluate(script)), np.uint8).reshape(SIZE[1], SIZE[0], 4)


def unnamed(context: BrowserContext, page: Page) -> list[str]:
    """Roles of the controls and pictures without a name in the accessibility tree, and how many have one."""
    nodes = context.new_cdp_session(page).send("Accessibility.getFullAXTree")["nodes"]
    found = [node for node in nodes if not node.get("ignored") and node.get("role", {}).get("value") in CONTROLS]
    assert len(found) > 15, f"only {len(found)} controls"
    return [node["role"]["value"] for node in found if not node.get("name", {}).get("value")]


def _contrast(page: Page, ink: str, paper: str) -> float:
    """Contrast of two colours of the style sheet (WCAG 2.1)."""

    def luminance(name: str) -> float:
        text = page.evaluate(f"getComputedStyle(document.documentElement).getPropertyValue('{name}').trim()")
        parts = [int(text[i : i + 2], 16) / 255 for i in (1, 3, 5)]
        linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    dark, light = sorted([luminance(ink), luminance(paper)])
    return (light + 0.05) / (dark + 0.05)


def check_numbers(looker: Looker, folder: Path, more: list[str]) -> None:
    """Canvas and read-out are those of EXR images, also after scrubbing on and back."""
    images = {step: render(step, folder, more) for step in (0, LATER)}
    canvas = looker.canvas()
    corner = canvas[0, 0]
    craft = images[0]["part"] != 0
    assert (np.any(canvas != corner, axis=2) == craft).mean() > 0.999, "the canvas does not show the craft"
    assert len(np.unique(canvas[craft][:, :3], axis=0)) > 3, "the craft has hardly any colours"
    for step in (0, LATER, 0):
        looker.seek(step)
        most = looker.difference(images[step], images[step])
        print(f"view_check: at {step * STEP:.0f} s the read-out differs from the EXR by at most {most:.3f} K")
        assert most <= TOLERANCE, f"step {step}: {most} K"
    assert looker.difference(images[0], images[LATER]) > TOLERANCE, "another time is not told apart"


def check_keys(looker: Looker) -> None:
    """The keyboard plays, steps, turns, zooms and adds a probe."""
    page = looker.page
    page.locator("#picture").focus()
    page.keyboard.press(".")
    looker.settle(1)
    page.keyboard.press(",")
    looker.settle(0)
    page.keyboard.press("Space")
    page.wait_for_selector("#play[aria-label=Pause]", timeout=1e3 * PATIENCE)
    page.keyboard.press("Space")
    page.wait_for_selector("#play[aria-label=Play]", timeout=1e3 * PATIENCE)
    looker.settle(None)
    own = looker.canvas()
    for key in ("ArrowLeft", "ArrowUp", "+", "-"):
        before = looker.canvas()
        page.keyboard.press(key)
        looker.settle(None)
        assert np.any(looker.canvas() != before), f"{key} does nothing"
    page.keyboard.press("c")
    looker.settle(None)
    assert np.array_equal(looker.canvas(), own), "the scene's camera is another"
    before = page.locator("#probes li").count()
    page.mouse.move(5, 5)
    page.keyboard.press("Enter")
    looker.wait(f"document.querySelectorAll('#probes li').length === {before + 1}")
    page.locator("#probes li button").last.focus()
    page.keyboard.press("Enter")
    looker.wait(f"document.querySelectorAll('#probes li').length === {before}")


def check_choices(looker: Looker) -> None:
    """Materials, apparent temperature, and another map change the picture."""
    page = looker.page
    seen = [looker.canvas()]
    for control, value in (("#quantity", "material"), ("#quantity", "apparent"), ("#map", "viridis")):
        page.select_option(control, value)
        looker.settle(None)
        seen.append(looker.canvas())
        assert np.any(seen[-1] != seen[-2]), f"{value} changes nothing"
        if value == "apparent":
            page.mouse.move(*looker.at(SIZE[0] // 2, SIZE[1] // 2))
            assert "apparent" in page.locator("#readout").inner_text()
    page.select_option("#quantity", "temperature")
    page.select_option("#map", "inferno")
    looker.settle(None)


def take_pictures(browser: Browser, address: str, folder: Path, step: int) -> None:
    """Pictures of the page at a step, dark and light."""
    for scheme in ("dark", "light"):
        context = browser.new_context(viewport=WINDOW, color_scheme=scheme)
        looker = Looker(context, address)
        page = looker.page
        looker.seek(step)
        page.locator("#picture").focus()
        for key in ["+"] * 2:
            page.keyboard.press(key)
        looker.settle(None)
        page.locator("#picture").blur()
        page.mouse.move(470, 350)
        page.wait_for_timeout(300)
        page.screenshot(path=folder / ("view.png" if scheme == "dark" else "view_light.png"))
        for ink in ("--ink", "--faint", "--accent"):
            for paper in ("--panel", "--paper"):
                contrast = _contrast(page, ink, paper)
                assert contrast >= 4.5, f"{scheme}: {ink} on {paper} has a contrast of {contrast:.1f}"
        assert not looker.wrong, looker.wrong
        context.close()
