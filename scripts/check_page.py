#!/usr/bin/env python3
"""Opens replay pages in a headless Chromium and compares them with the ray caster's pictures.

    python3 scripts/check_page.py target/release/replay

Needs playwright, pillow and numpy (pip) and a Chromium: playwright's own (`playwright install
chromium`), or one whose path is in CHROMIUM. Software rendering will do. Checked for every task,
for two episodes side by side, and for the pages of results/gallery:

- no message in the console, no request beyond the page itself;
- the last moment looks like the program's own PNG of it: same silhouettes, light and shadows;
- scrubbing, playing, turning and the switches each change the picture; how long a moment takes;
- a page of the gallery loops, begins again two seconds after both tasks are done, has the hand in
  sight all the time on a desk and on a phone, and was made at a commit.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy
from PIL import Image
from playwright.sync_api import sync_playwright

ACTIONS = {"lift": 45, "door": 150, "wipe": 80, "insert": 60}
WIDTH, HEIGHT = 800, 600
GALLERY = Path(__file__).parent.parent / "results/gallery"
# Largest share of pixels (DIFFERENT) that may differ by more than LEVELS of 255 in a channel.
LEVELS, DIFFERENT = 24, 0.01


def replay(program, *arguments):
    subprocess.run([program, "--expert", *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)


def difference(a, b):
    """Share of the pixels that differ."""
    return float((numpy.abs(a.astype(int) - b.astype(int)).max(axis=2) > LEVELS).mean())


class Page:
    """A page in a browser, a single view as large as the PNG."""

    def __init__(self, browser, path, folder):
        self.messages, self.folder = [], folder
        self.page = browser.new_page(viewport={"width": WIDTH, "height": 2 * HEIGHT}, color_scheme="light")
        self.page.on("console", lambda message: self.messages.append(message.text))
        self.page.on("pageerror", lambda error: self.messages.append(str(error)))
        self.page.on("request", lambda r: r.url == path.as_uri() or self.messages.append(r.url))
        self.page.goto(path.as_uri())
        # Without `loop` the whole episode can be shown; without `follow` the camera stays where the PNG is taken.
        for switch in ["follow", "loop"]:
            self.page.uncheck(f"#{switch}")
        # The scene alone, as large as the PNG.
        self.page.add_style_tag(
            content=f"#views {{ grid-template-rows: auto {HEIGHT}px }} .view div, #legend {{ display: none }}"
            "#scene { grid-template-columns: minmax(0, 1fr) }"
        )

    def look(self, view=0):
        """The picture in a canvas, once what was changed is drawn."""
        self.page.evaluate("() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
        shot = self.folder / "shot.png"
        self.page.locator(".view canvas").nth(view).screenshot(path=shot)
        return numpy.asarray(Image.open(shot).convert("RGB"))

    def scrub(self, frame):
        self.page.evaluate(
            "value => { const s = document.getElementById('scrub'); s.value = value; s.oninput({ target: s }) }", frame
        )


def check_task(program, browser, folder, task):
    actions = ACTIONS[task]
    page_file, png = folder / f"{task}.html", folder / f"{task}.png"
    for view in ["task", "front", "side", "top"]:
        arguments = ["--task", task, "--actions", actions, "--width", WIDTH, "--view", view]
        replay(program, *arguments, "--png", png, "--html", page_file)
        page = Page(browser, page_file, folder)
        for mark in ["ellipsoid", "goal"]:
            page.page.evaluate("id => document.getElementById(id).checked = false", mark)
        page.page.click(f"#cameras button:text-is('{view.capitalize()}')")
        page.scrub(actions - 1)
        caption = 11 * (HEIGHT // 180)
        drawn, cast = page.look()[caption:], numpy.asarray(Image.open(png))[caption:]
        assert drawn.shape == cast.shape, (drawn.shape, cast.shape)
        page.scrub(0)
        start = page.look()[caption:]
        same, other = difference(drawn, cast), difference(start, cast)
        print(f"{task} {view}: {same:.2%} of the pixels differ from the ray caster's, {other:.2%} of the start's")
        assert same < DIFFERENT < other
        assert not page.messages, page.messages
        page.page.close()


def check_controls(program, browser, folder):
    path = folder / "two.html"
    arguments = ["--task", "wipe", "--space", "aforce-force", "--beside", "variable-force"]
    replay(program, *arguments, "--actions", 80, "--html", path)
    page = Page(browser, path, folder)
    assert page.page.locator(".view canvas").count() == 2
    page.scrub(0)
    pictures = [page.look(0)]

    def changes(what):
        pictures.append(page.look(0))
        assert difference(pictures[-1], pictures[-2]) > 1e-4, f"{what} changes nothing"

    page.scrub(79)
    changes("scrubbing")
    assert difference(pictures[-1], page.look(1)) > 1e-4, "both views show the same"
    for name in ["arrow", "ellipsoid", "goal"]:
        page.page.evaluate("id => { const box = document.getElementById(id); box.checked = false; box.onchange() }", name)
        changes(name)
    box = page.page.locator(".view canvas").nth(1).bounding_box()
    page.page.mouse.move(box["x"] + 50, box["y"] + 150)
    page.page.mouse.down()
    page.page.mouse.move(box["x"] + 150, box["y"] + 180)
    page.page.mouse.up()
    changes("turning the other view")
    page.page.keyboard.down("Control")
    page.page.mouse.wheel(0, -300)
    page.page.keyboard.up("Control")
    changes("the wheel with Ctrl")
    # In slow motion, so that a slow machine does not miss the playing.
    page.page.select_option("#speed", "0.1")
    page.page.click("#play")
    page.page.wait_for_function("() => present > 0 && present < 79")
    changes("playing")
    page.page.keyboard.press("Space")
    assert page.page.inner_text("#play") == "Play", "Space pauses"
    pictures.append(page.look(0))
    plot = page.page.locator(".plot").nth(0)
    plot.scroll_into_view_if_needed()
    plot.click(position={"x": 300, "y": 40})
    changes("a click on a curve")
    assert not page.messages, page.messages
    print("controls: each changes the picture; nothing in the console")
    moments = "const start = performance.now(); for (let k = 0; k < 80; k++) { present = k; draw(0); }"
    milliseconds = page.page.evaluate(f"() => {{ {moments} return (performance.now() - start) / 80; }}")
    print(f"scrubbing: {milliseconds:.1f} ms per moment of both episodes, drawn in software")


def check_gallery(browser, path):
    for width, height in [(1280, 800), (390, 844)]:
        messages = []
        page = browser.new_page(viewport={"width": width, "height": height})
        page.on("console", lambda message: messages.append(message.text))
        page.on("pageerror", lambda error: messages.append(str(error)))
        page.goto(path.as_uri())
        loop, firsts, rate = page.evaluate("() => [loopEnd, firsts, rate]")
        assert loop == max(firsts) + 2 * rate, (loop, firsts)
        assert not page.evaluate("() => commit").endswith("-dirty"), f"{path.name}: made at no commit"
        hand = "Array.from({ length: loopEnd + 1 }, (_, k) => views.map(view => view.toolOnScreen(k))).flat(2)"
        farthest = max(map(abs, page.evaluate(f"() => {hand}")))
        assert farthest < 0.9, f"{path.name} at {width} x {height}: the hand is {farthest:.2f} of the way to the edge"
        page.evaluate("() => { present = loopEnd - 1; play(true); }")
        page.wait_for_function("() => playing && present < loopEnd / 2")
        assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth"), "wider than the window"
        assert not messages, messages
        page.close()
        print(f"{path.name} at {width} x {height}: loops over {(loop + 1) / rate:.2f} s, the hand stays within {farthest:.2f}")


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    program = sys.argv[1]
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=os.environ.get("CHROMIUM"),
            args=["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
        )
        for task in ACTIONS:
            check_task(program, browser, Path(folder), task)
        check_controls(program, browser, Path(folder))
        for page in sorted(GALLERY.glob("*.html")):
            check_gallery(browser, page)


main()
