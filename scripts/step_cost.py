#!/usr/bin/env python3
"""CPU time of a whole environment step (25 control samples) with random `variable` actions, beside that of MuJoCo's bare physics
for the same scene and torques (25 `mj_step` of 2 ms and nothing else). The share is MuJoCo's time over ours: 1 is MuJoCo's speed.

    python3 -m venv VENV && VENV/bin/pip install mujoco==3.17.0
    VENV/bin/python scripts/step_cost.py [--tasks lift,door,wipe] [--rounds 12] [--actions 300] [--csv FILE]

The two take turns in short blocks, of which the least counts: other work on the machine slows a block and never speeds it up.
`step_time` of crates/tasks measures ours, with resets; `mujoco_speed.py` says what MuJoCo plays.
"""

import argparse
import csv
import os
import subprocess
import time

import mujoco
from mujoco_speed import Replay
from our_speed import ROOT
from whole_file import whole_file


def ours(task, actions):
    """CPU time of one of our steps (us)."""
    command = ["cargo", "run", "--quiet", "--release", "-p", "tasks", "--example", "step_time", "--", task, "variable", str(actions)]
    return float(subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout)


def theirs(replay):
    """CPU time of 25 of MuJoCo's steps (us)."""
    start = time.process_time()
    replay.run()
    return 1e6 * (time.process_time() - start) / len(replay.state)


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--tasks", default="lift,door,wipe")
    parser.add_argument("--rounds", type=int, default=12, help="turns of each side (default 12)")
    parser.add_argument("--actions", type=int, default=300, help="actions per turn (default 300)")
    parser.add_argument("--csv", help="where to write the table")
    arguments = parser.parse_args()
    print(f"MuJoCo {mujoco.__version__}, load {os.getloadavg()[0]:.1f}; us of CPU per step of the environment, least of {arguments.rounds}")
    rows = []
    for task in arguments.tasks.split(","):
        replay = Replay(task, arguments.actions)
        turns = [(ours(task, arguments.actions), theirs(replay)) for _ in range(arguments.rounds)]
        mine, bare = (min(side) for side in zip(*turns))
        rows.append({"task": task, "step_us": f"{mine:.1f}", "mj_step_us": f"{bare:.1f}", "share_of_mj_step": f"{bare / mine:.2f}", "rounds": arguments.rounds, "mujoco": mujoco.__version__})
        print(f"{task:>5}: ours {mine:.0f}, MuJoCo {bare:.0f}: {bare / mine:.2f} of its speed", flush=True)
    if arguments.csv:
        with whole_file(arguments.csv) as file:
            table = csv.DictWriter(file, rows[0])
            table.writeheader()
            table.writerows(rows)


if __name__ == "__main__":
    main()
