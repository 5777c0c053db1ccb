"""Shared by the scripts that ask MuJoCo about the drag of the air: its torque on each joint in random states."""

import mujoco
import numpy as np


def air_torques(model, data, joints, rng):
    """Ten rows of q, qd, torque of the air, nine numbers each: seven joints of the arm, two of the fingers. Zero beyond the first `joints`."""
    centre, half = model.jnt_range[:joints].mean(axis=1), np.ptp(model.jnt_range[:joints], axis=1) / 2
    for _ in range(10):
        q, qd, tau = np.zeros(9), np.zeros(9), np.zeros(9)
        q[:joints] = np.round(centre + 0.9 * half * rng.uniform(-1, 1, joints), 6)
        qd[:joints] = np.round(np.where(np.arange(joints) < 7, 2.0, 0.1) * rng.uniform(-1, 1, joints), 6)
        data.qpos[:joints], data.qvel[:joints] = q[:joints], qd[:joints]
        mujoco.mj_forward(model, data)
        tau[:joints] = data.qfrc_fluid[:joints]
        yield [*q, *qd, *tau]
