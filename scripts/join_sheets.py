#!/usr/bin/env python3
"""Joins contact sheets below each other into one picture, each with its file's name above it, and removes them:
join_sheets.py OUT.png SHEET.png... The pictures of results/study/watched were made by `replay` and joined so, a picture per stage.
Needs Pillow."""

import sys
from pathlib import Path

from PIL import Image, ImageDraw

CAPTION = 14


def main() -> None:
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    out, sheets = Path(sys.argv[1]), [Path(sheet) for sheet in sys.argv[2:]]
    if out in sheets:
        sys.exit(f"{out} is one of the sheets")
    pictures = [Image.open(sheet).convert("RGB") for sheet in sheets]
    size = max(p.width for p in pictures), sum(p.height + CAPTION for p in pictures)
    joined, top = Image.new("RGB", size, "white"), 0
    for sheet, picture in zip(sheets, pictures):
        ImageDraw.Draw(joined).text((2, top + 1), sheet.stem.replace("_", " "), fill="black")
        joined.paste(picture, (0, top + CAPTION))
        top += picture.height + CAPTION
    joined.quantize(24, dither=Image.Dither.NONE).save(out, optimize=True)
    for sheet in sheets:
        sheet.unlink()


main()
