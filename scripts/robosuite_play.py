#!/usr/bin/env python3
"""Policies learned in the workbench, played in robosuite 1.4.1 and in the workbench: as many episodes in each, nothing is learned anew.

    make wheel && python3 -m venv VENV
    VENV/bin/pip install target/wheels/aforce-*.whl robosuite==1.4.1 mujoco==3.2.7
    VENV/bin/python scripts/robosuite_play.py --out runs/robosuite/transfer.csv results/study/table-1/lift/aforce/seed_*

A row for each episode and simulator. The law is this repository's in both, with the settings of the run; starts are
each simulator's own, drawn from the same distributions. Actions are mean actions. Energy and force are counted alike
(robosuite_meter.py). The return consists of robosuite's reward terms in both: it lacks Door's force penalty and has
Wipe's. robosuite's Wipe reads that force once per action. It counts a marker as wiped without pressure, but only where
the tool's face is below the marker; in the workbench the face may be up to 2 mm above it. With --raise-markers 0.002
robosuite alone plays, and its markers, also those that a policy observes, lie that far above the table. robosuite's
arm never stops itself, so the arm of a run with env.stops does not stop in the workbench either. A run whose
observation or disturbance robosuite does not have is refused.
"""

import argparse
import csv
from pathlib import Path

from robosuite_random import HORIZON, make  # First: it sets the number of threads.

import aforce
import aforce.robosuite
import numpy as np
from robosuite_meter import Meter
from whole_file import whole_file

# Keys of `env.controller` in a run's configuration that robosuite sets itself.
RATES = ("policy_hz", "control_hz")
TASKS = ("lift", "door", "wipe")


class Here:
    """The environment in which a policy was trained."""

    name = "here"

    def __init__(self, policy):
        self._env = policy.make(stops=False)  # robosuite's arm never stops itself.
        self._without = {"penalty"} if policy.task == "door" else set()

    def reset(self, start):
        return self._env.reset(seed=start)[0]

    def step(self, action):
        """Observation, reward as robosuite's, success, energy (J), largest force (N)."""
        observation, _, _, _, info = self._env.step(action)
        reward = sum(value for term, value in info["reward_terms"].items() if term not in self._without)
        return observation, reward, info["is_success"], info["energy"], info["force"]


class Robosuite:
    """The same task in robosuite, with the law and the settings that a policy was trained with."""

    name = "robosuite"

    def __init__(self, policy, raised=0.0):
        self._raised = raised  # Height of Wipe's markers above the table (m).
        if raised:
            self.name = f"robosuite, markers {1000 * raised:g} mm higher"
        description = policy.make().unwrapped.describe()
        settings, parts = description["env"], description["observation"]
        law = {key: value for key, value in settings["controller"].items() if key not in RATES}
        self._env = make(policy.task, {"type": "AFORCE", "space": settings["space"]} | law)
        self._scaled, self._limit = policy.scaled, description["scaled_limit"]
        self._centre, self._scale = (np.array([part[key] for part in parts]) for key in ("centre", "scale"))
        names = [part["name"] for part in parts]
        self._quaternion = slice(names.index("eef_quat_x"), names.index("eef_quat_w") + 1)
        self._first_sign = names.index("eef_quat_x")

    def reset(self, start):
        np.random.seed(start)  # robosuite draws placements from the global generator.
        observation = self._env.reset()
        if self._raised:
            model = self._env.sim.model
            for marker in self._env.model.mujoco_arena.markers:
                model.body_pos[model.body_name2id(marker.root_body)][2] += self._raised
            self._env.sim.forward()
            observation = self._env._get_observations(force_update=True)
        self._meter = Meter(self._env)
        return self._observed(observation)

    def step(self, action):
        observation, reward, _, _ = self._env.step(action)
        return self._observed(observation), reward, bool(self._env._check_success()), *self._meter.take()

    def _observed(self, observation):
        values = np.concatenate([observation["object-state"], observation["robot0_proprio-state"]])
        if values[self._first_sign] < 0:  # robosuite leaves the quaternion's sign to chance.
            values[self._quaternion] *= -1
        if self._scaled:
            values = np.clip((values - self._centre) * self._scale, -self._limit, self._limit)
        return values.astype(np.float32)


def play(policy, simulator, start, actions):
    """Plays an episode. Returns its columns in the table."""
    observation, rewards, energies, forces, successes = simulator.reset(start), [], [], [], []
    for _ in range(actions):
        observation, reward, success, energy, force = simulator.step(policy.predict(observation)[0].astype(float))
        for values, value in ((rewards, reward), (successes, success), (energies, energy), (forces, force)):
            values.append(value)
    seconds = (successes.index(True) + 1) / 20 if any(successes) else None
    return {
        "success_any": int(any(successes)), "success": int(successes[-1]),
        "time_to_success_s": "" if seconds is None else f"{seconds:.2f}",
        "return": f"{sum(rewards):.2f}", "energy_per_action_j": f"{np.mean(energies):.4f}",
        "max_force_n": f"{max(forces):.1f}", "length": actions,
    }


def complaint(policy):
    """Why robosuite cannot show a policy what it was trained with; None if it can."""
    if policy.task not in TASKS:
        return f"the task is {policy.task}; wanted are {', '.join(TASKS)}, which robosuite has too"
    env = policy.make().unwrapped.describe()["env"]
    if env["disturbance"]:
        return f"env.disturbance = {env['disturbance']}: robosuite has no disturbances"
    if env["observation"]["controller"]:
        return "env.observation.controller = true: robosuite does not show the controller's state; false is wanted"
    if policy.task == "wipe" and env["observation"]["markers"] != "condensed":
        return f"env.observation.markers = {env['observation']['markers']!r}: robosuite's Wipe shows them \"condensed\" only"
    for key in ("force", "action", "camera"):
        if env["observation"].get(key):
            return f"env.observation.{key}: robosuite shows none to a policy"
    for key, wanted in (("robot", "robosuite"), ("horizon", 500), ("ends_on_success", False)):
        if env[key] != wanted:
            return f"env.{key} = {env[key]}: {wanted} is wanted, as it is in robosuite"
    if env["sensing"]["source"] != "exact":
        return "env.sensing.source: \"exact\" is wanted, as it is in robosuite"
    if (env["controller"]["policy_hz"], env["controller"]["control_hz"]) != (20, 500):
        return "env.controller: policy_hz = 20 and control_hz = 500 are wanted, which are robosuite's"
    return None


def rows(run, checkpoint, starts, actions, raised):
    policy = aforce.Policy.load(run, checkpoint)
    experiment, task, label, seed = run.resolve().with_suffix("").parts[-4:]
    space, _, variant = label.partition(",")
    for simulator in (Robosuite(policy, raised),) if raised else (Robosuite(policy), Here(policy)):
        for start in starts:
            who = {"experiment": experiment, "task": task, "space": space, "variant": variant, "seed": seed.removeprefix("seed_")}
            what = {"checkpoint": policy.checkpoint, "step": policy.step, "simulator": simulator.name, "start": start}
            yield who | what | play(policy, simulator, start, actions)


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("runs", type=Path, nargs="+", metavar="RUN", help="a run folder, or the .zip of a policy that is kept in results")
    parser.add_argument("--checkpoint", choices=("best", "last"), help="of a run folder: best, unless given; a .zip has one")
    parser.add_argument("--episodes", type=int, default=2, help="of each policy in each simulator")
    parser.add_argument("--start", type=int, default=50_000, help="seed of the first episode's start, from which others count on")
    parser.add_argument("--actions", type=int, default=HORIZON, help=f"in an episode, {HORIZON} at most")
    parser.add_argument("--raise-markers", type=float, default=0.0, metavar="M", help="of Wipe in robosuite, above the table (m)")
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    for key, least, most in (("episodes", 1, 10_000), ("start", 0, 10**9), ("actions", 1, HORIZON)):
        if not least <= getattr(arguments, key) <= most:
            parser.error(f"--{key} {getattr(arguments, key)}: allowed are {least} to {most}")
    if not 0 <= arguments.raise_markers <= 0.02:  # Higher ones are never wiped.
        parser.error(f"--raise-markers {arguments.raise_markers}: allowed are 0 to 0.02")
    starts = range(arguments.start, arguments.start + arguments.episodes)
    if arguments.out.exists():
        parser.error(f"{arguments.out} exists: it is not overwritten")
    for run in arguments.runs:
        try:
            policy = aforce.Policy.load(run, arguments.checkpoint)
            reason = complaint(policy)
            if arguments.raise_markers and policy.task != "wipe":
                reason = f"--raise-markers: the task is {policy.task}; wipe is wanted, which has markers"
        except (OSError, ValueError) as error:
            reason = error
        if reason:
            parser.error(f"{run}: {reason}")
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(arguments.out) as file:
        writer = None
        for run in arguments.runs:
            for row in rows(run, arguments.checkpoint, starts, arguments.actions, arguments.raise_markers):
                writer = writer or csv.DictWriter(file, row, lineterminator="\n")
                if file.tell() == 0:
                    writer.writeheader()
                writer.writerow(row)


if __name__ == "__main__":
    main()
