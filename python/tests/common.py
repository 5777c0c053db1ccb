"""Helpers that several tests use."""

import csv
import hashlib
import subprocess
from pathlib import Path

import gymnasium as gym
import numpy as np

import aforce  # noqa: F401, registers the environments

ROOT = Path(__file__).resolve().parents[2]
TASKS = ("Lift", "Door", "Wipe", "Insert")


def make(task="Lift", /, **keywords):
    return gym.make(f"aforce/{task}-v0", **keywords)


def digest(task="Lift", space="aforce", actions=20):
    """Observations and rewards of some random actions, as a hash."""
    env = make(task, space=space)
    env.action_space.seed(1)
    observation, _ = env.reset(seed=3)
    hashed = hashlib.sha256(observation.tobytes())
    for _ in range(actions):
        observation, reward, *_ = env.step(env.action_space.sample())
        hashed.update(observation.tobytes() + np.float64(reward).tobytes())
    return hashed.hexdigest()


def rows(path):
    with open(path, newline="") as file:
        yield from csv.DictReader(file)


def cargo(*arguments, **keywords):
    """What a program of the repository prints."""
    command = ["cargo", *arguments]
    return subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True, **keywords).stdout
