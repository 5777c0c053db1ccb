"""The learning curve of a policy of Stable-Baselines3, for the scripts beside this one."""

import csv
import time

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback
from whole_file import whole_file


class Curve(BaseCallback):
    """After n training actions, for each key n of `starts`, plays an episode with mean actions from each seed in `starts[n]`, and
    writes the means over these episodes as a row of the table `out`. Columns that begin with `training` are means over the training
    actions since the previous row, noise included."""

    def __init__(self, env, starts, out):
        super().__init__()
        self.env, self.starts, self.out, self.rows, self.trained = env, starts, out, [], []

    def _on_step(self):
        info, reward = self.locals["infos"][0], self.locals["rewards"][0]
        self.trained.append((reward, info["energy"], info["penalty"], info["force"]))
        if self.num_timesteps in self.starts:
            self.evaluate(self.starts[self.num_timesteps])
            self.trained.clear()
        return True

    def evaluate(self, seeds):
        minutes = time.process_time() / 60
        played = [self.play(seed) for seed in seeds]
        total, success, energy, force = (round(float(value), 4) for value in np.mean(played, axis=0))
        row = {
            "step": self.num_timesteps, "cpu_min": round(minutes, 3), "return": total, "success": success,
            "energy_per_action_j": energy, "max_force_n": force,
        }
        reward, energy, penalty, force = np.transpose(self.trained)
        training = {"reward": reward.mean(), "energy_j": energy.mean(), "penalty": penalty.mean(), "force_n": force.mean()}
        row |= {f"training_{name}_per_action": round(float(value), 4) for name, value in training.items()}
        self.rows.append(row)
        print(row, flush=True)
        with whole_file(self.out) as file:
            writer = csv.DictWriter(file, row, lineterminator="\n")
            writer.writeheader()
            writer.writerows(self.rows)

    def play(self, seed):
        observation, _ = self.env.reset(seed=seed)
        total, energy, force, actions = 0.0, 0.0, 0.0, 0
        while True:
            action, _ = self.model.predict(observation, deterministic=True)
            observation, reward, terminated, truncated, info = self.env.step(action)
            total, energy, actions = total + reward, energy + info["energy"], actions + 1
            force = max(force, info["force"])
            if terminated or truncated:
                return total, info["is_success"], energy / actions, force
