#!/usr/bin/env python3
"""Stable-Baselines3's SAC on Lift with the settings that aforce ships: a curve per seed.

    make wheel && python3 -m venv VENV && VENV/bin/pip install target/wheels/aforce-*.whl stable-baselines3==2.9.2
    VENV/bin/python scripts/sb3_lift.py --seed 1 --out runs/sb3_lift/seed_1.csv [--steps 150000] [--space aforce]

`--defaults` takes Stable-Baselines3's own settings and observations without scaling instead: the preset `plain` is compared with it.

The set-up is that of `train --task lift --space aforce --setup small-steps`, or with `--like RUN` that of a run of `train`, whose starts
then serve for the evaluations as well: mean actions, every so many actions. A row has the CPU minutes of the whole process when
its evaluation began, earlier evaluations included: `progress.csv` of a run has the same clock.
"""

import argparse
import csv
import os
from pathlib import Path

for threads in ("OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(threads, "1")

import aforce
import gymnasium as gym
import stable_baselines3
import torch
from sb3_curve import Curve


def starts_of(run):
    """Seeds of the episodes of a run's evaluations, by the number of training actions."""
    starts = {}
    with (run / "eval.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            if row["policy"] == "mean":
                starts.setdefault(int(row["step"]), []).append(int(row["episode_seed"], 0))
    return starts


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--steps", type=int, default=150_000)
    parser.add_argument("--space", help="aforce unless said")
    parser.add_argument("--like", type=Path, metavar="RUN", help="a run folder whose environment and starts are taken over")
    parser.add_argument("--defaults", action="store_true", help="Stable-Baselines3's own settings, and observations without scaling")
    parser.add_argument("--every", type=int, help="actions between evaluations, 10000 unless said")
    parser.add_argument("--episodes", type=int, help="of an evaluation, 10 unless said")
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    policy = arguments.out.with_suffix(".zip")
    for path in (arguments.out, policy):
        if path.exists():
            parser.error(f"{path} exists: it is not overwritten")
    if policy == arguments.out:
        parser.error(f"{policy}: the policy's name; the table is a .csv")
    if arguments.like and (arguments.space or arguments.every or arguments.episodes):
        parser.error("--like takes over space and evaluations: --space, --every and --episodes have no effect beside it")
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    torch.set_num_threads(1)
    if arguments.like:
        settings, starts = {"config": arguments.like / "config.toml"}, starts_of(arguments.like)
    else:
        settings = {"space": arguments.space or "aforce", "setup": "small-steps"}
        every, episodes = arguments.every or 10_000, arguments.episodes or 10
        if every > arguments.steps:
            parser.error(f"--every {every}: no evaluation in {arguments.steps} steps")
        starts = {step: range(step, step + episodes) for step in range(every, arguments.steps + 1, every)}
    make = lambda: gym.make("aforce/Lift-v0", scaled=not arguments.defaults, **settings)
    learner = {} if arguments.defaults else aforce.SB3_SAC
    print(f"aforce {aforce.__version__}, stable-baselines3 {stable_baselines3.__version__}, {learner or 'its defaults'}")
    model = stable_baselines3.SAC("MlpPolicy", make(), seed=arguments.seed, **learner)
    model.learn(arguments.steps, callback=Curve(make(), starts, arguments.out))
    model.save(policy)


if __name__ == "__main__":
    main()
