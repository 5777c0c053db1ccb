#!/usr/bin/env python3
"""Time of one SAC update on one core, Stable-Baselines3's and ours, in turn: two layers of 256, a batch of 256, the sizes of Lift.

    python3 -m venv VENV && VENV/bin/pip install stable-baselines3==2.9.2 torch==2.11.0
    taskset -c 0 VENV/bin/python scripts/sb3_update.py

Needs cargo. Ours are the criterion benches `update/desktop, batch 256` of crates/sac and, beside it, the matrix products that an update
cannot do without. Times mean something only if nothing else runs.
"""

import json
import os
import subprocess
import time

os.environ["OMP_NUM_THREADS"] = "1"

import gymnasium as gym
import numpy as np
import torch
from our_speed import ROOT
from stable_baselines3 import SAC
from stable_baselines3.common.logger import Logger

OBSERVATIONS, ACTIONS, BATCH, UPDATES = 42, 7, 256, 300
NAME = "desktop, batch 256"


class Sizes(gym.Env):
    """Spaces of the right sizes; never played."""

    observation_space = gym.spaces.Box(-1, 1, (OBSERVATIONS,), np.float32)
    action_space = gym.spaces.Box(-1, 1, (ACTIONS,), np.float32)


def theirs():
    torch.set_num_threads(1)
    model = SAC("MlpPolicy", Sizes(), seed=1, batch_size=BATCH, buffer_size=20_000, policy_kwargs={"net_arch": [256, 256]}, device="cpu")
    model.set_logger(Logger(None, []))
    rng = np.random.default_rng(1)
    for _ in range(20_000):
        see, act = rng.uniform(-1, 1, (2, 1, OBSERVATIONS)).astype(np.float32), rng.uniform(-1, 1, (1, ACTIONS))
        model.replay_buffer.add(see[0], see[1], act, rng.uniform(-1, 1, 1), np.array([False]), [{}])
    model.train(20, BATCH)
    began = time.perf_counter()
    model.train(UPDATES, BATCH)
    return 1e3 * (time.perf_counter() - began) / UPDATES


def ours(bench):
    subprocess.run(
        ["cargo", "bench", "--quiet", "-p", "sac", "--bench", "update", "--", f"^{bench}$"],
        cwd=ROOT, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )
    estimates = ROOT / "target" / "criterion" / bench / "new" / "estimates.json"
    return 1e-6 * json.loads(estimates.read_text())["mean"]["point_estimate"]


def main():
    before = theirs()
    update, products = ours(f"update/{NAME}"), ours(f"update/matrix products/{NAME}")
    after = theirs()
    print(f"Stable-Baselines3 {before:.2f} and {after:.2f} ms, ours {update:.2f} ms: {(before + after) / 2 / update:.2f} times as fast")
    print(f"matrix products alone {products:.2f} ms: ours takes {update / products:.2f} times that")


if __name__ == "__main__":
    main()
