#!/usr/bin/env python3
"""Regenerate crates/physics/reference/wiping.csv: how MuJoCo's wiping tool presses and slides.

    VENV/bin/python scripts/mujoco_wipe_reference.py          (VENV as for scripts/mujoco_reference.py)

Exports the Wipe scene (example `export_mjcf`), brings the tool down level under a Cartesian spring, presses with a constant force at the
joints, then pulls the spring along y. The law is that of crates/physics/tests/wipe.rs, which reads the file. Joint friction is taken out,
so that statics tells the contact force. Contacts have MuJoCo's default softness: forces do not depend on it.
"""

import subprocess
import tempfile
from pathlib import Path

import mujoco
import numpy as np

from whole_file import whole_file

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "crates" / "physics" / "reference" / "wiping.csv"
HOME = np.array([0.0, np.pi / 16, 0.0, -5 * np.pi / 6, 0.0, np.pi - 0.2, np.pi / 4])
GRIP_SITE = np.array([0.0, 0.0, 0.015])
TABLE = 0.9
LEVEL = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
STIFFNESS = np.array([800.0] * 3 + [60.0] * 3)
DAMPING = np.array([40.0] * 3 + [2.0] * 3)
SPEED = 0.05


def rotation_error(actual, desired):
    quat, vector = np.zeros(4), np.zeros(3)
    mujoco.mju_mat2Quat(quat, (actual @ desired.T).ravel())
    mujoco.mju_quat2Vel(vector, quat, 1.0)
    return vector


def on_tool(model, data, tool):
    """Sum of the contact forces on the tool's geoms, world axes."""
    total, force = np.zeros(3), np.zeros(6)
    for i in range(data.ncon):
        contact = data.contact[i]
        bodies = model.geom_bodyid[contact.geom]
        if tool in bodies:
            mujoco.mj_contactForce(model, data, i, force)
            on_second = contact.frame.reshape(3, 3).T @ force[:3]
            total += on_second if bodies[1] == tool else -on_second
    return total


def press(xml, force):
    """Mean contact force at rest, and while sliding."""
    model = mujoco.MjModel.from_xml_path(str(xml))
    model.dof_frictionloss[:], model.dof_damping[:] = 0.0, 5.0
    data, tool = mujoco.MjData(model), model.body("wiping_tool").id
    data.qpos[:] = HOME
    still, moving = [], []
    for step in range(5000):
        mujoco.mj_step1(model, data)
        rotation = data.xmat[tool].reshape(3, 3)
        point = data.xpos[tool] + rotation @ GRIP_SITE
        linear, angular = np.zeros((3, 7)), np.zeros((3, 7))
        mujoco.mj_jac(model, data, linear, angular, point, tool)
        jacobian = np.vstack([linear, angular])
        y = SPEED * 0.002 * max(step - 4000, 0)
        target = np.array([0.15, y, max(1.07 - 1e-4 * step, TABLE + 0.002)])
        error = np.concatenate([point - target, rotation_error(rotation, LEVEL)])
        twist = jacobian @ data.qvel
        wrench = -STIFFNESS * error - DAMPING * twist
        if step > 2200:
            wrench[2] = -force - 40.0 * twist[2]
        data.ctrl[:] = data.qfrc_bias + jacobian.T @ wrench
        mujoco.mj_step2(model, data)
        (still if 3500 <= step < 4000 else moving if step >= 4500 else []).append(on_tool(model, data, tool))
    return np.mean(still, axis=0), np.mean(moving, axis=0)


def main():
    with tempfile.TemporaryDirectory() as folder:
        command = ["cargo", "run", "--quiet", "--release", "-p", "physics", "--example", "export_mjcf", "--", "wipe", "robosuite", folder]
        subprocess.run(command, cwd=ROOT, check=True)
        xml = Path(folder) / "wipe_robosuite.xml"
        rows = [[force, *press(xml, force)] for force in [5.0, 15.0, 30.0]]
    with whole_file(OUT) as file:
        file.write(f"# MuJoCo {mujoco.__version__}, numpy {np.__version__}; made by scripts/mujoco_wipe_reference.py\n")
        file.write("pressed,rest_x,rest_y,rest_z,slide_x,slide_y,slide_z\n")
        for pressed, rest, slide in rows:
            file.write(",".join(f"{v + 0.0:.6g}" for v in [pressed, *rest, *slide]) + "\n")
    print(OUT.read_text())


if __name__ == "__main__":
    main()
