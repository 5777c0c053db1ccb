#!/usr/bin/env python3
"""The licences of everything that is linked into the wheel, as one text: third_party.py FILE."""

import json
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
NAMES = ("LICENSE", "LICENCE", "COPYING", "UNLICENSE", "NOTICE")


def linked():
    """The packages that the wheel links, each once."""
    command = ["cargo", "metadata", "--format-version=1", "--locked", f"--manifest-path={HERE / 'Cargo.toml'}"]
    command += ["--filter-platform=x86_64-unknown-linux-gnu"]
    metadata = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    packages = {package["id"]: package for package in metadata["packages"]}
    nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
    found, to_see = {}, [metadata["resolve"]["root"]]
    while to_see:
        package = packages[to_see.pop()]
        is_macro = any("proc-macro" in target["kind"] for target in package["targets"])
        if package["id"] in found or is_macro:
            continue
        found[package["id"]] = package
        for dependency in nodes[package["id"]]["deps"]:
            if any(kind["kind"] is None for kind in dependency["dep_kinds"]):
                to_see.append(dependency["pkg"])
    # Packages of this repository, which have no source, are left out: their licence lies beside this text.
    return sorted((package for package in found.values() if package["source"]), key=lambda package: package["name"])


def texts(package):
    """The licence files in the package's folder. Some packages have none: then the licence's standard text with the package's authors."""
    folder = Path(package["manifest_path"]).parent
    files = sorted(file for file in folder.iterdir() if file.is_file() and file.name.upper().startswith(NAMES))
    # MIT's licence is chosen where a package offers it.
    chosen = [file for file in files if "MIT" in file.name.upper()] or files
    if not chosen:
        return [standard(package)]
    return [file.read_text(errors="replace").strip() for file in chosen]


def standard(package):
    licence = package["license"] or ""
    if "MIT" in licence:
        text = (HERE.parent / "LICENSE-MIT").read_text().strip()
        ours = next(line for line in text.splitlines() if line.startswith("Copyright"))
        authors = ", ".join(package["authors"]) or f"the authors of {package['name']}"
        return text.replace(ours, f"Copyright (c) {authors}")
    if "Apache-2.0" in licence:
        return (HERE.parent / "LICENSE-APACHE").read_text().strip()
    sys.exit(f"{package['name']}: no text of its licence ({licence}) lies beside it")


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    target = sys.argv[1]
    users = {}
    lines = ["What is linked into this package, and under which licence.", ""]
    for package in linked():
        name = f"{package['name']} {package['version']}"
        lines.append(f"{name}: {package['license']}, {package['repository'] or package['homepage'] or 'crates.io'}")
        for text in texts(package):
            users.setdefault(text, []).append(name)
    for text, names in users.items():
        lines += ["", "=" * 80, ", ".join(names), "", text]
    Path(target).write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
