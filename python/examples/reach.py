"""The hand reaches a point above the table."""

import numpy as np

import aforce


class Reach(aforce.Task):
    gripper = False  # It is there and observed, but no action moves it.
    achievement = "reaches the point"
    scaling = {"target_to_eef": (0, 0.2)}
    units = {"target_to_eef": "m, world"}

    def reset(self, rng):
        self.target = rng.uniform([-0.1, -0.2, 0.9], [0.1, 0.2, 1.1])

    def distance(self, state):
        return np.linalg.norm(self.target - state.tool.position)

    def observe(self, state):
        return {"target_to_eef": self.target - state.tool.position}

    def reward(self, state):
        return {"near": 1 - np.tanh(10 * self.distance(state))}

    def success(self, state):
        return self.distance(state) < 0.02

    def script(self, state):
        return {"position": self.target}

    def marks(self):
        return [(self.target[0], self.target[1], 0.8, 0.02)]
