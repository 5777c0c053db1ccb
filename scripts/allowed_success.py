#!/usr/bin/env python3
"""How often kept policies do their task before a real arm would have stopped itself: a row per run.

    cargo build --release --bin evaluate
    python3 scripts/allowed_success.py results/study --episodes 30 --episodes-in runs/allowed --out results/study/allowed.csv

Every policy below the folder, in a run folder or kept as seed_N.zip, is played by `evaluate` with mean actions, from the same 30 starts. An
episode ends once the task has stood fulfilled for a second (`env.ends_on_success`), as what the arm does afterwards does not matter here. The
table of every run's episodes stays below --episodes-in, and a run that has one is not played again. Two runs are played at a time.

The first columns say which run it is (`experiment`, `task`, `group`, `seed`), after how many actions its policy was saved
(`policy_of_action`) and how many `episodes` were played. The last column has the commit of the training program (`trained_at`). The others
are shares of the episodes: `success`, the task stood fulfilled after some action; `success_by_hand`, and the hand had touched something by
then; `allowed`, it stood fulfilled before a real arm would have stopped (`success_before_stop`, whose thresholds are those of
`env.protection`); `allowed_speed`, before any joint was faster than its limit, whatever the forces; `allowed_60n`, `allowed_100n`,
`allowed_200n`, the same with at most this sustained force on the whole arm. `stopped_by_...`: why the arm would have stopped in the
episodes that are not `allowed`.
"""

import argparse
import concurrent.futures
import csv
import json
import subprocess
import sys
import zipfile
from pathlib import Path

from whole_file import whole_file

REASONS = ("joint-speed", "hand-force", "link-force", "self-contact")


def play(program, run, table, episodes):
    """Plays a run's kept policy, unless its table is there."""
    if table.exists():
        return
    table.parent.mkdir(parents=True, exist_ok=True)
    command = [program, "--run", run, "--episodes", str(episodes), "--set", "env.ends_on_success=true", "--csv", table]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"{run}: {done.stderr.strip()}")


def summary(run, table, episodes, root):
    """The row of a run."""
    kept = zipfile.Path(run) if run.suffix == ".zip" else run
    manifest = json.loads((kept / "manifest.json").read_text())
    with open(table, encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    if len(rows) != episodes:
        raise SystemExit(f"{table}: {len(rows)} episodes, not {episodes}; remove it to play the run again")
    share = lambda holds: sum(map(holds, rows)) / len(rows)
    true = lambda row, column: row[column] == "true"
    below = lambda row, column, limit: row[column] != "" and float(row[column]) <= limit
    fast = lambda row: below(row, "max_joint_speed_share_to_success", 1.0)
    place = run.relative_to(root)
    cells = {
        "experiment": "/".join(place.parts[:-3]),
        "task": place.parts[-3],
        "group": place.parts[-2],
        "seed": int(place.stem.removeprefix("seed_")),
        "policy_of_action": rows[0]["step"],
        "episodes": len(rows),
        "success": share(lambda row: true(row, "success_any")),
        "success_by_hand": share(lambda row: true(row, "success_any") and not true(row, "success_without_hand")),
        "allowed": share(lambda row: true(row, "success_before_stop")),
        "allowed_speed": share(fast),
    }
    for limit in (60, 100, 200):
        cells[f"allowed_{limit}n"] = share(lambda row: fast(row) and below(row, "max_force_to_success_n", limit))
    for reason in REASONS:
        stopped = lambda row: not true(row, "success_before_stop") and row["stop_reason"] == reason
        cells[f"stopped_by_{reason.replace('-', '_')}"] = share(stopped)
    return cells | {"trained_at": manifest["commit"]}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("root", type=Path, help="folder below which the runs lie")
    parser.add_argument("--episodes", type=int, default=30)
    parser.add_argument("--episodes-in", type=Path, required=True, help="folder for a table of episodes per run")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--program", type=Path, default=Path("target/release/evaluate"))
    arguments = parser.parse_args()
    if not arguments.program.exists():
        sys.exit(f"{arguments.program}: not built; cargo build --release --bin evaluate")
    folders = [weights.parents[2] for weights in arguments.root.glob("**/checkpoints/best/actor.safetensors")]
    runs = [*folders, *arguments.root.glob("**/seed_*.zip")]
    if not runs:
        sys.exit(f"{arguments.root}: no policy below it (checkpoints/best/actor.safetensors or seed_N.zip)")
    runs.sort(key=lambda run: (run.parent, int(run.stem.removeprefix("seed_"))))
    tables = [arguments.episodes_in / run.relative_to(arguments.root).with_suffix(".csv") for run in runs]
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        played = [pool.submit(play, arguments.program, run, table, arguments.episodes) for run, table in zip(runs, tables)]
        for done, future in enumerate(played, 1):
            future.result()
            print(f"\r{done} of {len(runs)} runs", end="", flush=True)
    print()
    rows = [summary(run, table, arguments.episodes, arguments.root) for run, table in zip(runs, tables)]
    with whole_file(arguments.out) as file:
        writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows({key: round(cell, 4) if isinstance(cell, float) else cell for key, cell in row.items()} for row in rows)
    print(f"written: {arguments.out}")


if __name__ == "__main__":
    main()
