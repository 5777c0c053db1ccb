#!/usr/bin/env python3
"""Which lines of the law and of a host's checks the tests of the crate `aforce` run: results/coverage.csv.

    python3 scripts/law_coverage.py

Needs `cargo install cargo-llvm-cov` and `rustup component add llvm-tools`. A region is a piece of code without a branch, as LLVM counts them:
each side of a branch is one. Unit tests are among the lines. Tests of other packages run more; they are not counted.
"""

import csv
import json
import os
import subprocess
from pathlib import Path

from whole_file import whole_file

ROOT = Path(__file__).resolve().parent.parent
CARGO = os.environ.get("CARGO", "cargo")


def run(*command):
    return subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout


def main():
    commit = run("git", "describe", "--always", "--dirty", "--abbrev=12", "--exclude=*").strip()
    told = json.loads(run(CARGO, "llvm-cov", "-p", "aforce", "--release", "--json", "--summary-only"))
    source = ROOT / "crates/aforce/src"
    with whole_file(ROOT / "results/coverage.csv") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["file", "lines", "lines_run", "regions", "regions_run", "commit"])
        for entry in told["data"][0]["files"]:
            name = Path(entry["filename"]).relative_to(source)
            if name.parts[0] in ("law", "host"):
                lines, regions = entry["summary"]["lines"], entry["summary"]["regions"]
                table.writerow([name, lines["count"], lines["covered"], regions["count"], regions["covered"], commit])


if __name__ == "__main__":
    main()
