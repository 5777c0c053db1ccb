#!/usr/bin/env python3
"""The pages of docs/SUMMARY.md as a folder that mdbook can build, and a check of what it built. `make book` calls both.

    python3 scripts/book.py stage     # target/book: the pages, with links as the book needs them and formulas as MathML
    python3 scripts/book.py check     # every link of book/ leads to a file, and to a place in it

A formula stands between dollars, in the part of LaTeX that `Formula` reads. Code hosts render it, and a browser renders the MathML without a
network. A link to a file that is not a page leads to a copy of the file; a link to a folder without a page becomes its text alone.
"""

import html
import os
import re
import shutil
import sys
from html.parser import HTMLParser
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
STAGE = ROOT / "target" / "book"
BOOK = ROOT / "book"
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^()\s]+)\)")
CODE = re.compile(r"(^```.*?^```|`[^`\n]+`|^    .*?$)", re.M | re.S)

GREEK = {name: chr(code) for name, code in [
    ("alpha", 0x3B1), ("beta", 0x3B2), ("gamma", 0x3B3), ("delta", 0x3B4), ("varepsilon", 0x3B5), ("zeta", 0x3B6),
    ("mu", 0x3BC), ("pi", 0x3C0), ("tau", 0x3C4), ("Lambda", 0x39B),
]}
ACCENTS = {"dot": "\u02d9", "ddot": "\u00a8"}
SPACES = {",": "0.17em", "qquad": "2em"}


class Formula:
    """LaTeX to MathML: letters, digits, signs, Greek, _ and ^, frac, sqrt, dot, ddot, min, log, lvert, left and right."""

    def __init__(self, text):
        self.tokens = re.findall(r"\\[A-Za-z]+|\\.|\d+(?:\.\d+)?|[^\s]", text)
        self.place = 0

    def peek(self):
        return self.tokens[self.place] if self.place < len(self.tokens) else None

    def take(self):
        token = self.peek()
        if token is None:
            raise ValueError("a formula ends too early")
        self.place += 1
        return token

    def row(self, end=None):
        parts = []
        while self.peek() != end:
            part, below, above = self.atom(), None, None
            while self.peek() in ("_", "^"):
                if self.take() == "_":
                    below = self.argument()
                else:
                    above = self.argument()
            if below and above:
                part = f"<msubsup>{part}{below}{above}</msubsup>"
            elif below or above:
                kind = "msub" if below else "msup"
                part = f"<{kind}>{part}{below or above}</{kind}>"
            parts.append(part)
        return f"<mrow>{''.join(parts)}</mrow>"

    def argument(self):
        """MathML of one sign or of a pair of braces. A word in braces is one identifier."""
        if self.peek() != "{":
            return self.atom()
        self.take()
        start = self.place
        row = self.row("}")
        letters = self.tokens[start:self.place]
        self.take()
        return f"<mi>{''.join(letters)}</mi>" if all(len(t) == 1 and t.isalpha() for t in letters) else row

    def atom(self):
        token = self.take()
        name = token[1:]
        if not token.startswith("\\"):
            kind = "mn" if token[0].isdigit() else "mi" if token.isalpha() else "mo"
            fixed = ' stretchy="false"' if token in "()" else ""
            return f"<{kind}{fixed}>{html.escape({'-': '−'}.get(token, token))}</{kind}>"
        if name in GREEK:
            return f"<mi>{GREEK[name]}</mi>"
        if name in ("min", "log"):
            return f"<mi>{name}</mi>"
        if name in SPACES:
            return f'<mspace width="{SPACES[name]}"/>'
        if name in ("lvert", "rvert"):
            return f'<mo form="{"prefix" if name == "lvert" else "postfix"}" stretchy="false">|</mo>'
        if name in ("left", "right"):
            return f"<mo>{self.take()}</mo>"
        if name in ACCENTS:
            return f'<mover accent="true">{self.argument()}<mo>{ACCENTS[name]}</mo></mover>'
        if name == "sqrt":
            return f"<msqrt>{self.argument()}</msqrt>"
        if name == "frac":
            return f"<mfrac>{self.argument()}{self.argument()}</mfrac>"
        raise ValueError(f"{token} is not known to scripts/book.py")


def math(text):
    def block(match):
        return f'<math display="block">{Formula(match[1]).row()}</math>'

    text = re.sub(r"\$\$(.+?)\$\$", block, text, flags=re.S)
    return re.sub(r"\$(?=\S)([^$\n]+?)(?<=\S)\$", lambda match: f"<math>{Formula(match[1]).row()}</math>", text)


def place(path):
    """Where a page of the repository stands in the book."""
    return path.with_name("index.md") if path.name == "README.md" else path


def relative(path, folder):
    return Path(os.path.relpath(path, folder)).as_posix()


def stage():
    """Writes every page of the summary, then the pages that they link to, which are listed at the end."""
    summary = ROOT / "docs" / "SUMMARY.md"
    listed = [Path(os.path.normpath(Path("docs") / match[3])) for match in LINK.finditer(summary.read_text())]
    chapters, waiting = list(listed), list(listed)
    shutil.rmtree(STAGE, ignore_errors=True)
    while waiting:
        page = waiting.pop()
        found = []
        write(page, convert(page, (ROOT / page).read_text(), chapters, found))
        new = sorted(set(found) - set(chapters))
        chapters += new
        waiting += new
    text = convert(Path("docs/SUMMARY.md"), summary.read_text(), chapters, [], Path("."))
    further = sorted(set(chapters) - set(listed))
    text += "\n# Further pages\n\n" + "".join(f"- [{page.with_suffix('').as_posix()}]({place(page).as_posix()})\n" for page in further)
    write(Path("SUMMARY.md"), text)


def write(page, text):
    target = STAGE / place(page)
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(text)


def convert(page, text, chapters, found, folder=None):
    """The text of a page as it stands in `folder`. Pages that it links to are added to `found`; files that are not pages are copied."""
    folder = page.parent if folder is None else folder

    def link(match):
        picture, words, target = match.groups()
        path, _, anchor = target.partition("#")
        if "://" in target or not path:
            return match[0]
        path = Path(os.path.normpath(page.parent / path))
        if path / "README.md" in chapters:
            path = path / "README.md"
        if path == Path("docs/SUMMARY.md"):
            return words
        if not (ROOT / path).exists():
            sys.exit(f"{page}: it links to {target}, which is not there")
        if (ROOT / path).is_dir():
            return words
        if path.suffix == ".md":
            found.append(path)
        else:
            copy(path)
        to = relative(place(path), folder) + ("#" + anchor if anchor else "")
        return f"{picture}[{words}]({to})"

    parts = CODE.split(text)
    for at in range(0, len(parts), 2):
        parts[at] = math(parts[at]) if page.parent == Path("docs") else parts[at]
    # Links may have code in their words, so they are converted in the whole text except in blocks of code.
    blocks = re.split(r"(^```.*?^```)", "".join(parts), flags=re.M | re.S)
    blocks[::2] = [LINK.sub(link, block) for block in blocks[::2]]
    return "".join(blocks)


def copy(path):
    target = STAGE / path
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(ROOT / path, target)


class Page(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.links, self.places = [], set()
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name == "id" and value:
                self.places.add(value)
            elif name in ("href", "src") and value and tag in ("a", "img"):
                self.links.append(value)


def check():
    files = [path for path in BOOK.rglob("*.html") if path.name not in ("print.html", "404.html", "toc.html")]
    pages = {path: Page(path.read_text()) for path in files if (STAGE / path.relative_to(BOOK)).with_suffix(".md").exists()}
    broken = []
    for path, page in pages.items():
        for link in page.links:
            target, _, anchor = link.partition("#")
            if re.match(r"[a-z]+:", link):
                continue
            to = Path(os.path.normpath(path.parent / target)) if target else path
            if not to.exists() or (anchor and to in pages and anchor not in pages[to].places):
                broken.append(f"{path.relative_to(BOOK)}: {link}")
    if broken:
        sys.exit("links of the book that lead nowhere:\n" + "\n".join(broken))
    print(f"{len(pages)} pages, every link leads somewhere: {BOOK / 'index.html'}")


if __name__ == "__main__":
    doing = {"stage": stage, "check": check}.get(sys.argv[1]) if len(sys.argv) == 2 else None
    doing() if doing else sys.exit(__doc__)
