#!/usr/bin/env python3
"""Regenerate crates/physics/reference/objects*.csv: what MuJoCo says about the objects in objects.xml beside them.

    python3 -m venv VENV && VENV/bin/pip install mujoco==3.17.0 numpy==2.4.6
    VENV/bin/python scripts/objects_reference.py

Needs cargo. MuJoCo loads the file itself. It also loads what the physics crate reads from the file and exports again (example
`objects_to_mjcf`). Both must be the same bodies in the same motion; the script exits non-zero if not. tests/objects.rs reads

    objects_inertia.csv  mass, centre of mass and inertia of each body that moves, in the body's frame (the joint's place for `flap`)
    objects.csv          1 s of motion at 20 Hz, in steps of 0.1 ms
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import mujoco
import numpy as np
from whole_file import whole_file

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "crates" / "physics" / "reference"
DT = 1e-4
SAMPLE, DURATION = 500, 10_000  # steps
BODIES = ["ball", "roof", "flap", "drawer"]


def require(condition, message):
    if not condition:
        sys.exit(f"the export is wrong: {message}")


def load(path):
    spec = mujoco.MjSpec.from_file(str(path))
    spec.option.timestep, spec.option.gravity = DT, [0, 0, -9.81]
    spec.option.cone, spec.option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, 20
    model = spec.compile()
    # Constraints as stiff as the step allows: with MuJoCo's default time constant of 20 ms dry friction lets slow joints creep.
    model.dof_solref[:], model.dof_solimp[:, :2] = [2 * DT, 1], 0.9999
    model.geom_solref[:] = [20 * DT, 1]
    return model


def export():
    command = ["cargo", "run", "--quiet", "--release", "-p", "physics", "--example", "objects_to_mjcf", "--", str(OUT / "objects.xml")]
    return subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout


def inertia(model, name):
    """Mass, centre of mass (of a body with a hinge counted from the hinge), and inertia about it (xx, yy, zz, xy, xz, yz); body axes."""
    body = model.body(name)
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, body.iquat)
    turn = turn.reshape(3, 3)
    full = turn @ np.diag(body.inertia) @ turn.T
    joint = model.jnt_pos[body.jntadr[0]] if model.jnt_type[body.jntadr[0]] == mujoco.mjtJoint.mjJNT_HINGE else np.zeros(3)
    return [body.mass[0], *(body.ipos - joint), *full[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]]


def motion(model):
    """Rows of time, position of the ball, pose of the roof, angle of the flap, place of the drawer."""
    data = mujoco.MjData(model)
    for step in range(DURATION + 1):
        if step % SAMPLE == 0:
            mujoco.mj_kinematics(model, data)
            ball, roof = data.body("ball").xpos, data.body("roof")
            yield [step * DT, *ball, *roof.xpos, *roof.xquat, data.joint("flap").qpos[0], data.joint("drawer").qpos[0]]
        mujoco.mj_step(model, data)


def write(name, header, rows):
    path = OUT / name
    with whole_file(path) as file:
        file.write(f"# MuJoCo {mujoco.__version__}, numpy {np.__version__}; made by scripts/objects_reference.py\n")
        file.write(",".join(header) + "\n")
        for row in rows:
            file.write(",".join(cell if isinstance(cell, str) else f"{cell + 0.0:.12g}" for cell in row) + "\n")
    print(f"{name}: {path.stat().st_size} bytes")


def main():
    original = load(OUT / "objects.xml")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "export.xml"
        path.write_text(export())
        exported = load(path)
    for name in BODIES:
        pair = np.array([inertia(original, name), inertia(exported, name)])
        require(np.allclose(*pair, rtol=1e-6, atol=1e-12), f"inertia of {name}: {pair}")
    for name in ["flap", "drawer"]:
        for field in ["jnt_stiffness", "jnt_range", "qpos_spring", "dof_damping", "dof_frictionloss", "dof_armature"]:
            joint = original.joint(name)
            at = {"j": joint.id, "q": joint.qposadr[0], "d": joint.dofadr[0]}[field[0]]
            require(np.allclose(getattr(original, field)[at], getattr(exported, field)[at]), f"{field} of {name}")
    rows = list(motion(original))
    apart = np.abs(np.array(rows) - np.array(list(motion(exported))))
    # Rounding decides how the roof tumbles as it lands, so it is compared only before and after that.
    falling, landed, roof = 2, -1, slice(4, 11)
    for what, difference, allowed in [
        ("ball, flap and drawer", np.delete(apart, roof, axis=1), 1e-6),
        ("falling roof", apart[:falling, roof], 1e-9),
        ("landed roof", apart[landed, roof], 2e-3),
    ]:
        require(difference.max() < allowed, f"{what}: the motions are {difference.max()} apart")
        print(f"{what}: original and export within {difference.max():.1e}")
    write("objects_inertia.csv", ["body", "mass", "x", "y", "z", "xx", "yy", "zz", "xy", "xz", "yz"], ([n, *inertia(original, n)] for n in BODIES))
    header = ["t", "ball_x", "ball_y", "ball_z", "roof_x", "roof_y", "roof_z", "roof_qw", "roof_qx", "roof_qy", "roof_qz", "flap", "drawer"]
    write("objects.csv", header, rows)


if __name__ == "__main__":
    main()
