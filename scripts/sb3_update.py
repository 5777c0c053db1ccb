#!/usr/bin/env python3
"""CPU time of one SAC update on one core: ours, Stable-Baselines3's and sbx's (JAX), in alternating rounds at the sizes of Lift.

    python3 -m venv VENV && VENV/bin/pip install stable-baselines3==2.9.2 torch==2.11.0 sbx-rl==0.28.0 'jax[cpu]==0.10.2'
    taskset -c 0 VENV/bin/python scripts/sb3_update.py --csv results/speed/update_cost.csv

Needs cargo. Ours is the bench `update` of crates/sac; the time of its matrix products alone stands beside it. sbx is
measured with one update per call, and with ten, for which its users have to ask. The least of the rounds counts, as
other work on the machine only ever adds time. Every row has a batch of 128; `swift` is ours alone: its actor moves at
every second update.
"""

import argparse
import csv
import json
import os
import platform
import subprocess
import sys
import time

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"

import gymnasium as gym
import jax
import numpy as np
import sbx
import stable_baselines3
import torch
from our_speed import ROOT
from stable_baselines3.common.logger import Logger
from whole_file import whole_file

OBSERVATIONS, ACTIONS, BATCH, UPDATES = 42, 7, 128, 100
SIZES = {"128x2": [128, 128], "256x2": [256, 256]}
COLUMNS = ["size", "who", "update_ms", "rounds", "updates_per_round", "cpu"]


class Sizes(gym.Env):
    """An environment with spaces of the right sizes, which is never stepped."""

    observation_space = gym.spaces.Box(-1, 1, (OBSERVATIONS,), np.float32)
    action_space = gym.spaces.Box(-1, 1, (ACTIONS,), np.float32)


def learner(library, layers):
    options = {"device": "cpu"} if library is stable_baselines3 else {}
    model = library.SAC("MlpPolicy", Sizes(), seed=1, batch_size=BATCH, buffer_size=20_000, policy_kwargs={"net_arch": layers}, **options)
    model.set_logger(Logger(None, []))
    rng = np.random.default_rng(1)
    for _ in range(20_000):
        see, act = rng.uniform(-1, 1, (2, 1, OBSERVATIONS)).astype(np.float32), rng.uniform(-1, 1, (1, ACTIONS))
        model.replay_buffer.add(see[0], see[1], act, rng.uniform(-1, 1, 1), np.array([False]), [{}])
    return model


def theirs(library, layers, per_call):
    """Returns a function that measures one round (ms of CPU per update)."""
    model = learner(library, layers)

    def train():
        for _ in range(UPDATES // per_call):
            model.train(per_call, BATCH) if library is stable_baselines3 else sbx_train(model, per_call)

    train()

    def measure():
        began = time.process_time()
        train()
        return 1e3 * (time.process_time() - began) / UPDATES

    return measure


def sbx_train(model, updates):
    model.train(updates, BATCH)
    # JAX returns before it has computed.
    jax.block_until_ready(model.policy.actor_state.params)


def bench():
    """Builds the bench of crates/sac. Returns the path of its program."""
    command = ["cargo", "bench", "--quiet", "--no-run", "-p", "sac", "--bench", "update", "--message-format", "json"]
    output = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout
    messages = [json.loads(line) for line in output.splitlines()]
    return next(m["executable"] for m in messages if m.get("executable") and m["target"]["name"] == "update")


def cpu_model():
    with open("/proc/cpuinfo") as info:
        return next((line.split(":", 1)[1].strip() for line in info if line.startswith("model name")), platform.processor())


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--csv", help="file to write the table to")
    parser.add_argument("--rounds", type=int, default=12)
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    program = bench()
    measures = {}
    for size, layers in SIZES.items():
        measures[size, f"Stable-Baselines3 {stable_baselines3.__version__}"] = theirs(stable_baselines3, layers, 1)
        measures[size, f"sbx {sbx.__version__}, one update per call"] = theirs(sbx, layers, 1)
        measures[size, f"sbx {sbx.__version__}, ten updates per call"] = theirs(sbx, layers, 10)
    least = {}
    for round_ in range(arguments.rounds):
        times = {key: measure() for key, measure in measures.items()}
        rows = csv.DictReader(subprocess.run([program, "1", "swift", *SIZES], check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines())
        for row in rows:
            times[row["setup"], "ours"] = float(row["update_ms"])
            times[row["setup"], "ours, products alone"] = float(row["products_ms"])
        for key, value in times.items():
            least[key] = min(value, least.get(key, value))
        print(f"round {round_ + 1} of {arguments.rounds}", file=sys.stderr)
    table = sorted(least.items())
    for (size, who), value in table:
        ours = least[size, "ours"]
        print(f"{size:<6} {who:<36} {value:8.3f} ms  {value / ours:5.2f} of ours")
    if arguments.csv:
        with whole_file(arguments.csv) as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(COLUMNS)
            for (size, who), value in table:
                writer.writerow([size, who, f"{value:.3f}", arguments.rounds, 200 if who.startswith("ours") else UPDATES, cpu_model()])


if __name__ == "__main__":
    main()
