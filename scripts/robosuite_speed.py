#!/usr/bin/env python3
"""Environment steps per second on one core, robosuite's and ours, measured in turn: random `variable_kp` actions, resets included.

    python3 -m venv VENV && VENV/bin/pip install robosuite==1.4.1 mujoco==3.2.7
    VENV/bin/python scripts/robosuite_speed.py [--tasks lift,door,wipe] [--steps 1000]

Needs cargo; without a GPU or a display. Ours is the criterion bench `step/TASK/variable` of crates/tasks. robosuite runs without cameras
and renderers, with its soft resets (`hard_reset=False`), which are the fast ones. Times mean something only if nothing else runs.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[threads] = "1"

import numpy as np
import robosuite

ROOT = Path(__file__).resolve().parent.parent


def theirs(task, steps):
    config = robosuite.load_controller_config(default_controller="OSC_POSE") | {"impedance_mode": "variable_kp"}
    env = robosuite.make(
        task.capitalize(), robots="Panda", controller_configs=config, has_renderer=False, has_offscreen_renderer=False,
        use_camera_obs=False, use_object_obs=True, reward_shaping=True, horizon=500, hard_reset=False, ignore_done=False,
    )
    low, high = env.action_spec
    rng = np.random.default_rng(1)
    env.reset()
    start = time.perf_counter()
    for _ in range(steps):
        done = env.step(rng.uniform(low, high))[2]
        if done:
            env.reset()
    return steps / (time.perf_counter() - start)


def ours(task):
    name = f"step/{task}/variable"
    subprocess.run(["cargo", "bench", "--quiet", "-p", "tasks", "--bench", "step", "--", f"^{name}$"], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    # Criterion makes one folder name of an id's slashes after the group's.
    estimates = ROOT / "target" / "criterion" / "step" / f"{task}_variable" / "new" / "estimates.json"
    return 1e9 / json.loads(estimates.read_text())["mean"]["point_estimate"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--tasks", default="lift,door,wipe")
    parser.add_argument("--steps", type=int, default=1000, help="robosuite's steps per measurement (default 1000)")
    arguments = parser.parse_args()
    print(f"robosuite {robosuite.__version__}, Python {sys.version.split()[0]}; environment steps per second, one core")
    for task in arguments.tasks.split(","):
        before, mine, after = theirs(task, arguments.steps), ours(task), theirs(task, arguments.steps)
        ratio = mine / ((before + after) / 2)
        print(f"{task:<5} robosuite {before:.0f} and {after:.0f}, ours {mine:.0f}: {ratio:.1f} times as many")


if __name__ == "__main__":
    main()
