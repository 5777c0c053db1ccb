#!/usr/bin/env python3
"""How policies that learned Insert with a hole 1 mm wider than the peg play with FORGE's clearance of 0.114 mm. Nothing is learned.

    python scripts/insert_narrow.py target/release runs/insert/again results/insert/narrow.csv

Plays the last policy of every run of five groups, 100 episodes each with mean actions, from the starts of `end.csv`. A row has the means over a
run's episodes: the share inserted, the time until then (s), the mean force in contact and the largest sustained force (N).
"""

import csv
import os
import statistics
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from whole_file import whole_file

GROUPS = ["fixed-565,2-cm", "fixed-100,2-cm", "fixed-565,1-mm", "aforce-scaled-force,1-mm", "variable,1-mm"]
CLEARANCE_MM = 0.114
EPISODES = 100
HEADER = "space variant seed clearance_mm episodes success time_to_success_s mean_contact_force_n max_contact_force_n".split()


def mean(rows, column):
    """Mean of the cells that are not empty, as text; empty if all are."""
    cells = [float(row[column]) for row in rows if row[column]]
    return f"{statistics.mean(cells):.4g}" if cells else ""


def play(evaluate, run):
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / "episodes.csv"
        words = ["--run", run, "--checkpoint", "last", "--episodes", EPISODES, "--set", f"env.options.clearance_mm={CLEARANCE_MM}", "--csv", table]
        environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        subprocess.run([evaluate, *map(str, words)], check=True, stdout=subprocess.DEVNULL, env=environment)
        with table.open(encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    space, variant = run.parent.name.split(",")
    success = sum(row["success"] == "true" for row in rows) / len(rows)
    means = [mean(rows, column) for column in HEADER[-3:]]
    return [space, variant, run.name.removeprefix("seed_"), CLEARANCE_MM, len(rows), f"{success:.4g}", *means]


def main():
    if len(sys.argv) != 4:
        sys.exit("usage: insert_narrow.py PROGRAMS RUNS OUT.csv")
    programs, runs, out = map(Path, sys.argv[1:])
    found = [run for group in GROUPS for run in sorted((runs / "insert" / group).glob("seed_*"))]
    if not found:
        sys.exit(f"{runs}: no runs of {', '.join(GROUPS)}")
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        rows = list(pool.map(lambda run: play(programs / "evaluate", run), found))
    with whole_file(out) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerows([HEADER, *rows])


if __name__ == "__main__":
    main()
