"""All checks of the page, in order."""

import os
import shutil
import tempfile
from pathlib import Path

from playwright.sync_api import Browser, Playwright, sync_playwright

from . import access, features
from .page import SCENE, SIZE, STATION, STATION_STEP, WINDOW, LATER, Looker, check_choices, check_keys, check_numbers, take_pictures, unnamed
from .program import view

OF_SIZE = ["--size", f"{SIZE[0]}x{SIZE[1]}"]


def _cubesat(browser: Browser, address: str, scratch: Path, more: list[str]) -> None:
    """The page of the small satellite."""
    context = browser.new_context(viewport=WINDOW, color_scheme="dark")
    looker = Looker(context, address)
    assert unnamed(context, looker.page) == [], "controls without a name"
    check_numbers(looker, scratch, more)
    print("view_check: canvas, read-out and scrubbing are right")
    check_keys(looker)
    check_choices(looker)
    print("view_check: keys and choices work")
    features.check_all(looker, scratch, more)
    access.check_all(browser, looker, address)
    other = Looker(context, address)
    # The keys before have let time go on by a number of steps that depends on the machine.
    other.seek(0)
    looker.settle(0)
    other.page.keyboard.press(".")
    step = 1
    for one in (other, looker):
        one.settle(step)
    looker.page.reload()
    looker.settle(step)
    for one in (looker, other):
        assert not one.wrong, one.wrong
        one.page.close()
    again = Looker(context, address)
    again.settle(step)
    context.close()
    print("view_check: reload, two tabs and closing all end nothing")


def _browser(tools: Playwright) -> Browser:
    program = shutil.which(os.environ.get("CHROMIUM", "chromium"))
    return tools.chromium.launch(executable_path=program, args=["--no-sandbox", "--disable-gpu"])


def look(scene: str, folder: Path, more: list[str]) -> None:
    """Opens the page of any scene, reads the middle of its image, adds a probe, makes steps, and leaves pictures of a desk and of a phone."""
    folder.mkdir(parents=True, exist_ok=True)
    with view(scene, *more) as address, sync_playwright() as tools:
        browser = _browser(tools)
        for window in (access.DESK, access.PHONE):
            context = browser.new_context(viewport=window, color_scheme="dark")
            looker = Looker(context, address)
            page = looker.page
            page.locator("#picture").focus()
            looker.settle(None)
            text = page.inner_text("#readout")
            assert " K" in text, f"no craft in the middle of the image: {text}"
            before = page.locator("#probes li").count()
            page.keyboard.press("Enter")
            looker.wait(f"document.querySelectorAll('#probes li').length === {before + 1}")
            step = int(page.get_attribute("#clock", "data-step") or 0)
            page.keyboard.press(".")
            looker.settle(step + 1)
            page.screenshot(path=folder / f"page_{window['width']}.png")
            assert not looker.wrong, looker.wrong
            context.close()
        browser.close()
        print(f"view_check: {' '.join(text.split())} in the middle; pictures are in {folder}")


def check(pictures: Path | None, more: list[str]) -> None:
    """Runs all checks."""
    folder = Path("target/view")
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name, sync_playwright() as tools:
        scratch = Path(name)
        browser = _browser(tools)
        with view(SCENE, *OF_SIZE, *more) as address:
            _cubesat(browser, address, scratch, more)
            take_pictures(browser, address, folder, LATER)
        features.check_scenes(browser, scratch, more)
        access.check_report(browser, scratch, more)
        print(f"view_check: pictures are in {folder}")
        if pictures:
            with view(*STATION, *more) as station:
                take_pictures(browser, station, pictures, STATION_STEP)
        browser.close()
