"""Whether everybody can use the page and the report: axe-core, the keyboard alone, and a phone. Each check has a case that must fail."""

import os
import subprocess
from importlib.resources import files
from pathlib import Path

from playwright.sync_api import Browser, BrowserContext, Page

from .features import scene_with
from .page import Looker

PHONE = {"width": 390, "height": 844}
DESK = {"width": 1440, "height": 900}
SMALLEST_TARGET = 24
# Everything that a pointer can use, and one item of the tree.
USABLE = "button:enabled, input:enabled, select:enabled, [tabindex='0']"


def violations(page: Page) -> list[str]:
    """The faults that axe-core finds, with the first element of each."""
    page.evaluate((files("axe_playwright_python") / "axe.min.js").read_text())
    found = page.evaluate("axe.run().then((r) => r.violations.map((v) => `${v.id}: ${v.help}: ${v.nodes[0].html}`))")
    passed = page.evaluate("axe.run().then((r) => r.passes.length)")
    assert passed > 10, f"axe-core looked at {passed} rules only"
    return found


def _context(browser: Browser, window: dict[str, int], scheme: str) -> BrowserContext:
    is_phone = window == PHONE
    return browser.new_context(viewport=window, color_scheme=scheme, is_mobile=is_phone, has_touch=is_phone)


def _width(page: Page) -> int:
    return page.evaluate("document.documentElement.scrollWidth")


def check_all(browser: Browser, looker: Looker, address: str) -> None:
    """The page on a desk and on a phone, dark and light."""
    for window in (DESK, PHONE):
        for scheme in ("dark", "light"):
            context = _context(browser, window, scheme)
            one = Looker(context, address)
            page = one.page
            for switch in (False, True):
                page.set_checked("#developer", switch)
                one.settle(None)
                assert (faults := violations(page)) == [], f"{scheme} at {window['width']}: {faults}"
            page.set_checked("#developer", False)
            page.evaluate("scrollTo(0, 0)")
            page.screenshot(path=f"target/view/{window['width']}_{scheme}.png")
            if window == PHONE:
                _phone(one)
            assert not one.wrong, one.wrong
            context.close()
    page = looker.page
    page.evaluate("document.getElementById('nearer').removeAttribute('aria-label'); document.getElementById('nearer').textContent = ''")
    assert any(fault.startswith("button-name") for fault in violations(page)), "axe-core does not see a button without a name"
    page.reload()
    looker.settle(None)
    _keyboard(looker)
    print("view_check: axe-core finds nothing, the keyboard reaches everything, and the page fits a phone")


def _phone(looker: Looker) -> None:
    """Nothing is wider than the screen, and fingers can touch what they use."""
    page = looker.page
    assert _width(page) <= PHONE["width"], f"the page is {_width(page)} px wide"
    for control in page.locator(USABLE).all():
        box = control.bounding_box() if control.is_visible() else None
        if box is None:
            continue
        name = control.evaluate("(e) => e.id || e.outerHTML.slice(0, 80)")
        assert box["x"] >= 0 and box["x"] + box["width"] <= PHONE["width"], f"{name} is outside the screen"
        assert min(box["width"], box["height"]) >= SMALLEST_TARGET, f"{name} is too small for a finger: {box}"
    # A finger turns the craft: the page says so by another camera.
    box = page.locator("#picture").bounding_box()
    assert box is not None
    assert page.get_attribute("#home", "aria-pressed") == "true"
    session = page.context.new_cdp_session(page)
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    for kind, points in (
        ("touchStart", [{"x": x - 20, "y": y}, {"x": x + 20, "y": y}]),
        ("touchMove", [{"x": x - 40, "y": y}, {"x": x + 40, "y": y}]),
        ("touchMove", [{"x": x - 60, "y": y}, {"x": x + 60, "y": y}]),
        ("touchEnd", []),
    ):
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    looker.wait("document.getElementById('home').getAttribute('aria-pressed') === 'false'")
    page.locator("#home").click()
    looker.wait("document.getElementById('home').getAttribute('aria-pressed') === 'true'")
    page.evaluate("document.querySelector('nav').style.width = '700px'")
    assert _width(page) > PHONE["width"], "a page that is too wide is not told apart"
    page.reload()
    looker.settle(None)


def _reached(page: Page) -> tuple[set[str], set[str]]:
    """What can be used, and what the key Tab reaches."""
    name = "(e) => e.id || e.getAttribute('aria-label') || e.textContent.trim()"
    usable = {control.evaluate(name) for control in page.locator(USABLE).all() if control.is_visible()}
    reached: set[str] = set()
    page.evaluate("document.activeElement.blur()")
    for _ in range(3 * len(usable)):
        page.keyboard.press("Tab")
        focused = page.evaluate(f"document.activeElement === document.body ? '' : ({name})(document.activeElement)")
        outline = page.evaluate("(() => { const e = document.activeElement; const s = getComputedStyle(e.matches('[role=treeitem]') ? e.firstChild : e);"
                                " return s.outlineStyle !== 'none' && parseFloat(s.outlineWidth) > 0; })()")
        assert outline or not focused, f"nobody sees that {focused} has the focus"
        reached.add(focused)
    return usable, reached


def _keyboard(looker: Looker) -> None:
    """Tab reaches all that can be used, and the tree answers to arrows."""
    page = looker.page
    usable, reached = _reached(page)
    assert usable <= reached, f"Tab does not reach {usable - reached}"
    page.evaluate("document.getElementById('save-camera').tabIndex = -1")
    usable, reached = _reached(page)
    assert usable - reached == {"save-camera"}, "a control that Tab does not reach is not told apart"
    page.locator("#objects > li").first.focus()
    for key in ("ArrowDown", "ArrowDown", "Enter"):
        page.keyboard.press(key)
    looker.settle(None)
    assert page.locator("#objects [aria-selected=true]").count() == 1 and page.is_visible("#chosen")
    for key in ("Escape", "ArrowLeft", "ArrowLeft", "ArrowLeft", "ArrowLeft"):
        page.keyboard.press(key)
    assert page.get_attribute("#objects > li:first-child", "aria-expanded") == "false"
    page.reload()
    looker.settle(None)


def check_report(browser: Browser, scratch: Path, more: list[str]) -> None:
    """The report of a run on a desk and on a phone."""
    budget = "[output]\nbudget = true\nenergy_balance = true\n\n[radiance]"
    scene = scene_with(scratch, (r"^steps = 556$", "steps = 20"), (r"^\[radiance\]$", budget), name="report")
    folder = scratch / "report"
    subprocess.run([os.environ["ISOTHERM"], "run", str(scene), "-o", str(folder), *more], check=True, capture_output=True)
    for window in (DESK, PHONE):
        context = _context(browser, window, "light")
        page = context.new_page()
        page.goto((folder / "report.html").as_uri())
        assert (faults := violations(page)) == [], f"the report at {window['width']}: {faults}"
        page.screenshot(path=f"target/view/report_{window['width']}.png", full_page=True)
        assert _width(page) <= window["width"], f"the report is {_width(page)} px wide"
        page.evaluate("document.querySelector('h1').style.width = '1600px'")
        assert _width(page) > window["width"], "a report that is too wide is not told apart"
        context.close()
    print("view_check: the report fits a phone, and axe-core finds nothing in it")
