#!/usr/bin/env python3
"""Makes the gallery: a page and an animation of each task, and the README.md that links to them.

    python3 scripts/gallery.py target/release results results/gallery

Needs the programs `replay` and `evaluate` in the first folder, and in the second what was kept of the study and of Insert's runs.
Shown are two runs of a task, AFORCE's and `variable`'s: of ten seeds each the one whose energy with
mean actions is the median (of an even number the lower of the two in the middle). They play the
first start of the evaluation in which both do the task. Every number is computed here from the
study's table or from what these two runs do. Insert has only an animation: a policy that feels force beside one that does not.
"""

import csv
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ENERGY = "final_energy_per_action_j"
STARTS = 10
# Length of an animation (s), and how many times faster than real time it may run.
LENGTH, SPEEDS = 3, [1, 1.5, 2, 3, 4]
# Shortest simulated time for which an animation goes on after the task is done (s).
REST = 0.25
FRAMES_PER_SECOND, ACTIONS_PER_SECOND = 10, 20
SECONDS_OF_INSERT = 6

# Title, stage of the study, suffix of the spaces, what to look for.
TASKS = {
    "lift": (
        "Lift",
        "table-1",
        "",
        "Look at the hand as it meets the cube, and at the chart Stiffness: AFORCE comes slowly and softly, variable fast and stiffly.",
    ),
    "door": (
        "Door",
        "prior",
        "",
        "Look at the light handle, which must be turned down first, and at the arrow, the force on the hand.",
    ),
    "wipe": (
        "Wipe",
        "table-1",
        "-force",
        "Look at the dark marks, which turn green once wiped, and at the arrow, the force on the tool.",
    ),
}
ALSO = {
    "door": "Both learned from episodes of the task's script, too.",
    "wipe": "In both spaces the policy also commands the force on the table.",
}


class Runs:
    """The runs of a space in a task, one for each seed, and the typical one of them."""

    def __init__(self, study, stage, task, space):
        self.space = space
        with open(study / "runs.csv", encoding="utf-8") as file:
            keys = {"experiment": stage, "task": task, "space": space, "variant": ""}
            rows = [row for row in csv.DictReader(file) if all(row[k] == v for k, v in keys.items())]
        if not rows:
            sys.exit(f"{study / 'runs.csv'}: no run of {space} in {task} of the stage {stage}")
        rows.sort(key=lambda row: (float(row[ENERGY]), int(row["seed"])))
        self.count = len(rows)
        typical = rows[(len(rows) - 1) // 2]
        self.seed, self.energy = typical["seed"], float(typical[ENERGY])
        self.median = statistics.median(float(row[ENERGY]) for row in rows)
        self.training = statistics.mean(float(row["energy_per_action_j"]) for row in rows)
        self.policy = study / stage / task / space / f"seed_{self.seed}.zip"


def evaluate(programs, policy):
    """What a kept policy does in each of the first starts."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "episodes.csv"
        call(programs / "evaluate", "--run", policy, "--episodes", STARTS, "--csv", file)
        with open(file, encoding="utf-8") as table:
            return list(csv.DictReader(table))


def call(program, *words):
    subprocess.run([str(program), *map(str, words)], check=True, stdout=subprocess.DEVNULL)


def show(programs, study, out, task):
    """Writes page and animation of a task. Returns what the README says about it."""
    title, stage, suffix, look = TASKS[task]
    pair = [Runs(study, stage, task, space + suffix) for space in ("aforce", "variable")]
    tables = [evaluate(programs, run.policy) for run in pair]
    done = [[row["success"] == "true" for row in table] for table in tables]
    both = [start for start in range(STARTS) if all(there[start] for there in done)]
    if not both:
        sys.exit(f"{task}: in none of {STARTS} starts do both do the task")
    start = both[0]
    last = max(float(table[start]["time_to_success_s"]) for table in tables)
    speed = next((s for s in SPEEDS if s * LENGTH >= last + REST), SPEEDS[-1])
    ours, theirs = pair
    typical = (
        f"Why these two: of the {ours.count} seeds of each space they have the median energy with mean actions "
        f"at the end of training. AFORCE's run (seed {ours.seed}) spends {ours.energy:.2f} J per action there "
        f"(median of all {ours.median:.2f}), variable's (seed {theirs.seed}) {theirs.energy:.2f} J ({theirs.median:.2f})."
    )
    noise = (
        f"That variable spends {theirs.training / ours.training:.1f} times AFORCE's energy is said of training, "
        "where noise is added to every action. No noise is played here, so do not look for that factor."
    )
    starts = (
        f"Of the first {STARTS} starts of the evaluation AFORCE's policy does the task in {sum(done[0])} and variable's in "
        f"{sum(done[1])}; shown is start {start}, the first in which both do."
    )
    page, film = out / f"{task}.html", out / f"{task}.gif"
    words = ["--run", ours.policy, "--beside", theirs.policy, "--episode", start]
    notes = [look, f"{typical} {noise}", " ".join([starts, *([ALSO[task]] if task in ALSO else [])])]
    call(programs / "replay", *words, *(word for note in notes for word in ("--note", note)), "--html", page)
    actions, every = LENGTH * speed * ACTIONS_PER_SECOND, speed * ACTIONS_PER_SECOND / FRAMES_PER_SECOND
    film_words = ["--actions", int(actions), "--every", int(every), "--speed", f"{speed:g}", "--width", 320]
    call(programs / "replay", *words, *film_words, "--gif", film)
    pace = "in real time" if speed == 1 else f"at {speed:g} times real time"
    return {
        "task": task,
        "title": title,
        "look": look,
        "pace": pace,
        "energies": " | ".join(f"{run.energy:.2f}, {run.median:.2f}" for run in pair),
        "noise": f"{theirs.training / ours.training:.1f}",
    }


def policies_of_insert(again):
    """The two kept policies that the animation of Insert plays: one that observes the force, one that does not."""
    pair = []
    for group in ("1-mm", "unfelt"):
        pair += sorted((again / "insert" / f"fixed-565,{group}").glob("seed_*.zip"))
    if len(pair) != 2:
        sys.exit(f"{again}: a kept policy each of fixed-565,1-mm and of fixed-565,unfelt is wanted, there are {len(pair)}")
    return pair


def insert(programs, again, out):
    """Writes the animation of Insert. Returns what the README says about it."""
    pair = policies_of_insert(again)
    felt, unfelt = ([row["success"] == "true" for row in evaluate(programs, policy)] for policy in pair)
    start = next((start for start in range(STARTS) if felt[start] and not unfelt[start]), None)
    if start is None:
        sys.exit(f"{again}: in none of {STARTS} starts does `felt` insert and `unfelt` not")
    actions = SECONDS_OF_INSERT * ACTIONS_PER_SECOND
    words = ["--run", pair[0], "--beside", pair[1], "--episode", start, "--actions", actions, "--every", 2, "--width", 320]
    call(programs / "replay", *words, "--gif", out / "insert.gif")
    return INSERT.format(starts=STARTS, felt=sum(felt), unfelt=sum(unfelt), start=start)


PLAYED = (
    "In Lift, Door and Wipe two learned policies play from the same start. In AFORCE a law adapts the stiffness, in variable the "
    "policy commands it. They play mean actions, without the noise of training."
)

README = """# Gallery

{played}

Each page is one file that needs no network: download it and open it in a browser. It loops until two seconds after the task is
done.

In these tasks each run shown has the median energy of ten seeds (the lower of the middle two). J per action with mean actions:

| task | AFORCE: shown, median of ten | variable: shown, median of ten |
|---|---|---|
{rows}
In training, with noise, variable spends {noise} times AFORCE's energy. That noise is not played here.

{films}
{insert}
`make gallery GALLERY=results/gallery` makes this again.
"""


INSERT = """Insert, in real time. Both policies have a constant stiffness of 565 N/m. The left one feels force and torque, the right one does not. Of the first {starts} starts of the evaluation the left one
inserts the peg in {felt}, the right one in {unfelt}. Shown is start {start}, the first in which only the left one does. The arrow is the force on the hand. [All runs](../insert/README.md).

![Insert](insert.gif)
"""


def main():
    if len(sys.argv) != 4:
        sys.exit("usage: gallery.py PROGRAMS RESULTS OUT")
    programs, results, out = map(Path, sys.argv[1:])
    out.mkdir(parents=True, exist_ok=True)
    shown = [show(programs, results / "study", out, task) for task in TASKS]
    rows = "".join("| [{title}]({task}.html) | {energies} |\n".format(**one) for one in shown)
    films = "".join("{title}, {pace}. {look}\n\n![{title}]({task}.gif)\n\n".format(**one) for one in shown)
    noise = ", ".join("{noise} ({title})".format(**one) for one in shown)
    text = README.format(played=PLAYED, rows=rows, films=films.rstrip("\n") + "\n", insert=insert(programs, results / "insert" / "again", out), noise=noise)
    (out / "README.md").write_text(text, encoding="utf-8")
    if '-dirty"' in (out / "lift.html").read_text(encoding="utf-8"):
        print(f"{out}: made by programs with changes that no commit has: commit them, and make it again")


if __name__ == "__main__":
    main()
