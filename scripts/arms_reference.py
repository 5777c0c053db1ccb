#!/usr/bin/env python3
"""Regenerate crates/physics/reference/states_arms.csv: what MuJoCo says about the arms that the physics crate exports.

    python3 -m venv VENV && VENV/bin/pip install mujoco==3.2.7 numpy
    VENV/bin/python scripts/arms_reference.py

Needs cargo. Exports the arm of each robot in ROBOTS (example `export_mjcf`, scene wipe), and writes 70 random states of each: joint angles and
velocities (rad, rad/s), the lower triangle of the mass matrix by rows, rotors included (kg m2), the bias torques (Nm), place and quaternion
(w, x, y, z) of the wiping tool's body in the world (m). An arm of six joints has a seventh that stands still: angle, velocity and bias are 0,
and its part of the mass matrix is 1 on the diagonal. crates/physics/tests/model.rs holds the arm's own model against it.
"""

import subprocess
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np
from whole_file import whole_file

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "crates" / "physics" / "reference" / "states_arms.csv"
ROBOTS = ["robosuite", "identified", "fr3", "iiwa14", "ur5e"]
SEED = 20260301
STATES = 70


def principal(xml):
    """Replaces each `fullinertia` by principal moments and axes from numpy: MuJoCo 3.2.7 finds them to 1e-8 kg m2 only."""
    root = ET.fromstring(xml)
    for inertial in root.iter("inertial"):
        full = inertial.attrib.pop("fullinertia", None)
        if full is None:
            continue
        xx, yy, zz, xy, xz, yz = map(float, full.split())
        moments, axes = np.linalg.eigh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        axes[:, 0] *= np.linalg.det(axes)  # A right-handed frame.
        quaternion = np.zeros(4)
        mujoco.mju_mat2Quat(quaternion, axes.flatten())
        inertial.set("diaginertia", " ".join(repr(float(moment)) for moment in moments))
        inertial.set("quat", " ".join(repr(float(part)) for part in quaternion))
    # Keeps an inertia that no rigid body can have, as the identified Panda has one.
    root.find("compiler").set("balanceinertia", "false")
    return ET.tostring(root, encoding="unicode")


def states(model):
    rng, data = np.random.default_rng(SEED), mujoco.MjData(model)
    n, tool = model.nv, model.body("wiping_tool").id
    ranges = np.clip(model.jnt_range, -np.pi, np.pi)
    centre, half = ranges.mean(axis=1), np.ptp(ranges, axis=1) / 2
    for _ in range(STATES):
        q, qd, bias, mass, part = np.zeros(7), np.zeros(7), np.zeros(7), np.eye(7), np.zeros((n, n))
        q[:n] = np.round(centre + half * rng.uniform(-1, 1, n), 6)
        qd[:n] = np.round(rng.uniform(-1.5, 1.5, n), 6)
        data.qpos[:], data.qvel[:] = q[:n], qd[:n]
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, part, data.qM)
        mass[:n, :n], bias[:n] = part, data.qfrc_bias
        yield np.concatenate([q, qd, mass[np.tril_indices(7)], bias, data.xpos[tool], data.xquat[tool]])


def main():
    names = [("q", 7), ("qd", 7), ("mass", 28), ("bias", 7)]
    header = ["robot"] + [f"{name}{i}" for name, count in names for i in range(count)] + ["x", "y", "z", "qw", "qx", "qy", "qz"]
    with tempfile.TemporaryDirectory() as folder, whole_file(OUT) as file:
        file.write(f"# MuJoCo {mujoco.__version__}, numpy {np.__version__}; seed {SEED}; made by scripts/arms_reference.py\n")
        file.write(",".join(header) + "\n")
        for robot in ROBOTS:
            export = ["cargo", "run", "--release", "-q", "-p", "physics", "--example", "export_mjcf", "wipe", robot, folder]
            subprocess.run(export, cwd=ROOT, check=True)
            model = mujoco.MjModel.from_xml_string(principal((Path(folder) / f"wipe_{robot}.xml").read_text()))
            for row in states(model):
                file.write(robot + "," + ",".join(f"{value + 0.0:.12g}" for value in row) + "\n")


if __name__ == "__main__":
    main()
