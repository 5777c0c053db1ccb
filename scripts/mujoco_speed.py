#!/usr/bin/env python3
"""Environment steps per second on one core, measured in turn: our whole step (random `variable` actions with controller, observation,
reward and resets) beside MuJoCo's bare physics (25 `mj_step` of 2 ms and nothing else).

    python3 -m venv VENV && VENV/bin/pip install mujoco==3.17.0
    VENV/bin/python scripts/mujoco_speed.py [--tasks lift,door,wipe] [--steps 1000]

MuJoCo gets our scene (`export_mjcf` of crates/physics) and our actions (`random_torques` of crates/tasks): each starts in the state in
which it started here, and its mean torques act for its 50 ms. `mujoco.rollout` runs the steps in one thread without Python in
between. The fingers' motors, whose forces are not recorded, do nothing; door, cube and table are those of the middle of their
ranges. The joint angles at the ends of the actions are compared with ours, to check that both did the same work. Times mean something
only if nothing else runs.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import mujoco
import numpy as np
from mujoco import rollout
from our_speed import ROOT, compare, ours

SUBSTEPS = 25


def example(package, name, *arguments):
    command = ["cargo", "run", "--quiet", "--release", "-p", package, "--example", name, "--", *map(str, arguments)]
    subprocess.run(command, cwd=ROOT, check=True)


class Replay:
    """Recorded actions of a task, to be run in MuJoCo."""

    def __init__(self, task, steps):
        with tempfile.TemporaryDirectory() as folder:
            example("physics", "export_mjcf", task, "robosuite", folder)
            example("tasks", "random_torques", task, steps, Path(folder) / "actions.csv")
            self.model = mujoco.MjModel.from_xml_path(str(Path(folder) / f"{task}_robosuite.xml"))
            actions = np.loadtxt(Path(folder) / "actions.csv", delimiter=",")
        self.data = mujoco.MjData(self.model)
        self.state = np.pad(actions[:, 7:], [(0, 0), (1, 0)])  # the time comes first
        size = mujoco.mj_stateSize(self.model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        if self.state.shape[1] != size:
            sys.exit(f"a state of {task} has {self.state.shape[1] - 1} numbers, the exported scene's {size - 1}")
        self.control = np.zeros((steps, 1, self.model.nu))
        self.control[:, 0, :7] = actions[:, :7]
        ends, _ = self.run()
        distance = np.abs(ends[:-1, -1, 1:8] - self.state[1:, 1:8]).max(axis=1)
        if np.median(distance) > 0.02:
            sys.exit(f"half of the actions of {task} end more than {np.median(distance):.3f} rad from ours")

    def run(self):
        return rollout.rollout(self.model, self.data, self.state, self.control, nstep=SUBSTEPS)

    def speed(self):
        start = time.perf_counter()
        self.run()
        return len(self.state) / (time.perf_counter() - start)


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--tasks", default="lift,door,wipe")
    parser.add_argument("--steps", type=int, default=1000, help="actions replayed per measurement (default 1000)")
    arguments = parser.parse_args()
    print(f"MuJoCo {mujoco.__version__}; environment steps per second, one core")
    for task in arguments.tasks.split(","):
        compare(task, "MuJoCo", Replay(task, arguments.steps).speed, lambda: ours(task, "variable"))


if __name__ == "__main__":
    main()
