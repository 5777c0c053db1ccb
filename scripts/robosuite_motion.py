#!/usr/bin/env python3
"""Regenerate what robosuite 1.4.1 does in free space: how it moves, how its air brakes, how its joints stop.

    python3 -m venv VENV && VENV/bin/pip install robosuite==1.4.1 mujoco==3.2.7
    VENV/bin/python scripts/robosuite_motion.py

Writes three files. Exits non-zero if the first one is too large to be committed.

    tests/reference/robosuite_motion.csv            40 scenarios of 40 actions in which the arm touches nothing (tests/robosuite_motion.rs)
    crates/physics/reference/robosuite_air.csv      torque of the air on each joint in random states (crates/physics/src/engine/drag.rs)
    crates/physics/reference/robosuite_stops.csv    overshoot and rest of a joint pushed into its stop (crates/physics/tests/stops.rs)

Actions are in [-1, 1] throughout, as the workbench has them: a stiffness entry a stands for kp = 150 (1 + a). A scenario in which the arm
touches something is drawn anew. Poses are those of the grip site after the action.
"""

import csv
import os
import sys
from pathlib import Path

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[threads] = "1"

import mujoco
import numpy as np
import robosuite
from air_torques import air_torques
from whole_file import whole_file

ROOT = Path(__file__).resolve().parent.parent
MOTION = ROOT / "tests" / "reference" / "robosuite_motion.csv"
AIR = ROOT / "crates" / "physics" / "reference" / "robosuite_air.csv"
STOPS = ROOT / "crates" / "physics" / "reference" / "robosuite_stops.csv"
HEADER = f"# robosuite {robosuite.__version__}, MuJoCo {mujoco.__version__}, numpy {np.__version__}; made by scripts/robosuite_motion.py\n"

SEED = 20261123
TASKS = ["lift", "wipe"]
SPACES = {"robosuite-osc": "fixed", "robosuite-variable": "variable_kp"}
ACTIONS, SAMPLE, REPEATS = 40, 8, 2
NOISE = 0.1  # rad, of the joint angles at the start
HOME = np.array([0.0, np.pi / 16, 0.0, -5 * np.pi / 6, 0.0, np.pi - 0.2, np.pi / 4])
LIMIT = np.array([80.0] * 5 + [12.0] * 2)  # Nm
RUN_UP = 0.2  # rad from which a joint is pushed into its stop
SECONDS = 2.0


def make(task, space="robosuite-osc"):
    config = robosuite.load_controller_config(default_controller="OSC_POSE") | {"impedance_mode": SPACES[space]}
    return robosuite.make(
        task.capitalize(), robots="Panda", controller_configs=config, initialization_noise={"type": "gaussian", "magnitude": NOISE},
        has_renderer=False, has_offscreen_renderer=False, use_camera_obs=False, horizon=ACTIONS, ignore_done=True,
    )


KINDS = ["random", "small", "translations", "rotations", "axes"]


def deltas(kind, rng):
    """Six entries of motion for each action, with two decimals."""
    random = rng.uniform(-1, 1, (ACTIONS, 6))
    if kind == "small":
        random *= 0.4
    elif kind == "translations":
        random[:, 3:] = 0
    elif kind == "rotations":
        random[:, :3] = 0
    elif kind == "axes":  # One axis at a time, five actions long.
        random[:] = np.repeat(np.eye(6)[rng.integers(6, size=ACTIONS // 5)] * rng.choice([-0.5, 0.5], (ACTIONS // 5, 1)), 5, axis=0)
    return np.round(random, 2)


def touches(env):
    """Whether anything touches the robot."""
    model, data = env.sim.model._model, env.sim.data._data
    bodies = [model.body(model.geom_bodyid[geom]).name for contact in data.contact for geom in contact.geom]
    return any(name.startswith(("robot0", "gripper0")) for name in bodies)


def watch(env):
    """Watches every substep of `env`. Returns a list that is empty as long as nothing has touched the robot."""
    touched, inner = [], env._pre_action

    def pre_action(action, policy_step=False):
        inner(action, policy_step)
        touched.extend([True] * touches(env))

    env._pre_action = pre_action
    return touched


def state(env):
    env.sim.forward()
    data, robot = env.sim.data._data, env.robots[0]
    site, quat = env.sim.model.site_name2id("gripper0_grip_site"), np.zeros(4)
    mujoco.mju_mat2Quat(quat, data.site_xmat[site])
    return [*data.site_xpos[site], *quat, *data.qpos[robot._ref_joint_pos_indexes]]


def scenario(env, touched, space, kind, rng):
    """Start angles, actions, and the state after every eighth action; None where the arm touches something."""
    env.reset()
    touched.clear()
    start = env.sim.data.qpos[env.robots[0]._ref_joint_pos_indexes].copy()
    motion = deltas(kind, rng)
    gains = np.round(rng.uniform(-1, 1, (ACTIONS, 6 if space == "robosuite-variable" else 0)), 2)
    grip = rng.choice([-1.0, 0.0, 1.0], (ACTIONS, env.robots[0].gripper.dof))
    actions = np.hstack([gains, motion, grip])
    states = []
    for k in range(ACTIONS):
        env.step(np.hstack([150 * (1 + gains[k]), motion[k], grip[k]]))
        if touched:
            return None
        if (k + 1) % SAMPLE == 0:
            states.append(state(env))
    return start, actions, states


def text(values, digits):
    return [f"{round(v, digits) + 0.0:.{digits}f}".rstrip("0").rstrip(".") for v in values]


def motions():
    np.random.seed(SEED)  # robosuite draws placements and noise from the global generator
    rng = np.random.default_rng(SEED)
    with whole_file(MOTION) as file:
        file.write(HEADER)
        writer = csv.writer(file, lineterminator="\n")
        for task in TASKS:
            for space in SPACES:
                env = make(task, space)
                touched = watch(env)
                for kind in KINDS * REPEATS:
                    while not (run := scenario(env, touched, space, kind, rng)):
                        pass
                    start, actions, states = run
                    writer.writerow(["scenario", task, space, kind])
                    writer.writerow(["start", *text(start, 10)])
                    for k, action in enumerate(actions):
                        writer.writerow(["action", *text(action, 2)])
                        if (k + 1) % SAMPLE == 0:
                            writer.writerow(["state", *text(states[k // SAMPLE], 6)])


def air():
    """Rows of task, q, qd, torque of the air: seven joints of the arm, two of the fingers (zero where there are none)."""
    rng = np.random.default_rng(SEED)
    with whole_file(AIR) as file:
        file.write(HEADER)
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["task"] + [f"{name}{i}" for name in ("q", "qd", "tau") for i in range(9)])
        for task in TASKS:
            env = make(task)
            env.reset()
            model, data = env.sim.model._model, env.sim.data._data
            for row in air_torques(model, data, 9 if task == "lift" else 7, rng):
                writer.writerow([task] + [f"{v + 0.0:.10g}" for v in row])


def stops():
    """Rows of joint, end of its range, largest overshoot, overshoot after two seconds.

    Full torque towards the stop, gravity and Coriolis compensated; the other joints are held by M (400 (q0 - q) - 40 qd).
    """
    env = make("lift")
    env.reset()
    model, data = env.sim.model._model, env.sim.data._data
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    model.actuator_ctrllimited[:] = False
    with whole_file(STOPS) as file:
        file.write(HEADER)
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["joint", "end", "overshoot", "rest"])
        for joint in range(7):
            for end, sign in [(0, -1.0), (1, 1.0)]:
                mujoco.mj_resetData(model, data)
                q0 = HOME.copy()
                q0[joint] = model.jnt_range[joint, end] - sign * RUN_UP
                data.qpos[:7], data.qpos[7:9] = q0, [0.020833, -0.020833]
                overshoots = []
                for _ in range(round(SECONDS / model.opt.timestep)):
                    mujoco.mj_forward(model, data)
                    mass = np.zeros((model.nv, model.nv))
                    mujoco.mj_fullM(model, mass, data.qM)
                    held = mass[:7, :7] @ (400 * (q0 - data.qpos[:7]) - 40 * data.qvel[:7])
                    held[joint] = sign * LIMIT[joint]
                    data.ctrl[:7], data.ctrl[7:9] = data.qfrc_bias[:7] + held, [0.02, -0.02]
                    mujoco.mj_step(model, data)
                    overshoots.append(sign * (data.qpos[joint] - model.jnt_range[joint, end]))
                writer.writerow([joint + 1, ["lower", "upper"][end], f"{max(overshoots):.6f}", f"{overshoots[-1]:.6f}"])


def main():
    air()
    stops()
    motions()
    if MOTION.stat().st_size > 150_000:
        sys.exit(f"{MOTION} is too large to be committed")


if __name__ == "__main__":
    main()
