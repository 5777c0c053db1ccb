#!/usr/bin/env python3
"""Environment steps per second on one core, robosuite's and ours, measured in turn: random `variable_kp` actions, resets included,
and the wiping tool pressed on the table by a constant OSC action, 2 cm down.

    python3 -m venv VENV && VENV/bin/pip install robosuite==1.4.1 mujoco==3.2.7
    VENV/bin/python scripts/robosuite_speed.py [--tasks lift,door,wipe] [--steps 1000] [--csv FILE]

Needs cargo; without a GPU or a display. Ours are the criterion benches `step/TASK/variable` and `step/wipe/pressing` of crates/tasks.
robosuite runs without cameras and renderers, with its soft resets (`hard_reset=False`), which are the fast ones. Times mean something only
if nothing else runs.
"""

import argparse
import csv
import os
import sys
import time

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[threads] = "1"

import numpy as np
import robosuite
from our_speed import compare, ours
from whole_file import whole_file


def make(task, ignore_done=False, **settings):
    config = robosuite.load_controller_config(default_controller="OSC_POSE") | settings
    return robosuite.make(
        task.capitalize(), robots="Panda", controller_configs=config, has_renderer=False, has_offscreen_renderer=False,
        use_camera_obs=False, use_object_obs=True, reward_shaping=True, horizon=500, hard_reset=False, ignore_done=ignore_done,
    )


def theirs(task, steps):
    env = make(task, impedance_mode="variable_kp")
    low, high = env.action_spec
    rng = np.random.default_rng(1)
    env.reset()
    env.step(rng.uniform(low, high))  # The first step compiles parts of robosuite.
    start = time.perf_counter()
    for _ in range(steps):
        done = env.step(rng.uniform(low, high))[2]
        if done:
            env.reset()
    return steps / (time.perf_counter() - start)


def theirs_pressing(steps):
    env = make("wipe", ignore_done=True)
    action = np.array([0, 0, -0.02 / 0.05, 0, 0, 0])
    env.reset()
    for _ in range(100):
        env.step(action)
    start = time.perf_counter()
    for _ in range(steps):
        env.step(action)
    seconds = time.perf_counter() - start
    force = np.linalg.norm(env.robots[0].ee_force)
    assert force > 10, f"the tool presses with {force} N"
    return steps / seconds


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--tasks", default="lift,door,wipe")
    parser.add_argument("--steps", type=int, default=1000, help="robosuite's steps per measurement (default 1000)")
    parser.add_argument("--csv", help="where to write the table")
    arguments = parser.parse_args()
    print(f"robosuite {robosuite.__version__}, Python {sys.version.split()[0]}; environment steps per second, one core, load {os.getloadavg()[0]:.1f}")
    tasks = arguments.tasks.split(",")
    name = f"robosuite {robosuite.__version__}"
    rows = [compare(task, name, lambda: theirs(task, arguments.steps), lambda: ours(task, "variable")) for task in tasks]
    if "wipe" in tasks:
        rows.append(compare("wipe, pressing", name, lambda: theirs_pressing(arguments.steps), lambda: ours("wipe", "pressing")))
    if arguments.csv:
        with whole_file(arguments.csv) as file:
            table = csv.DictWriter(file, rows[0])
            table.writeheader()
            table.writerows(rows)


if __name__ == "__main__":
    main()
