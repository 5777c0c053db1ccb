"""Energy of the arm and force on it in robosuite, counted as the workbench counts them; for the scripts beside this one."""

import math

import mujoco
import numpy as np

SCENE, LINK, HAND = range(3)
SUSTAINED_HZ = 12.0  # Cut-off of the low-pass behind the workbench's `arm_max_contact_force_n`.


def part(body):
    """Part to which a body of robosuite belongs. The arm's base belongs to the scene, as in the workbench."""
    if body.startswith(("gripper0_", "robot0_right_hand")):
        return HAND
    return LINK if body.startswith("robot0_link") and body != "robot0_link0" else SCENE


class Meter:
    """Measures an episode from its reset on: every control sample of `env` passes through here.

    Energy is the sum of |tau qd| dt over joints and samples, qd the mean of before and after. Force is the sustained force on the whole arm:
    the size of the low-passed force vector on hand and fingers, plus the low-passed sum of the sizes of the forces on the links (12 Hz).
    Contacts of the arm with itself count, except those between hand and fingers.
    """

    def __init__(self, env):
        self._robot, self._sim, self._step = env.robots[0], env.sim, env.sim.step
        self._model, self._data = env.sim.model._model, env.sim.data._data
        self._dt = env.model_timestep
        self._gain = 1.0 - math.exp(-2.0 * math.pi * SUSTAINED_HZ * self._dt)
        names = [self._model.body(body).name for body in self._model.geom_bodyid]
        self._part = np.array([part(name) for name in names])
        self._hand, self._links = np.zeros(3), 0.0
        self._energy, self._largest = 0.0, 0.0
        self._sim.step = self._measured_step

    def take(self):
        """Energy (J) and largest force (N) since the last call: of an action."""
        taken = self._energy, self._largest
        self._energy, self._largest = 0.0, 0.0
        return taken

    def _measured_step(self, *arguments):
        before = self._speeds()
        self._step(*arguments)
        qd = 0.5 * (before + self._speeds())
        self._energy += float(np.abs(self._robot.torques * qd).sum()) * self._dt
        hand, links = self.forces()
        self._hand += self._gain * (hand - self._hand)
        self._links += self._gain * (links - self._links)
        self._largest = max(self._largest, float(np.linalg.norm(self._hand)) + self._links)

    def _speeds(self):
        return self._data.qvel[self._robot._ref_joint_vel_indexes].copy()

    def forces(self):
        """Force on hand and fingers (N, world), and the sum of the sizes of those on the links, in the last step."""
        hand, between = np.zeros(3), {}
        if self._data.ncon:
            pairs = self._data.contact.geom
            parts = self._part[pairs]
            frames = self._data.contact.frame.reshape(-1, 3, 3)
            for k in np.flatnonzero(parts.any(axis=1) & (parts != HAND).any(axis=1)):
                force = np.zeros(6)
                mujoco.mj_contactForce(self._model, self._data, k, force)
                on_second = frames[k].T @ force[:3]
                if HAND in parts[k]:
                    hand += on_second if parts[k][1] == HAND else -on_second
                else:
                    pair = tuple(pairs[k])
                    between[pair] = between.get(pair, 0.0) + on_second
        return hand, float(sum(np.linalg.norm(force) for force in between.values()))
