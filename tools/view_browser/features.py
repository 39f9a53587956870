"""What the page does beside its picture: ranges, scrubbing, marks, curves, objects, files, paths and the warm-up. Each check has a case that must fail."""

import csv
import io
import re
import shutil
from pathlib import Path

import numpy as np
from playwright.sync_api import Browser, Download

from .page import LATER, SCENE, SIZE, STEP, TOLERANCE, WINDOW, Looker, render
from .program import view

CAUSES = ["Q_sun", "Q_albedo", "Q_planet", "Q_exchange", "Q_conduction", "Q_heater", "Q_stored", "Q_emitted"]
GAIN_TOLERANCE = 0.06
LARGE = ["--size", "1024x768"]


def check_all(looker: Looker, scratch: Path, more: list[str]) -> None:
    """The checks that need no scene of their own."""
    looker.page.keyboard.press("c")
    looker.seek(LATER)
    image = render(LATER, scratch, more)
    _range(looker)
    _bar(looker, image)
    _objects(looker, image)
    _curves(looker)
    _marks(looker, image)
    _developer(looker)
    _files(looker, scratch, more)
    _scrubbing(looker)
    print("view_check: range, bar, objects, curves, marks, files and scrubbing are right")


def _range(looker: Looker) -> None:
    """Ends that are not in order change nothing."""
    page = looker.page
    looker.settle(None)
    before = looker.canvas()
    page.fill("#upper", "100")
    looker.settle(None)
    assert np.array_equal(looker.canvas(), before), "an inverted range changes the colours"
    assert page.is_visible("#out-of-order") and page.get_attribute("#lower", "aria-invalid") == "true"
    page.fill("#lower", "50")
    looker.settle(None)
    assert np.any(looker.canvas() != before), "another range changes nothing"
    assert page.is_hidden("#out-of-order") and page.get_attribute("#lower", "aria-invalid") == "false"
    page.check("#auto")
    looker.settle(None)
    assert np.array_equal(looker.canvas(), before)


def _bar(looker: Looker, image: dict[str, np.ndarray]) -> None:
    """The mark on the bar stands at the value under the pointer."""
    page = looker.page
    ends = [float(page.input_value(name)) for name in ("#lower", "#upper")]
    rows, columns = np.nonzero(image["part"])
    values = image["T"][rows, columns]
    marks = []
    for place in (int(values.argmin()), int(values.argmax())):
        looker.read_out(int(columns[place]), int(rows[place]))
        share = (float(values[place]) - ends[0]) / (ends[1] - ends[0])
        marks.append(float(page.get_attribute("#bar", "data-mark") or "nan"))
        assert abs(marks[-1] - share) < 2e-3, f"the mark stands at {marks[-1]}, not {share}"
    assert marks[1] - marks[0] > 0.1, "other places have the same mark"
    page.mouse.move(*looker.at(1, 1))
    assert page.get_attribute("#bar", "data-mark") == "", "space has a mark"


def _objects(looker: Looker, image: dict[str, np.ndarray]) -> None:
    """A part that is chosen stands out, and the page tells its temperatures."""
    page = looker.page
    plain = looker.canvas()
    craft = image["part"] != 0
    corner = plain[0, 0].astype(int)
    # The order of the parts is that of the tree.
    names = page.locator("#objects > li").first.locator("> ul > li > .item > .name").all_inner_texts()
    chosen = names.index("wing_port") + 1
    page.locator("#objects .name", has_text="wing_port").first.click()
    looker.settle(None)
    shown = looker.canvas()
    others = craft & (image["part"] != chosen)
    assert np.array_equal(shown[craft & ~others], plain[craft & ~others]), "the part that is chosen has other colours"
    dim = np.abs(shown[others].astype(int) - corner).sum() < 0.5 * np.abs(plain[others].astype(int) - corner).sum()
    assert dim, "the other parts are not dim"
    told = [float(number) for number in re.findall(r"([\d.]+) K", page.inner_text("#chosen"))]
    text = re.match(r"([\d.]+) to ([\d.]+) K", page.inner_text("#chosen"))
    assert text and told, page.inner_text("#chosen")
    seen = [float(text[1]), float(text[2])]

    def differs(part: int) -> float:
        values = image["T"][image["part"] == part]
        return max(abs(seen[0] - values.min()), abs(seen[1] - values.max()))

    assert differs(chosen) <= TOLERANCE, f"{seen} K"
    assert differs(names.index("body") + 1) > TOLERANCE, "another part is not told apart"
    page.keyboard.press("Escape")
    looker.settle(None)
    assert np.array_equal(looker.canvas(), plain) and page.is_hidden("#chosen")


def _drawn(looker: Looker, name: str) -> str:
    """What a canvas shows."""
    return looker.page.evaluate(f"document.getElementById('{name}').toDataURL()")


def _curves(looker: Looker) -> None:
    """Curves can be hidden and read."""
    page = looker.page
    page.mouse.move(5, 5)
    before = _drawn(looker, "curves")
    box = page.locator("#probes input").first
    box.uncheck()
    looker.settle(None)
    assert _drawn(looker, "curves") != before and page.get_attribute("#marks", "data-marks") == "", "the curve is not hidden"
    box.check()
    looker.settle(None)
    assert _drawn(looker, "curves") == before
    place = page.locator("#curves").bounding_box()
    assert place is not None
    page.mouse.move(place["x"] + 38, place["y"] + 60)
    looker.settle(None)
    begin = re.match(r"0 s: wing_tip ([\d.]+) K", page.inner_text("#curve-read"))
    assert begin, page.inner_text("#curve-read")
    page.locator("#curves").focus()
    page.keyboard.press("ArrowRight")
    looker.settle(None)
    assert page.inner_text("#curve-read").startswith(f"{STEP:.0f} s: wing_tip"), page.inner_text("#curve-read")
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("Enter")
    looker.settle(0)
    value = page.locator("#probes .value").first.inner_text()
    assert abs(float(value.split()[0]) - float(begin[1])) < 0.011, f"{value}, not {begin[1]}"
    looker.seek(LATER)
    later = page.locator("#probes .value").first.inner_text()
    assert later != value, "another time is not told apart"


def _marks(looker: Looker, image: dict[str, np.ndarray]) -> None:
    """A probe is marked where the craft shows its part, and hollow behind the craft."""
    page = looker.page

    def marks() -> list[str]:
        return [text for text in (page.get_attribute("#marks", "data-marks") or "").split("; ") if text]

    one = re.fullmatch(r"wing_tip at ([\d.]+), ([\d.]+)", marks()[0])
    assert one, marks()
    column, row = int(float(one[1])), int(float(one[2]))
    names = page.locator("#objects > li").first.locator("> ul > li > .item > .name").all_inner_texts()
    part = names.index("wing_starboard") + 1

    def shows(column: int, row: int) -> bool:
        return bool(np.any(image["part"][row - 1 : row + 2, column - 1 : column + 2] == part))

    assert shows(column, row), f"the mark at {column}, {row} is not on its part"
    assert not shows(SIZE[0] // 2, SIZE[1] // 2), "another place is not told apart"
    page.locator("#picture").focus()
    page.mouse.move(5, 5)
    page.keyboard.press("Enter")
    looker.wait("document.querySelectorAll('#probes li').length === 2")
    looker.settle(None)
    assert not any("hidden" in text for text in marks()), marks()
    place = page.locator("#probes .place").last.inner_text()
    assert re.fullmatch(r"-?[\d.]+, -?[\d.]+, -?[\d.]+ m", place), place
    for key in ["ArrowRight"] * 39 + ["ArrowUp"] * 22:
        page.keyboard.press(key)
    looker.settle(None)
    looker.wait("document.querySelector('#probes li:last-child .place').textContent.endsWith('hidden')")
    assert any("body" in text and "hidden" in text for text in marks()), marks()
    page.locator("#probes li button").last.click()
    looker.wait("document.querySelectorAll('#probes li').length === 1")
    page.locator("#picture").focus()
    page.keyboard.press("c")
    looker.settle(None)


def _developer(looker: Looker) -> None:
    """Names of passes stand behind a switch."""
    page = looker.page
    names = page.locator("#passes td:first-child").all_text_contents()
    assert not any(name in page.inner_text("body") for name in names), "names of passes without the switch"
    page.check("#developer")
    looker.settle(None)
    assert all(name in page.inner_text("#passes") for name in names), "no names of passes with the switch"
    assert "packing" in page.inner_text("#speed")
    page.uncheck("#developer")


def _saved(looker: Looker, button: str) -> tuple[Download, bytes]:
    """A file that the page saves."""
    with looker.page.expect_download() as download:
        looker.page.locator(button).focus()
        looker.page.keyboard.press("Enter")
    return download.value, Path(download.value.path()).read_bytes()


def scene_with(folder: Path, *changes: tuple[str, str], name: str = "scene") -> Path:
    """The small satellite with changes, beside its files."""
    text = Path(SCENE).read_text()
    for pattern, replacement in changes:
        text, count = re.subn(pattern, lambda _, new=replacement: new, text, flags=re.MULTILINE | re.DOTALL)
        assert count == 1, f"{pattern} is there {count} times"
    for file in ("cubesat.glb", "materials.toml"):
        shutil.copy(Path(SCENE).parent / file, folder)
    path = folder / f"{name}.toml"
    path.write_text(text)
    return path


def _files(looker: Looker, scratch: Path, more: list[str]) -> None:
    """The picture, the curves, and the camera, with which `isotherm render` draws the same image."""
    page = looker.page
    picture, data = _saved(looker, "#save-picture")
    assert picture.suggested_filename == f"cubesat_{LATER * STEP:.0f}s.png" and data[:4] == b"\x89PNG"
    assert int.from_bytes(data[16:20]) == 2 * SIZE[0], "the picture has another width"
    _, data = _saved(looker, "#save-series")
    rows = list(csv.reader(io.StringIO(data.decode())))
    assert rows[0] == ["time", "probe:wing_tip"] and float(rows[1][0]) == 0.0, rows[:2]
    now = [float(row[1]) for row in rows[1:] if float(row[0]) == LATER * STEP]
    told = float(page.locator("#probes .value").first.inner_text().split()[0])
    assert abs(now[0] - told) < 0.006 and abs(float(rows[1][1]) - told) > 0.1, f"{now} and {told}"
    page.locator("#picture").focus()
    for key in ("ArrowLeft", "ArrowUp", "+"):
        page.keyboard.press(key)
    looker.settle(None)
    _, data = _saved(looker, "#save-camera")
    section = data.decode()
    scene = scene_with(scratch, (r"^\[camera\].*?(?=^\[\[probe)", section + "\n"), name="camera")
    ours, scenes = render(LATER, scratch, more, scene), render(LATER, scratch, more)
    assert looker.difference(ours, ours) <= TOLERANCE, "the camera that was saved sees another image"
    canvas = looker.canvas()
    craft = np.any(canvas != canvas[0, 0], axis=2)
    assert (craft == (ours["part"] != 0)).mean() > 0.999, "the camera that was saved sees another shape"
    assert (craft == (scenes["part"] != 0)).mean() < 0.99, "another camera is not told apart"
    page.keyboard.press("c")
    looker.settle(None)


def _scrubbing(looker: Looker) -> None:
    """The thumb stays where it is dropped, while the clock tells what is shown."""
    looker.seek(0)
    page = looker.page
    end = int(page.get_attribute("#time", "max") or 0)
    page.evaluate(f"window.end = {end}")
    page.evaluate("""(() => {
        window.thumbs = [];
        const slider = document.getElementById('time');
        slider.value = window.end;
        for (const name of ['input', 'change']) slider.dispatchEvent(new Event(name));
        const look = () => {
            const clock = document.getElementById('clock');
            window.thumbs.push([slider.valueAsNumber, Number(clock.dataset.step), clock.textContent]);
            if (window.thumbs.length < 100000) requestAnimationFrame(look);
        };
        look();
    })()""")
    looker.settle(end)
    thumbs = page.evaluate("window.thumbs.splice(0, Infinity)")
    moved = [thumb for thumb, _, _ in thumbs if thumb != end]
    assert not moved, f"the thumb was at {moved}"
    before = [text for _, step, text in thumbs if step < end]
    assert len(before) > 1, "the steps on the way are not told"
    assert all("going to" in text for text in before), before
    looker.seek(LATER)
    page.evaluate("window.thumbs = { push() {}, length: 1e6 }")


def check_scenes(browser: Browser, scratch: Path, more: list[str]) -> None:
    """The checks that need other scenes."""
    _warm_up(browser, scratch, more)
    _path(browser, scratch, more)
    _budget(browser, scratch, more)
    _uncertainty(browser, scratch, more)
    print("view_check: warm-up, the path of the camera, the rate, budgets and the uncertainty are right")


def _warm_up(browser: Browser, scratch: Path, more: list[str]) -> None:
    """The address comes before the warm-up, and the page tells how far it is."""
    scene = scene_with(scratch, (r"warm_up_orbits = 1$", "warm_up_orbits = 500"), name="warm")
    context = browser.new_context(viewport=WINDOW)
    with view(str(scene), *more) as address:
        page = context.new_page()
        page.goto(address)
        page.wait_for_selector("#warm-up:not([hidden])")
        told = []
        for _ in range(3):
            told.append(re.search(r"step (\d+) of (\d+)", page.inner_text("#warm-up-text")))
            page.wait_for_timeout(600)
        steps = [int(text[1]) for text in told if text]
        assert len(steps) > 1 and steps[-1] > steps[0] and told[0] and int(told[0][2]) > 556, steps
        assert page.locator("#speed").inner_text() == "", "an image in the warm-up"
    context.close()
    short = scene_with(scratch, (r"warm_up_orbits = 1$", "warm_up_orbits = 0"), name="cold")
    context = browser.new_context(viewport=WINDOW)
    with view(str(short), *more) as address:
        looker = Looker(context, address)
        assert looker.page.is_hidden("#warm-up"), "a warm-up that is not there"
        assert not looker.wrong, looker.wrong
    context.close()


def _path(browser: Browser, scratch: Path, more: list[str]) -> None:
    """The scene's camera follows its path, and the page says where the path has no pose. A rate that is too high is told."""
    (scratch / "path.csv").write_text("time,x,y,z\n100,1.9,1.3,-1.5\n200,-1.9,1.3,-1.5\n")
    scene = scene_with(
        scratch,
        (r"^draw_every = 10$", "images = { start = 100, stop = 200, rate_hz = 0.1 }"),
        (r'^frame = "body"\nposition = \[1.9, 1.3, -1.5\]', 'path = "path.csv"\nframe = "body"'),
        name="path",
    )
    context = browser.new_context(viewport=WINDOW)
    with view(str(scene), *LARGE, *more) as address:
        looker = Looker(context, address)
        page = looker.page
        assert page.inner_text("#home") == "Scene's camera path" and page.get_attribute("#home", "aria-pressed") == "true"
        assert page.is_visible("#off-path"), "no word of a time without a pose"
        pictures = []
        for step in (10, 20):
            looker.seek(step)
            assert page.is_hidden("#off-path"), "a word of a time with a pose"
            pictures.append(_drawn(looker, "picture"))
        assert pictures[0] != pictures[1], "the camera does not follow its path"
        page.locator("#nearer").click()
        looker.settle(None)
        still = []
        for step in (10, 11):
            looker.seek(step)
            still.append(re.findall(rb"^position = .*$", _saved(looker, "#save-camera")[1], re.MULTILINE))
        assert page.get_attribute("#home", "aria-pressed") == "false" and still[0] == still[1], "a camera of the page follows the path"
        looker.seek(0)
        # The fastest rate but the one without a bound.
        for value, slow in (("239", True), ("2", False)):
            page.locator("#rate").evaluate(f"(e) => {{ e.options[0].value = '{value}'; e.selectedIndex = 0; e.dispatchEvent(new Event('change')); }}")
            page.locator("#play").click()
            page.wait_for_timeout(4500)
            told = page.inner_text("#pace")
            assert ("of 239 steps/s" in told) == slow, f"{value} steps/s: {told}"
            page.locator("#play").click()
            looker.settle(None)
        assert not looker.wrong, looker.wrong
    context.close()


def _budget(browser: Browser, scratch: Path, more: list[str]) -> None:
    """The bars of a pixel's budget are those of the EXR."""
    scene = scene_with(scratch, (r"^\[radiance\]$", "[output]\nbudget = true\nerror = true\n\n[radiance]"), name="budget")
    image = render(LATER, scratch, more, scene)
    context = browser.new_context(viewport=WINDOW)
    with view(str(scene), "--size", f"{SIZE[0]}x{SIZE[1]}", *more) as address:
        looker = Looker(context, address)
        page = looker.page
        looker.seek(LATER)
        rows, columns = np.nonzero(image["part"])
        told, known = [], []
        gains = np.stack([image[cause][rows, columns] for cause in CAUSES])
        # A pixel, and the one whose budget differs most from it.
        first = len(rows) // 4
        for place in (first, int(np.argmax(np.abs(gains - gains[:, first, None]).max(axis=0)))):
            x, y = int(columns[place]), int(rows[place])
            looker.read_out(x, y)
            numbers = re.findall(r"(-?[\d.]+) W/m", page.inner_text(".budget"))
            told.append([float(number) for number in numbers])
            known.append([float(image[cause][y, x]) for cause in CAUSES])
        for one, other in zip(told, known, strict=True):
            assert np.allclose(one, other, rtol=0, atol=GAIN_TOLERANCE), f"{one}, not {other}"
        assert not np.allclose(told[0], known[1], rtol=0, atol=GAIN_TOLERANCE), "another pixel is not told apart"
        page.select_option("#quantity", "Q_emitted")
        looker.settle(None)
        assert page.inner_text("#unit") == "W/m\u00b2"
        assert not looker.wrong, looker.wrong
        page.screenshot(path="target/view/budget.png")
    context.close()


def _uncertainty(browser: Browser, scratch: Path, more: list[str]) -> None:
    """T_sigma and its cause under the pointer are those of the EXR, and the colours of causes those of the legend."""
    asks = "[uncertainty]\n" + "".join(
        f"[[uncertainty.parameter]]\n{one}\n\n"
        for one in ('name = "cells"\nvary = "emissivity"\nmaterial = "cells"\npercent = 5', 'name = "body"\nvary = "absorptivity"\nmaterial = "anodized*"\npercent = 20')
    )
    scene = scene_with(
        scratch, (r"^max_edge = 0.03", "max_edge = 0.15"), (r"^steps = 556", "steps = 60"), (r"^\[radiance\]$", f"{asks}[radiance]"), name="uncertain"
    )
    image = render(LATER, scratch, more, scene)
    context = browser.new_context(viewport=WINDOW)
    with view(str(scene), "--size", f"{SIZE[0]}x{SIZE[1]}", *more) as address:
        looker = Looker(context, address)
        page = looker.page
        looker.seek(LATER)
        page.select_option("#quantity", "cause")
        looker.wait("document.querySelectorAll('#legend li').length === 3")
        looker.settle(LATER)
        names = page.locator("#legend .name").all_inner_texts()
        assert names == ["cells", "body", "no parameter"], names
        swatches = page.locator("#legend .swatch").evaluate_all("all => all.map((one) => getComputedStyle(one).backgroundColor)")
        colours = [[int(number) for number in re.findall(r"\d+", text)] for text in swatches]
        canvas = looker.canvas()
        craft = image["part"] != 0
        for label, colour in enumerate(colours[:2], 1):
            of_label = craft & (image["cause"] == label)
            assert of_label.sum() > 20, f"{names[label - 1]} is the cause of {of_label.sum()} pixels"
            # Borders between parts are darker.
            like = np.all(canvas[:, :, :3] == colour, axis=2)
            assert like[of_label].mean() > 0.8 and like[craft & ~of_label].mean() < 0.05, f"{names[label - 1]} has another colour"
        told = []
        places = [np.argwhere(craft & (image["cause"] == label))[10] for label in (1, 2)]
        for y, x in places:
            looker.read_out(int(x), int(y))
            told.append(re.search(r"\u00b1 ([\d.]+) K by the ranges of parameters, most by (\w+)", page.inner_text("#readout")))
        assert all(told), page.inner_text("#readout")
        for (y, x), text, name in zip(places, told, names[:2], strict=True):
            assert abs(float(text[1]) - image["T_sigma"][y, x]) < 0.006 and text[2] == name, f"{text[0]}, not {image['T_sigma'][y, x]} K by {name}"
        other = image["T_sigma"][tuple(places[1])]
        assert abs(float(told[0][1]) - other) > 0.006, "another pixel is not told apart"
        page.screenshot(path="target/view/cause.png")
        page.select_option("#quantity", "sigma")
        looker.settle(None)
        ends = [float(page.input_value(name)) for name in ("#lower", "#upper")]
        assert ends[0] <= image["T_sigma"][craft].min() and ends[1] >= image["T_sigma"][craft].max() - 0.01, ends
        assert page.is_visible("#bar") and np.any(looker.canvas() != canvas), "the uncertainty has no colours"
        page.screenshot(path="target/view/sigma.png")
        assert not looker.wrong, looker.wrong
    context.close()
