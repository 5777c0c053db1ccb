#!/usr/bin/env python3
"""Puts the live page together: target/live with index.html and live.wasm.gz, which the page unpacks itself.

    python3 web/assemble.py target/web/wasm32-unknown-unknown/release/live.wasm target/live

Style and viewer come from the replay page: its style sheet, and the part of its script that draws the scene.
"""

import gzip
import json
import re
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
REPLAY = HERE.parent / "crates/show/assets/replay.html"
PALETTE = HERE.parent / "crates/show/src/palette.rs"
LARGEST = 5_000_000


def once(text, line):
    """Place of a line in the text, in which it must stand once."""
    if text.count(line) != 1:
        sys.exit(f"{REPLAY}: {line!r} stands {text.count(line)} times in it, and once is wanted")
    return text.index(line)


def between(text, first, last):
    """The text from one line to another, the latter excluded."""
    return text[once(text, first) : once(text, last)]


def colors():
    """Colours of the action spaces, as JSON."""
    found = dict(re.findall(r'\("([a-z0-9-]+)", "(#[0-9a-f]{6})"\)', PALETTE.read_text()))
    if "aforce" not in found:
        sys.exit(f"{PALETTE}: no colours of action spaces")
    return json.dumps(found)


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    module, site = Path(sys.argv[1]), Path(sys.argv[2])
    replay = REPLAY.read_text()
    parts = {
        "style": between(replay, ":root {\n  color-scheme", "</style>"),
        "viewer": between(replay, "// ---- Vectors and matrices", "// ---- Curves"),
        "before": between(replay, "const byId", "// Base64 of little-endian f32.") + (HERE / "page/before.js").read_text(),
        "after": (HERE / "page/after.js").read_text().replace("const COLORS = {};", f"const COLORS = {colors()};"),
    }
    # A machine that draws slowly draws fewer pixels; see `detail` in after.js. Every machine draws coarser shapes than the replay page does.
    for found, wanted in [
        ("SHADOW_SIZE = 2048", "SHADOW_SIZE = 1024"),
        ("steps = 40", "steps = 24"),
        ("antialias: true", "antialias: !drawsInSoftware()"),
        ("Math.round(v * devicePixelRatio)", "Math.round(v * devicePixelRatio * (canvas.detail ?? 1))"),
    ]:
        once(parts["viewer"], found)
        parts["viewer"] = parts["viewer"].replace(found, wanted)
    page = (HERE / "page/live.html").read_text()
    for name, text in parts.items():
        page = page.replace("{{" + name + "}}", text)
    site.mkdir(parents=True, exist_ok=True)
    (site / "index.html").write_text(page)
    # mtime=0: the same module is always packed into the same bytes.
    (site / "live.wasm.gz").write_bytes(gzip.compress(module.read_bytes(), mtime=0))
    size = sum(file.stat().st_size for file in site.iterdir())
    if size > LARGEST:
        sys.exit(f"{site}: {size} bytes, and {LARGEST} are wanted at most")
    print(f"{site}: {size / 1e6:.2f} MB; python3 -m http.server --directory {site}")


main()
