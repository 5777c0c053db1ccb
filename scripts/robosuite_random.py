#!/usr/bin/env python3
"""Random actions in robosuite 1.4.1: the numbers that `baselines random` is compared with.

    python3 -m venv VENV && VENV/bin/pip install robosuite==1.4.1 mujoco==3.2.7
    VENV/bin/python scripts/robosuite_random.py --out runs/robosuite/own.csv [--episodes 30]

Columns have the names of `baselines random`, but not all mean the same. Energy does: it is summed over the 25 control
samples of an action from the limited torque. So do returns, but for the force penalty in them: robosuite's Door has
none, and its Wipe reads the force once per action. `penalised_episode_share`, `penalised_action_share`,
`mean_excess_n` and `penalty` do not mean the same. In this script they go by what the wrist's sensor reads once after
an action, tool's weight and inertia included; in `baselines random` by the largest of 25 filtered samples of the whole
arm. Nearest to `penalised_action_share` of this script is `over_limit_read_once_share` of `baselines random`. Wipe
runs to its horizon: its early terminations are off.
"""

import argparse
import csv
import os
from pathlib import Path

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[threads] = "1"

import numpy as np
import robosuite
from robosuite.environments.manipulation.wipe import DEFAULT_WIPE_CONFIG

HORIZON = 500
LIMIT, WEIGHT = 60.0, 0.05


def osc(impedance_mode):
    return robosuite.load_controller_config(default_controller="OSC_POSE") | {"impedance_mode": impedance_mode}


SPACES = {"variable": osc("variable_kp"), "osc": osc("fixed")}


def make(task, config):
    extra = {"task_config": DEFAULT_WIPE_CONFIG | {"early_terminations": False}} if task == "wipe" else {}
    return robosuite.make(
        task.capitalize(), robots="Panda", controller_configs=config, has_renderer=False, has_offscreen_renderer=False,
        use_camera_obs=False, use_object_obs=True, reward_shaping=True, horizon=HORIZON, **extra,
    )


def meter(env):
    """Adds up the arm's energy over control samples (J), in the array that is returned: sum of |tau qd| dt, and |sum of tau qd| dt."""
    energy, inner = np.zeros(2), env._pre_action

    def pre_action(action, policy_step=False):
        inner(action, policy_step)
        robot = env.robots[0]
        power = robot.torques * env.sim.data.qvel[robot._ref_joint_vel_indexes]
        energy[:] += np.array([np.abs(power).sum(), abs(power.sum())]) * env.model_timestep

    env._pre_action = pre_action
    return energy


def measure(task, space, config, episodes, seed):
    np.random.seed(seed)  # robosuite draws placements from the global generator
    rng, env = np.random.default_rng(seed), make(task, config)
    energy, returns, forces = meter(env), [], []
    low, high = env.action_spec
    for _ in range(episodes):
        env.reset()
        total, readings = 0.0, []
        for _ in range(HORIZON):
            total += env.step(rng.uniform(low, high))[1]
            readings.append(np.linalg.norm(env.robots[0].ee_force))
        returns.append(total)
        forces.append(readings)
    forces = np.array(forces)
    above, actions = forces > LIMIT, episodes * HORIZON
    return {
        "task": task, "space": space, "source": f"robosuite {robosuite.__version__}", "episodes": episodes,
        "return_mean": np.mean(returns), "return_std": np.std(returns, ddof=1),
        "energy_per_action_j": energy[0] / actions, "energy_net_absolute_per_action_j": energy[1] / actions,
        "penalised_episode_share": above.any(axis=1).mean(), "penalised_action_share": above.mean(),
        "mean_excess_n": (forces[above] - LIMIT).mean() if above.any() else 0.0,
        "penalty": (WEIGHT * forces * above).sum() / episodes,
    }


def table(spaces, episodes, seed):
    """A row for each task and controller configuration, by name."""
    rows = []
    for task in ("lift", "door", "wipe"):
        for space, config in spaces.items():
            row = measure(task, space, config, episodes, seed)
            rows.append({key: round(value, 4) if isinstance(value, float) else value for key, value in row.items()})
    return rows


def write(path, rows):
    """A new table: one that exists is not overwritten."""
    with path.open("x", newline="") as file:
        writer = csv.DictWriter(file, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--episodes", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    if arguments.out.exists():
        parser.error(f"{arguments.out} exists: it is not overwritten")
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    write(arguments.out, table(SPACES, arguments.episodes, arguments.seed))


if __name__ == "__main__":
    main()
