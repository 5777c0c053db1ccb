#!/usr/bin/env python3
"""Regenerate crates/physics/reference/states_fr3.csv: what MuJoCo says about an FR3 made from its maker's own files.

    git clone https://github.com/frankaemika/franka_description
    python3 -m venv VENV && VENV/bin/pip install mujoco==3.2.7 numpy pyyaml
    VENV/bin/python scripts/fr3_reference.py franka_description

crates/physics/tests/model.rs compares the FR3 of crates/physics/src/robots/fr3.rs with the file: its numbers and its dynamics. This script takes
nothing from fr3.rs but the opening of the fingers. A row is a random state: joint angles and velocities (rad, rad/s), the lower triangle of the
mass matrix by rows without rotors (kg m2), the bias torques (Nm), place and quaternion (w, x, y, z) of the hand's frame in that of the base (m).
"""

import sys
from pathlib import Path

import mujoco
import numpy as np
import yaml
from whole_file import whole_file

OUT = Path(__file__).resolve().parent.parent / "crates" / "physics" / "reference" / "states_fr3.csv"
SEED = 20250321
STATES = 70
OPENING = 0.020833  # m, of each finger
FINGER = 0.0584  # m, of the fingers' frames along z of the hand's (end_effectors/common/franka_hand.xacro)


def read(folder, name):
    return yaml.safe_load((folder / name).read_text())


def inertial(values):
    """The MJCF element, with principal moments and axes from numpy: MuJoCo 3.2.7 finds those of a `fullinertia` to 1e-8 kg m2 only."""
    i, (origin, turn) = values["inertia"], (values["origin"][key] for key in ("xyz", "rpy"))
    if turn.split() != ["0", "0", "0"]:
        sys.exit(f"an inertia that is turned: {turn}")
    moments, axes = np.linalg.eigh([[i["xx"], i["xy"], i["xz"]], [i["xy"], i["yy"], i["yz"]], [i["xz"], i["yz"], i["zz"]]])
    axes[:, 0] *= np.linalg.det(axes)  # A right-handed frame.
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, axes.flatten())
    principal = " ".join(repr(float(moment)) for moment in moments)
    turn = " ".join(repr(float(part)) for part in quaternion)
    return f'<inertial pos="{origin}" mass="{values["mass"]}" diaginertia="{principal}" quat="{turn}"/>'


def arm(folder):
    """The seven links, the hand and its fingers as MJCF."""
    fr3 = folder / "robots" / "fr3"
    frames, masses, limits = (read(fr3, f"{name}.yaml") for name in ("kinematics", "inertials", "joint_limits"))
    hand = read(folder, "end_effectors/franka_hand/inertials.yaml")
    opening, closing = "", ""
    for i in range(1, 8):
        k, limit = frames[f"joint{i}"]["kinematic"], limits[f"joint{i}"]["limit"]
        opening += f'<body pos="{k["x"]} {k["y"]} {k["z"]}" euler="{k["roll"]} {k["pitch"]} {k["yaw"]}">'
        opening += f'<joint name="joint{i}" axis="0 0 1" range="{limit["lower"]} {limit["upper"]}"/>{inertial(masses[f"link{i}"])}'
        closing += "</body>"
    k = frames["joint8"]["kinematic"]
    opening += f'<body name="hand" pos="{k["x"]} {k["y"]} {k["z"]}" euler="0 0 {-np.pi / 4}">{inertial(hand["hand"])}'
    for side, turn in (("leftfinger", 0), ("rightfinger", np.pi)):
        y = OPENING if side == "leftfinger" else -OPENING
        opening += f'<body pos="0 {y} {FINGER}" euler="0 0 {turn}">{inertial(hand[side])}</body>'
    # Roll, pitch and yaw are about fixed axes.
    head = '<mujoco><compiler angle="radian" eulerseq="XYZ" autolimits="true"/><option gravity="0 0 -9.81"/><worldbody>'
    return f"{head}{opening}</body>{closing}</worldbody></mujoco>"


def states(model):
    rng, data = np.random.default_rng(SEED), mujoco.MjData(model)
    hand, mass = model.body("hand").id, np.zeros((7, 7))
    centre, half = model.jnt_range.mean(axis=1), np.ptp(model.jnt_range, axis=1) / 2
    for _ in range(STATES):
        data.qpos[:] = np.round(centre + half * rng.uniform(-1, 1, 7), 6)
        data.qvel[:] = np.round(rng.uniform(-1.5, 1.5, 7), 6)
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, mass, data.qM)
        yield np.concatenate([data.qpos, data.qvel, mass[np.tril_indices(7)], data.qfrc_bias, data.xpos[hand], data.xquat[hand]])


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: fr3_reference.py FOLDER_OF_FRANKA_DESCRIPTION")
    model = mujoco.MjModel.from_xml_string(arm(Path(sys.argv[1])))
    if model.nv != 7:
        sys.exit(f"{model.nv} joints instead of 7")
    names = [("q", 7), ("qd", 7), ("mass", 28), ("bias", 7)]
    header = [f"{name}{i}" for name, count in names for i in range(count)] + ["x", "y", "z", "qw", "qx", "qy", "qz"]
    with whole_file(OUT) as file:
        file.write(f"# MuJoCo {mujoco.__version__}, numpy {np.__version__}; seed {SEED}; made by scripts/fr3_reference.py\n")
        file.write(",".join(header) + "\n")
        for row in states(model):
            file.write(",".join(f"{value + 0.0:.12g}" for value in row) + "\n")


if __name__ == "__main__":
    main()
