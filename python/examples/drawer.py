"""The hand grasps the knob of a drawer from above and pulls it open."""

import numpy as np

import aforce

KNOB = [-0.06, 0, 0.07]  # Centre of the knob in the drawer's frame (m).
WALLS = [([0.08, 0.005, 0.04], [0, 0.09, -0.003]), ([0.08, 0.005, 0.04], [0, -0.09, -0.003]), ([0.005, 0.095, 0.04], [0.09, 0, -0.003])]

class Drawer(aforce.Task):
    scene = {"bodies": [
        {"name": "case", "pose": [0, 0, 0.845], "shapes": [{"box": half, "pose": centre} for half, centre in WALLS]},
        {"name": "drawer", "parent": "case", "density": 500,
         "joint": {"slide": [-1, 0, 0], "name": "slide", "range": [0, 0.15], "damping": 5, "friction": 3, "stop": [20_000, 200]},
         "shapes": [{"box": [0.08, 0.08, 0.04]}, {"name": "knob", "box": [0.008, 0.025, 0.03], "pose": KNOB}]},
    ]}
    defaults = {"horizon": 300}
    scaling = {"knob_to_eef": (0, 0.1), "opening": (0.05, 0.05)}
    disturbances = {"slide_friction": {"joint_friction": "slide", "allowed": [0, 10]}}

    def reset(self, rng):
        return {"poses": {"case": [rng.uniform(0, 0.04), rng.uniform(-0.05, 0.05), 0.845, rng.uniform(-0.2, 0.2)]}}

    def observe(self, state):
        return {"knob_to_eef": state.body("drawer").point(KNOB) - state.tool.position, "opening": state.joint("slide")}

    def reward(self, state):
        away = np.linalg.norm(state.body("drawer").point(KNOB) - state.tool.position)
        return {"reach": 0.25 * (1 - np.tanh(10 * away)), "grasp": 0.25 * state.grasped("knob"), "open": 5 * state.joint("slide")}

    def success(self, state):
        return state.joint("slide") > 0.1

    def script(self, state):
        tool, knob, x = state.tool.position, state.body("drawer").point(KNOB), state.body("drawer").rotation[:, 0]
        above = np.linalg.norm((tool - knob)[:2]) < 0.012
        to, grip = (knob, 1 if tool[2] - knob[2] < 0.012 else -1) if above else (knob + [0, 0, 0.09], -1)
        if state.grasped("knob"):
            to, grip = (tool if state.joint("slide") > 0.12 else knob - 0.06 * x), 1
        return {"position": to, "forward": x, "turns": 2, "grip": grip}
