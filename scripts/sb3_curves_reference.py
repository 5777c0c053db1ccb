#!/usr/bin/env python3
"""Regenerate experiments/reference/sb3: what Stable-Baselines3's EvalCallback and Monitor write, in an environment with nothing to learn.

    python3 -m venv VENV && VENV/bin/pip install stable-baselines3==2.9.2
    VENV/bin/python scripts/sb3_curves_reference.py

Read by experiments/src/report/outside.rs. `expected.csv` beside the files has what NumPy reads from evaluations.npz: actions, mean return
and share of successes of each evaluation.
"""

import csv
from pathlib import Path

import gymnasium as gym
import numpy as np
from stable_baselines3 import SAC
from stable_baselines3.common.callbacks import EvalCallback
from stable_baselines3.common.monitor import Monitor
from whole_file import whole_file

OUT = Path(__file__).resolve().parent.parent / "experiments" / "reference" / "sb3"
RUN = OUT / "lift" / "aforce,sb3" / "seed_3"


class Walk(gym.Env):
    """An episode of ten actions. The reward is the action's entry; a success is a sum of rewards above -4."""

    observation_space = gym.spaces.Box(-1.0, 1.0, (2,))
    action_space = gym.spaces.Box(-1.0, 1.0, (1,))

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.left, self.sum = 10, 0.0
        return self.np_random.uniform(-1, 1, 2).astype(np.float32), {}

    def step(self, action):
        self.left -= 1
        self.sum += float(action[0])
        observation = self.np_random.uniform(-1, 1, 2).astype(np.float32)
        return observation, float(action[0]), False, self.left == 0, {"is_success": self.sum > -4.0}


def main():
    RUN.mkdir(parents=True, exist_ok=True)
    learner = SAC("MlpPolicy", Monitor(Walk(), str(RUN / "monitor.csv")), seed=3, learning_starts=50, policy_kwargs={"net_arch": [8]})
    callback = EvalCallback(Monitor(Walk()), n_eval_episodes=2, eval_freq=50, log_path=str(RUN), verbose=0)
    learner.learn(300, callback=callback)
    kept = np.load(RUN / "evaluations.npz")
    with whole_file(OUT / "expected.csv") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["step", "return", "success"])
        for step, returns, successes in zip(kept["timesteps"], kept["results"], kept["successes"]):
            writer.writerow([step, repr(float(returns.mean())), repr(float(successes.mean()))])


if __name__ == "__main__":
    main()
