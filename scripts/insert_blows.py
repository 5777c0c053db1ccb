#!/usr/bin/env python3
"""How hard the peg of Insert strikes what is below it, by the hand's speed. Nothing is learned.

Every action lowers the goal by the same share of the step, so the hand comes down at a steady speed. The peg's end meets the block around the
hole in about nine of ten starts, in the others the table beside the block. An episode in which no force exceeds the threshold is left out.

    python3 scripts/insert_blows.py results/insert/blows.csv

Needs the wheel (docs/python.md).
"""

import csv
import statistics
import sys

import aforce
import gymnasium as gym
import numpy as np

ROBOTS = ["robosuite", "identified", "fr3"]
# Stiffness of the space (N/m, Nm/rad), and the step of an action (m).
SET_UPS = [([565, 28], 0.006), ([565, 28], 0.02), ([100, 30], 0.02)]
SHARES = [0.3, 0.5, 0.75, 1.0]
EPISODES = 20
# A sustained force on the hand above this is a blow (N): a slow peg may slide along the chamfer with less.
TOUCH = 1.5


def blow(env, share, seed):
    """Speed (m/s) before the first touch and the largest force (N) on the hand in its action and the next one, or None."""
    observation, _ = env.reset(seed=seed)
    names = [entry["name"] for entry in env.unwrapped.describe()["observation"]]
    down = names.index("eef_vel_z")
    action = np.zeros(env.action_space.shape, np.float32)
    action[2] = -share
    speeds, ended = [], False
    while not ended:
        speeds.append(-float(observation[down]))
        observation, _, terminated, truncated, info = env.step(action)
        ended = terminated or truncated
        if info["hand_force"] > TOUCH and not ended:
            # The force is low-passed: its largest value may come in the next action.
            *_, after = env.step(action)
            return statistics.median(speeds[-4:]), max(info["hand_force"], after["hand_force"])
    return None


def main(file):
    with open(file, "w", newline="") as table:
        writer = csv.writer(table, lineterminator="\n")
        writer.writerow(["robot", "stiffness_n_per_m", "position_step_m", "share_of_step", "blows", "speed_m_per_s", "largest_force_n", "force_per_speed_ns_per_m"])
        for robot in ROBOTS:
            for stiffness, step in SET_UPS:
                space = {"extends": "aforce", "name": "constant", "stiffness": {"fixed": stiffness}}
                env = gym.make(
                    "aforce/Insert-v0",
                    space=space,
                    robot=robot,
                    options={"clearance_mm": 1.0},
                    controller={"position_step": step, "rotation_step": 0.0112},
                )
                for share in SHARES:
                    blows = [found for seed in range(EPISODES) if (found := blow(env, share, seed))]
                    if not blows:
                        continue
                    speeds, forces = zip(*blows)
                    ratios = [force / speed for speed, force in blows]
                    means = [statistics.mean(values) for values in (speeds, forces, ratios)]
                    writer.writerow([robot, stiffness[0], step, share, len(blows), *(f"{mean:.4g}" for mean in means)])


if __name__ == "__main__":
    main(*sys.argv[1:])
