#!/usr/bin/env python3
"""What Python costs per step, and what a vector gains: the least of many short blocks that take turns, so that other work on the machine
counts little.

    make wheel && python3 -m venv VENV && VENV/bin/pip install target/wheels/aforce-*.whl
    VENV/bin/python scripts/python_speed.py [--rounds 60]

A step of 1, 2 and 5 control samples costs a part per sample and a part per step. The second, extrapolated to no sample at all, holds all that
Python costs, and observation, reward and info, which Rust costs too.
"""

import argparse
import os
import time

import aforce  # noqa: F401, registers the environments
import gymnasium as gym
import numpy as np
from gymnasium.utils.performance import benchmark_step

SAMPLES = (1, 2, 5)


def per_step(step, count, clock):
    """Time of a step (us)."""
    start = clock()
    for _ in range(count):
        step()
    return 1e6 * (clock() - start) / count


def interleaved(ways, rounds, count, clock):
    """The least time of a step (us) of each way, by name."""
    least = dict.fromkeys(ways, np.inf)
    for _ in range(rounds):
        for name, (reset, step) in ways.items():
            reset()
            least[name] = min(least[name], per_step(step, count, clock))
    return least


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--rounds", type=int, default=60)
    rounds = parser.parse_args().rounds
    print(f"load {os.getloadavg()[0]:.1f}, {len(os.sched_getaffinity(0))} processors")

    ways = {}
    for samples in SAMPLES:
        env = gym.make("aforce/Lift-v0", controller={"policy_hz": 500 // samples}, horizon=1_000_000)
        env.action_space.seed(1)
        action, reset = env.action_space.sample(), lambda env=env: env.reset(seed=1)
        for name, inner in (("extension", env.unwrapped._native), ("aforce.Env", env.unwrapped), ("gym.make", env)):
            ways[name, samples] = (reset, lambda inner=inner, action=action: inner.step(action))
    least = interleaved(ways, rounds, 50, time.process_time)
    for name in ("extension", "aforce.Env", "gym.make"):
        times = [least[name, samples] for samples in SAMPLES]
        per_sample, rest = np.polyfit(SAMPLES, times, 1)
        print(f"{name:>10}: {', '.join(f'{t:.1f}' for t in times)} us of CPU for {SAMPLES} samples: {per_sample:.1f} each and {rest:.1f}")

    single = gym.make("aforce/Lift-v0")
    print(f"benchmark_step of aforce/Lift-v0: {benchmark_step(single, target_duration=5, seed=1):.0f} steps per second")

    ways = {}
    for count, threads in ((1, 1), (8, 1), (8, 2)):
        envs = gym.make_vec("aforce/Lift-v0", num_envs=count, threads=threads)
        envs.action_space.seed(1)
        actions = envs.action_space.sample()
        ways[count, threads] = (lambda envs=envs: envs.reset(seed=1), lambda envs=envs, actions=actions: envs.step(actions))
    least = interleaved(ways, rounds // 5, 10, time.perf_counter)
    for (count, threads), wall in least.items():
        print(f"vector of {count}, {threads} threads: {count / wall * 1e6:.0f} steps per second, {count * least[1, 1] / wall:.2f} times one")


if __name__ == "__main__":
    main()
