"""The hand holds a round plug over a socket and puts it in. With a stiffness as low as that of `low` the plug gets stuck."""

import numpy as np

import aforce

DEPTH = 0.025  # Depth of the hole (m). The plug is 5 cm long and 0.5 mm thinner than the hole.

class Plug(aforce.Task):
    scene = {"prediction": 0.002, "bodies": [
        {"name": "socket", "pose": [0, 0, 0.8 + DEPTH],
         "shapes": [{"hole": {"radius": 0.01, "outer": 0.04, "depth": DEPTH, "chamfer": 0.002}, "friction": 0.3}]},
        {"name": "plug", "joint": "free", "pose": [0, 0, 1], "mass": 0.05, "shapes": [{"cylinder": [0.025, 0.00975], "friction": 0.3}]},
    ]}
    achievement = "puts the plug in"
    scaling = {"hole_to_tip": (0, 0.05)}

    def reset(self, rng):
        socket = [*rng.uniform(-0.03, 0.03, 2), 0.8 + DEPTH]
        return {"poses": {"socket": socket}, "holding": {"body": "plug", "grip": [0, 0, 0.015], "width": 0.0195}}

    def tip(self, state):  # Plug's tip relative to the hole's rim (m, world). The plug's frame is in its middle, its z points down in the hand.
        plug = state.body("plug")
        return plug.point([0, 0, 0.025]) - state.body("socket").position

    def observe(self, state):
        return {"hole_to_tip": self.tip(state), "plug": state.body("plug").quaternion}

    def reward(self, state):
        return {"near": 0.5 * (1 - np.tanh(20 * np.linalg.norm(self.tip(state) + [0, 0, DEPTH]))), "in": 0.5 * self.success(state)}

    def success(self, state):
        x, y, z = self.tip(state)
        return bool(np.hypot(x, y) < 0.005 and z < -0.8 * DEPTH)

    def script(self, state):
        x, y, z = self.tip(state)
        down = np.clip(2 * (z + 0.9 * DEPTH), -0.03, 0.03) if np.hypot(x, y) < 0.002 or z < 0 else 0
        return {"position": state.tool.position - [2 * x, 2 * y, down], "forward": [1, 0, 0], "grip": 1}
