#!/usr/bin/env python3
"""The law of this repository inside robosuite 1.4.1, whose simulator and tasks are none of ours.

    make wheel && python3 -m venv VENV
    VENV/bin/pip install target/wheels/aforce-*.whl robosuite==1.4.1 mujoco==3.2.7 stable-baselines3==2.9.2
    VENV/bin/python scripts/robosuite_law.py random --out runs/robosuite/random.csv [--episodes 30]
    VENV/bin/python scripts/robosuite_law.py learn --space aforce --seed 1 --out runs/robosuite/aforce_1.csv [--steps 150000]
    MUJOCO_GL=egl VENV/bin/python scripts/robosuite_law.py watch --space aforce --policy runs/robosuite/aforce_1.zip --out sheet.png

`random`: energy and forces of random actions in every task, AFORCE beside robosuite's own variable_kp and fixed OSC, measured as
robosuite_random.py does. `learn`: Stable-Baselines3's SAC on Lift, with one of these spaces and the settings that aforce ships;
observations are scaled as aforce scales its own, which are robosuite's, and actions are [-1, 1] in every space. `watch`: pictures of an
episode with the mean actions of what was learned.
"""

import argparse
from pathlib import Path

from robosuite_random import HORIZON, LIMIT, SPACES, WEIGHT, make, meter, table, write  # First: it sets the number of threads.

import aforce
import aforce.robosuite
import gymnasium as gym
import numpy as np

STEPS = {"paper-steps": (0.05, 0.5), "small-steps": (0.02, 0.15)}


def spaces(setup):
    """Controller configurations by name, in which an action of 1 goes as far as `setup` says."""
    position, rotation = STEPS[setup]
    reach = np.repeat([position, rotation], 3)
    law = {"type": "AFORCE", "space": "aforce", "position_step": position, "rotation_step": rotation}
    return {"aforce": law} | {name: config | {"output_max": reach, "output_min": -reach} for name, config in SPACES.items()}


class Lift(gym.Env):
    """robosuite's Lift for Gymnasium. robosuite draws placements from numpy's global generator, which a reset with a seed restores
    afterwards."""

    def __init__(self, config):
        self._env = make("lift", config)
        self._energy = meter(self._env)
        self._low, self._high = self._env.action_spec
        parts = gym.make("aforce/Lift-v0").unwrapped.describe()["observation"]
        self._centre, self._scale = (np.array([part[key] for part in parts]) for key in ("centre", "scale"))
        self.observation_space = gym.spaces.Box(-10, 10, (len(parts),), np.float32)
        self.action_space = gym.spaces.Box(-1, 1, self._low.shape, np.float32)
        self._elapsed = 0

    def _scaled(self, observation):
        values = np.concatenate([observation["object-state"], observation["robot0_proprio-state"]])
        return np.clip((values - self._centre) * self._scale, -10, 10).astype(np.float32)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self._elapsed = 0
        if seed is None:
            return self._scaled(self._env.reset()), {}
        drawn = np.random.get_state()
        np.random.seed(seed)
        observation = self._scaled(self._env.reset())
        np.random.set_state(drawn)
        return observation, {}

    def step(self, action):
        before = self._energy[0]
        wanted = self._low + 0.5 * (np.clip(action, -1, 1) + 1) * (self._high - self._low)
        observation, reward, _, _ = self._env.step(wanted)
        self._elapsed += 1
        force = float(np.linalg.norm(self._env.robots[0].ee_force))
        penalty = WEIGHT * force if force > LIMIT else 0.0  # Counted, not part of robosuite's reward.
        success = bool(self._env._check_success())
        info = {"is_success": success, "energy": self._energy[0] - before, "force": force, "penalty": penalty}
        return self._scaled(observation), reward, False, self._elapsed >= HORIZON, info


def random(arguments):
    write(arguments.out, table(spaces(arguments.setup), arguments.episodes, arguments.seed))


def learn(arguments):
    import torch
    from sb3_curve import Curve
    from stable_baselines3 import SAC

    torch.set_num_threads(1)
    config = spaces(arguments.setup)[arguments.space]
    starts = {step: range(arguments.episodes) for step in range(arguments.every, arguments.steps + 1, arguments.every)}
    np.random.seed(arguments.seed)
    model = SAC("MlpPolicy", Lift(config), seed=arguments.seed, **aforce.SB3_SAC)
    model.learn(arguments.steps, callback=Curve(Lift(config), starts, arguments.out))
    model.save(arguments.out.with_suffix(".zip"))


def watch(arguments):
    import mujoco
    from PIL import Image
    from stable_baselines3 import SAC

    env, policy = Lift(spaces(arguments.setup)[arguments.space]), SAC.load(arguments.policy, device="cpu")
    observation, _ = env.reset(seed=arguments.seed)
    model, data = env._env.sim.model._model, env._env.sim.data._data
    renderer, camera, seen = mujoco.Renderer(model, 240, 320), mujoco.MjvCamera(), mujoco.MjvOption()
    camera.lookat, camera.distance, camera.azimuth, camera.elevation = [-0.05, 0, 0.95], 1.2, 140, -20
    seen.geomgroup[0] = 0  # Collision shapes would hide the visual ones.
    sheet, total, success = Image.new("RGB", (4 * 320, 3 * 240)), 0.0, False
    pictures = [int((HORIZON - 1) * (n / 11) ** 2) for n in range(12)]  # More pictures early, when the arm moves.
    for action in range(HORIZON):
        if action in pictures:
            n = pictures.index(action)
            renderer.update_scene(data, camera, seen)
            sheet.paste(Image.fromarray(renderer.render()), (n % 4 * 320, n // 4 * 240))
        observation, reward, _, _, info = env.step(policy.predict(observation, deterministic=True)[0])
        total, success = total + reward, info["is_success"]
    sheet.quantize().save(arguments.out)
    print(f"return {total:.1f}, lifted at the end: {success}; pictures after {pictures} actions")


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    kinds = parser.add_subparsers(dest="kind", required=True)
    noise, learner, watcher = kinds.add_parser("random"), kinds.add_parser("learn"), kinds.add_parser("watch")
    noise.add_argument("--episodes", type=int, default=30)
    for kind in (learner, watcher):
        kind.add_argument("--space", choices=spaces("paper-steps"), required=True)
    learner.add_argument("--steps", type=int, default=150_000)
    learner.add_argument("--every", type=int, default=10_000, help="actions between evaluations")
    learner.add_argument("--episodes", type=int, default=10, help="of an evaluation")
    watcher.add_argument("--policy", type=Path, required=True, metavar="ZIP", help="what `learn` left beside its table")
    for kind in (noise, learner, watcher):
        kind.add_argument("--seed", type=int, default=1)
        kind.add_argument("--setup", choices=STEPS, default="paper-steps")
        kind.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    if arguments.kind == "learn" and arguments.every > arguments.steps:
        parser.error(f"--every {arguments.every}: no evaluation in {arguments.steps} steps")
    policy = arguments.out.with_suffix(".zip")
    if policy == arguments.out:
        parser.error(f"{policy}: a policy's name; --out is a table or a picture")
    for path in (arguments.out, policy) if arguments.kind == "learn" else (arguments.out,):
        if path.exists():
            parser.error(f"{path} exists: it is not overwritten")
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    {"random": random, "learn": learn, "watch": watch}[arguments.kind](arguments)


if __name__ == "__main__":
    main()
