#!/usr/bin/env python3
"""Opens the live page in a headless Chromium: what it does, and how fast.

    python3 scripts/check_live.py target/live [--speed results/speed/live_page.csv] [--shots FOLDER]

Needs playwright and pillow (pip) and a Chromium: playwright's own (`playwright install chromium`), or one whose path is in CHROMIUM. The
page is served from here; software rendering will do. Checked on a desk (1280 x 800) and on a telephone (390 x 844):

- each task is played, the scene is not empty, and the console stays silent;
- a force on the held arm moves it by what the stiffness says, within 10 %, and a drag of the mouse pulls it;
- sliders, step, pause, reset and an address do what they say;
- a wrong address, a browser without WebGL 2 or without WebAssembly: one sentence each, and the page does not freeze.

`--speed` measures each task at 1280 x 800 and writes a table: simulated seconds and pictures per second on this machine as busy as it
is; then simulated seconds and pictures per second of processor time, all of the browser's processes taken together, and the share of
one core that real time with 30 pictures per second takes by these. The last columns leave out the rasterizer, which a graphics card
takes over: processor time of the page's main thread per picture (script, layout, handing over what is to be drawn), and the share of
one core that the simulation and 30 of these take.
"""

import argparse
import csv
import functools
import http.server
import io
import os
import threading
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright
from whole_file import whole_file

SIZES = [(1280, 800), (390, 844)]
# Each task, and a space in which its script does it.
TASKS = {"lift": "aforce", "door": "aforce", "wipe": "aforce-force", "insert": "mid"}
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
# Time limit of every wait for the page (ms).
PATIENCE = 60_000


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


def serve(folder):
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=folder))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return f"http://127.0.0.1:{server.server_port}/"


class Live:
    """The page in a browser."""

    def __init__(self, browser, address, wanted="", size=SIZES[0], before=None, alive=True):
        self.messages = []
        width, height = size
        self.page = browser.new_page(viewport={"width": width, "height": height}, color_scheme="light")
        self.page.set_default_timeout(PATIENCE)
        self.page.on("console", lambda message: self.messages.append(message.text))
        self.page.on("pageerror", lambda error: self.messages.append(str(error)))
        self.page.on("request", lambda request: request.url.startswith((address, "data:")) or self.messages.append(request.url))
        if before:
            self.page.add_init_script(before)
        self.counter = self.page.context.new_cdp_session(self.page)
        self.counter.send("Performance.enable", {"timeDomain": "threadTicks"})
        self.page.goto(address + wanted)
        if alive:
            self.wait("() => state && state.time > .1")

    def wait(self, what):
        self.page.wait_for_function(what)

    def ask(self, what):
        return self.page.evaluate(what)

    def main_thread(self):
        """Seconds of processor time that the page's main thread has had so far."""
        metrics = self.counter.send("Performance.getMetrics")["metrics"]
        return next(metric["value"] for metric in metrics if metric["name"] == "TaskDuration")

    def problem(self):
        return self.page.inner_text("#problem")

    def open(self, setup):
        self.ask(f"() => open({{ ...about.setup, knobs: {{}}, ...{setup} }})")
        self.wait("() => state.time < 1000 && scene")

    def close(self):
        assert not self.messages, self.messages
        self.page.close()


def look(live):
    """The picture of the scene."""
    live.ask("() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    return Image.open(io.BytesIO(live.page.locator(".view canvas").screenshot())).convert("RGB")


def is_a_picture(image):
    """Whether the image has many colours, none of which covers most of it."""
    colors = sorted(image.getcolors(image.width * image.height), reverse=True)
    return len(colors) > 500 and colors[0][0] < 0.8 * image.width * image.height


def check_tasks(browser, address, size, shots):
    live = Live(browser, address, size=size)
    assert live.ask("() => document.documentElement.scrollWidth <= innerWidth"), "wider than the window"
    for task, space in TASKS.items():
        live.open(f"{{ task: '{task}', space: '{space}', player: 'script' }}")
        live.wait("() => state.time > .6")
        assert live.problem() == "", live.problem()
        assert is_a_picture(look(live)), f"{task}: nothing to be seen"
        if shots:
            live.page.screenshot(path=shots / f"{task}_{size[0]}.png")
        # The script runs as fast as it can until the task is done.
        done = live.ask(
            "() => { play(false); ask({ do: 'open', setup }); let now; for (let k = 0; k < 500; k++) {"
            " now = ask({ do: 'run', samples: 25 }); if (now.fulfilled) break } return now.fulfilled }"
        )
        assert done, f"{task}: not done in 25 s"
        print(f"{task} at {size[0]} x {size[1]}: played, seen, done at {done:.2f} s")
        live.ask("() => play(true)")
    live.close()


def check_push(browser, address, size, shots):
    live = Live(browser, address, "#task=lift&space=high&player=hold", size)
    for space, stiffness in [("low", 150), ("high", 1500)]:
        live.open(f"{{ space: '{space}', player: 'hold' }}")
        live.ask("() => play(false)")
        moved = live.ask(
            "() => { const rest = ask({ do: 'run', samples: 1 }).tool; ask({ do: 'hold', hand: { force: [0, 12, 0] } });"
            " const now = ask({ do: 'run', samples: 3000 }); ask({ do: 'hold', hand: null }); return now.tool[1] - rest[1] }"
        )
        assert abs(moved * stiffness / 12 - 1) < 0.1, (space, moved)
        print(f"{space} at {size[0]} x {size[1]}: 12 N move the tool by {1000 * moved:.2f} mm, {12000 / stiffness:.2f} mm is what {stiffness} N/m say")
    # The mouse pulls at the hand.
    live.open("{ space: 'low', player: 'hold' }")
    live.ask("() => play(true)")
    live.wait("() => state.time > .3")
    live.page.locator(".view canvas").scroll_into_view_if_needed()
    x, y = live.ask(
        "() => { const b = view.canvas.getBoundingClientRect(), m = view.lens(view.camera(0)), t = add(state.tool, [0, 0, .07]);"
        " const row = i => m[i] * t[0] + m[i + 4] * t[1] + m[i + 8] * t[2] + m[i + 12];"
        " return [b.left + b.width * (1 + row(0) / row(3)) / 2, b.top + b.height * (1 - row(1) / row(3)) / 2] }"
    )
    before = live.ask("() => state.tool")
    mouse = live.page.mouse
    mouse.move(x, y)
    mouse.down()
    assert live.ask("() => grip !== null"), "the mouse does not take the hand"
    mouse.move(x + 40, y, steps=4)
    live.wait("() => state.pull && norm(state.pull.force) > 3")
    live.ask("() => new Promise(done => setTimeout(done, 1500))")
    pulled = live.ask("() => ({ tool: state.tool, force: norm(state.pull.force) })")
    if shots:
        live.page.screenshot(path=shots / f"pull_{size[0]}.png")
    way = sum((a - b) ** 2 for a, b in zip(pulled["tool"], before)) ** 0.5
    assert way > 0.01, way
    mouse.up()
    live.wait("() => state.pull === null")
    print(f"pulled with the mouse at {size[0]} x {size[1]}: {pulled['force']:.1f} N, {1000 * way:.0f} mm")
    live.close()


def check_controls(browser, address):
    live = Live(browser, address, "#task=wipe&space=aforce-force&player=script&seed=7&friction=1.5&k_min=400")
    assert live.problem() == "" and live.ask("() => [setup.task, setup.seed, setup.friction, setup.knobs.k_min]") == ["wipe", 7, 1.5, 400]
    assert live.page.locator("#slider-table").count() == 1, "wipe has a table to raise"
    live.page.click("#play")
    time = live.ask("() => state.time")
    live.ask("() => new Promise(done => setTimeout(done, 400))")
    assert live.ask("() => state.time") == time, "paused"
    live.page.click("#step")
    assert abs(live.ask("() => state.time") - time - 0.05) < 1e-9, "a step is an action"
    live.page.click("#reset")
    assert live.ask("() => state.time") == 0, "reset"
    # The same seed is the same episode.
    run = "() => { ask({ do: 'open', setup }); return JSON.stringify(ask({ do: 'run', samples: 200 }).poses) }"
    assert live.ask(run) == live.ask(run)
    # A new payload begins the episode again; the space's numbers and the delay change while it runs. The address holds all of them.
    live.ask("() => { for (let k = 0; k < 10; k++) advance(25) }")
    turn = "([name, value]) => { const s = byId('slider-' + name); s.value = value; s.oninput(); s.onchange(); return state.time }"
    assert live.page.evaluate(turn, ["delay", 10]) > 0.4 and live.page.evaluate(turn, ["k_min", 0.5]) > 0.4
    assert live.problem() == "" and live.ask("() => setup.delay") == 0.01, live.problem()
    bound = live.ask("() => setup.knobs.k_min")
    live.ask("() => { for (let k = 0; k < 20; k++) advance(25) }")
    assert bound > 900 and live.ask("() => state.stiffness[0]") > bound - 1e-6, bound
    live.page.evaluate(turn, ["payload", 1])
    live.wait("() => setup.payload === 1 && state.time === 0")
    for word in ["payload=1", f"k_min={bound}", "delay=0.01"]:
        assert word in live.page.url, live.page.url
    live.page.select_option("#task", "door")
    live.wait("() => setup.task === 'door'")
    live.page.select_option("#space", "variable")
    live.wait("() => setup.space === 'variable'")
    policies = live.ask("() => about.policies")
    for policy in policies:
        live.open(f"{{ task: '{policy['task']}', space: '{policy['space']}', player: '{policy['run']}' }}")
        assert live.problem() == "", live.problem()
    print(f"controls: pause, step, reset, sliders and choices do what they say; {len(policies)} policies play")
    live.close()


def check_bad_input(browser, address):
    for wanted, words in [
        ("#task=juggle", "There is no task"),
        ("#task=lift&friction=99", "friction = 99 is not between 0 and 3."),
        ("#task=lift&friction=much", "friction = much is no number."),
        ("#seed=-1", "seed = -1 is no whole number"),
        ("#task=lift&space=high&player=study/table-1/lift/aforce/seed_12", "was trained in lift with aforce"),
        ("#task=lift&colour=1", "has no \"colour\" to set"),
    ]:
        live = Live(browser, address, wanted)
        assert words in live.problem(), live.problem()
        assert live.ask("() => setup.task") == "lift"
        live.close()
    without = "() => { delete window.WebAssembly }"
    live = Live(browser, address, before=f"({without})()", alive=False)
    live.wait("() => byId('problem').textContent")
    assert "no WebAssembly" in live.problem()
    live.close()
    without = "HTMLCanvasElement.prototype.getContext = (get => function (kind, ...rest) { return kind === 'webgl2' ? null : get.call(this, kind, ...rest) })(HTMLCanvasElement.prototype.getContext)"
    live = Live(browser, address, before=without)
    assert "no WebGL 2" in live.page.inner_text(".view") and live.ask("() => state.time > 0")
    live.close()
    # After a trap the page shows a sentence, and Reset makes the simulation anew.
    live = Live(browser, address)
    live.ask("() => { engine.wasm = { ...engine.wasm, ask() { throw new WebAssembly.RuntimeError('unreachable') } } }")
    live.wait("() => byId('problem').textContent")
    live.page.click("#reset")
    live.page.click("#play")
    live.wait("() => byId('problem').textContent === '' && state.time > 0")
    live.close()
    print("bad input: one sentence each, and the page goes on")


def processor_time():
    """Seconds of processor time that the browser, and all else below this process, has had so far."""
    parents, times = {}, {}
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = status.read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
        parents[int(status.parent.name)] = int(fields[1])
        times[int(status.parent.name)] = sum(map(int, fields[11:13])) / os.sysconf("SC_CLK_TCK")

    def below(process):
        while process in parents:
            process = parents[process]
            if process == os.getpid():
                return True
        return False

    return sum(time for process, time in times.items() if below(process))


def measure(browser, address, file):
    """One core is enough if a second of simulation and 30 pictures together take less than a second of it."""
    names = ["task", "real_time_factor", "pictures_per_second", "simulated_per_core_second", "pictures_per_core_second", "core_share_at_30"]
    names += ["main_thread_ms_per_picture", "core_share_without_rasterizer"]
    rows = []
    for task in TASKS:
        live = Live(browser, address, f"#task={task}&space=aforce&player=hold")
        pause = "() => new Promise(done => setTimeout(done, 10000))"
        begun = live.ask("() => [state.time, pace.drawn, performance.now()]")
        live.ask(pause)
        ended = live.ask("() => [state.time, pace.drawn, performance.now()]")
        wall = (ended[2] - begun[2]) / 1000
        # The pictures alone, then the simulation alone.
        live.page.click("#play")
        time, drawn, busy = processor_time(), live.ask("() => pace.drawn"), live.main_thread()
        live.ask(pause)
        count = live.ask("() => pace.drawn") - drawn
        pictures, script = count / (processor_time() - time), (live.main_thread() - busy) / count
        time = processor_time()
        live.ask("() => { for (let k = 0; k < 60; k++) ask({ do: 'run', samples: 500 }) }")
        simulated = 60 / (processor_time() - time)
        shares = [1 / simulated + 30 / pictures, 1000 * script, 1 / simulated + 30 * script]
        paces = [(ended[0] - begun[0]) / wall, (ended[1] - begun[1]) / wall, simulated, pictures]
        rows.append([task, *(f"{v:.2f}" for v in paces + shares)])
        print(dict(zip(names, rows[-1])))
        live.close()
    with whole_file(file) as out:
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(names)
        writer.writerows(rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("site", type=Path)
    parser.add_argument("--speed", type=Path)
    parser.add_argument("--shots", type=Path)
    asked = parser.parse_args()
    address = serve(asked.site)
    if asked.shots:
        asked.shots.mkdir(parents=True, exist_ok=True)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=os.environ.get("CHROMIUM"), args=FLAGS)
        if asked.speed:
            return measure(browser, address, asked.speed)
        for size in SIZES:
            check_tasks(browser, address, size, asked.shots)
            check_push(browser, address, size, asked.shots)
        check_controls(browser, address)
        check_bad_input(browser, address)


main()
