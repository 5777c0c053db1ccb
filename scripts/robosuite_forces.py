#!/usr/bin/env python3
"""Regenerate tests/reference/robosuite_forces.csv: how hard an arm presses in robosuite 1.4.1 under actions whose entries are all +1 or -1.

    make wheel && python3 -m venv VENV
    VENV/bin/pip install target/wheels/aforce-*.whl robosuite==1.4.1 mujoco==3.2.7
    VENV/bin/python scripts/robosuite_forces.py

Such actions fold the arm upon itself and wedge it into the scene. The law is this repository's, with robosuite's action steps. The force of
an action is the largest of its control samples, counted as in the workbench (robosuite_meter.py). tests/robosuite_forces.rs plays the same
actions, from starts that it draws itself, and compares quantiles. A row is a task and a space, all seeds together:

    episodes                              one for each seed, from 1000 on
    positive                              entries that are +1, over all holds: whether the test plays the same actions
    q90_n, q99_n, q999_n, max_n           quantiles of 90, 99, 99.9 % and the largest of all actions' forces
    above_1_kn, above_2_kn, above_5_kn    share of the actions
"""

import csv
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from itertools import product
from pathlib import Path

from robosuite_law import STEPS  # First: it sets the number of threads.
from robosuite_random import make

import aforce.robosuite
import mujoco
import numpy as np
import robosuite
from robosuite_meter import Meter
from whole_file import whole_file

FORCES = Path(__file__).resolve().parent.parent / "tests" / "reference" / "robosuite_forces.csv"
HEADER = f"# scripts/robosuite_forces.py; robosuite {robosuite.__version__}, MuJoCo {mujoco.__version__}\n"
TASKS, SPACES = ("lift", "door"), ("aforce", "variable", "osc")
SEEDS, HOLDS, HOLD = range(1000, 1016), 16, 25
WORD = 2**64 - 1


def signs(seed, hold, entries):
    """An action: entry i is +1 where bit i of a word is set. The word is number `seed` * HOLDS + `hold` of splitmix64 from 0."""
    word = (seed * HOLDS + hold + 1) * 0x9E3779B97F4A7C15 & WORD
    word = (word ^ word >> 30) * 0xBF58476D1CE4E5B9 & WORD
    word = (word ^ word >> 27) * 0x94D049BB133111EB & WORD
    word ^= word >> 31
    return np.array([1.0 if word >> entry & 1 else -1.0 for entry in range(entries)])


@cache
def environment(task, space):
    position, rotation = STEPS["paper-steps"]
    return make(task, {"type": "AFORCE", "space": space, "position_step": position, "rotation_step": rotation})


def episode(task, space, seed):
    """Force of each action (N). Observations and rewards of robosuite are not computed: they would take half of the time."""
    env = environment(task, space)
    np.random.seed(seed)  # robosuite draws placements from the global generator.
    env.reset()
    meter, forces = Meter(env), []
    for hold in range(HOLDS):
        action = signs(seed, hold, env.action_dim)
        for _ in range(HOLD):
            for sample in range(round(env.control_timestep / env.model_timestep)):
                env.robots[0].control(action, policy_step=sample == 0)
                env.sim.step()
            forces.append(meter.take()[1])
    return forces


def row(task, space, episodes):
    entries = environment(task, space).action_dim
    positive = sum((signs(seed, hold, entries) > 0).sum() for seed, hold in product(SEEDS, range(HOLDS)))
    forces = np.concatenate(episodes)
    quantiles = {f"q{name}_n": f"{np.quantile(forces, share):.1f}" for name, share in (("90", 0.9), ("99", 0.99), ("999", 0.999))}
    above = {f"above_{limit}_kn": f"{(forces > 1000 * limit).mean():.5f}" for limit in (1, 2, 5)}
    return {"task": task, "space": space, "episodes": len(episodes), "positive": positive} | quantiles | {"max_n": f"{forces.max():.1f}"} | above


def main():
    kinds = list(product(TASKS, SPACES))
    with ProcessPoolExecutor() as pool:
        played = list(pool.map(episode, *zip(*(kind + (seed,) for seed in SEEDS for kind in kinds))))
    rows = [row(*kind, played[n :: len(kinds)]) for n, kind in enumerate(kinds)]
    with whole_file(FORCES) as file:
        file.write(HEADER)
        writer = csv.DictWriter(file, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
