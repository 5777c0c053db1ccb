#!/usr/bin/env python3
"""Regenerate crates/physics/reference: what MuJoCo says about the scene that the physics crate exports.

    python3 -m venv VENV && VENV/bin/pip install mujoco==3.17.0 numpy==2.4.6
    VENV/bin/python scripts/mujoco_reference.py

Needs cargo. Exports the scenes (example `export_mjcf`), checks that nothing was lost on the way (exits non-zero if it was), and writes
seven kinds of files, read by crates/physics/tests/{mujoco,contact_forces}.rs and src/engine/drag.rs:

    states_<set>.csv    50 random joint states: mass matrix, bias, Jacobian, pose and forward dynamics
    motions_<set>.csv   2 s motions at 20 Hz by RK4 at a twentieth of the step, the torque held for 2 ms
    errors.csv          how far MuJoCo's Euler integrator, at 2 ms, is from those motions
    contacts.csv        mean force on, and acceleration of, a block that rests, is pressed, and slides
    door.csv            opening and handle angle over time under loads on both
    release.csv         load on the handle at which the latch lets go, in either direction
    air.csv             torque of the air on each joint in 10 random states of each scene

The fingers are welded at their opening at the start of an episode, as in the model of the arm: MuJoCo's two finger joints are deleted and
the bodies moved. The script also checks that this model agrees with the one that has finger joints, in the arm's block of the mass matrix
and in the bias at zero finger velocity.
"""

import csv
import subprocess
import sys
import tempfile
from pathlib import Path

import mujoco
import numpy as np
from air_torques import air_torques
from whole_file import whole_file

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "crates" / "physics" / "reference"
SETS = ["robosuite", "identified"]

SEED = 20210409
STATES = 50
DT = 0.002
FINE = 20  # RK4 steps in one step
DURATION = 2.0
SAMPLE = 25  # steps in one sample: 20 Hz
WINDOWS = [0.5, 1.0, 2.0]

GRIP_SITE = [0.0, 0.0, 0.097]
INITIAL_OPENING = 0.020833
HOME = np.array([0.0, np.pi / 16, 0.0, -5 * np.pi / 6, 0.0, np.pi - 0.2, np.pi / 4])

# Torques (Nm) and frequencies (Hz) of the motions. The push keeps the arm slow; the sinusoids make it fast.
PUSH = np.array([4.0, -3.0, 3.0, 2.0, -1.5, 1.0, 0.5])
AMPLITUDE = np.array([20.0, 25.0, 15.0, 15.0, 5.0, 4.0, 2.0])
FREQUENCY = np.array([0.5, 0.7, 0.9, 1.1, 1.3, 1.5, 1.7])

# The block is lower than wide, because a sliding cube with friction coefficient 1 is about to tip over.
BLOCK_HALF = np.array([0.03, 0.03, 0.01])
BLOCK_MASS = 8 * BLOCK_HALF.prod() * 1000.0
PRESS = 20.0
PULL = 2.0

# Each tuple has the loads on hinge and handle (Nm) and the time in which they are reached linearly (s). Slow changes keep the handle, which
# has no damping, from swinging; sudden changes are the experiment.
TURNED = (0.0, 1.45, 3.0)
DOOR_CASES = {
    "latched": [(20.0, 0.0, 1.0), (20.0, 0.0, 1.0)],
    "half_turned": [(0.0, 0.8, 3.0), (20.0, 0.8, 1.0), (20.0, 0.8, 1.0)],
    "spring_return": [TURNED, (0.0, 0.0, 0.0), (0.0, 0.0, 4.0)],
    "opens": [TURNED, (3.0, 1.45, 0.0), (3.0, 1.45, 0.3)],
    "swings_freely": [TURNED, (5.0, 1.45, 0.0), (5.0, 1.45, 0.1), (0.0, 1.45, 0.0), (0.0, 1.45, 1.0)],
}

warnings = []
mujoco.set_mju_user_warning(lambda message: warnings.append(str(message)))


def require(condition, message):
    if not condition:
        sys.exit(f"the export is wrong: {message}")


def close(a, b, tolerance=1e-12):
    return np.allclose(a, b, rtol=tolerance, atol=tolerance)


def export(scene, name, folder):
    command = ["cargo", "run", "--quiet", "--release", "-p", "physics", "--example", "export_mjcf", "--", scene, name, str(folder)]
    subprocess.run(command, cwd=ROOT, check=True)
    return folder / f"{scene}_{name}.xml", folder / f"{scene}_{name}.csv"


def check_export(xml, table):
    """The file loads without warnings, and masses, joints and actuators are those of the scene."""
    model = mujoco.MjModel.from_xml_path(str(xml))
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data)
    require(not warnings, f"warnings {warnings}")
    require(all(w.number == 0 for w in data.warning), "the first step warns")
    require(model.opt.timestep == DT and close(model.opt.gravity, [0, 0, -9.81]), "options")
    with open(table) as file:
        rows = {row["name"]: row for row in csv.DictReader(file)}
    require(close(model.body_mass.sum(), float(rows.pop("total")["mass"])), "total mass")
    free = (model.jnt_type == mujoco.mjtJoint.mjJNT_FREE).sum()
    driven = {name: row for name, row in rows.items() if float(row["max_effort"])}
    require(model.njnt == len(rows) + free and model.nu == len(driven), "number of joints or actuators")
    for name, row in rows.items():
        joint, dof = model.joint(name), model.joint(name).dofadr[0]
        require(model.jnt_limited[joint.id] and close(joint.range, [float(row["lower"]), float(row["upper"])]), f"range of {name}")
        require(close(model.dof_damping[dof], float(row["damping"])), f"damping of {name}")
        require(close(model.dof_frictionloss[dof], float(row["friction"])), f"friction of {name}")
        require(close(model.dof_armature[dof], float(row["armature"])), f"armature of {name}")
        require(close(model.jnt_stiffness[joint.id], float(row["spring"])), f"spring of {name}")
    for name, row in driven.items():
        joint, actuator, limit = model.joint(name), model.actuator(name), float(row["max_effort"])
        require(actuator.trnid[0] == joint.id and actuator.gainprm[0] == 1 and actuator.biastype[0] == 0, f"motor of {name}")
        require(actuator.ctrllimited[0] and close(actuator.ctrlrange, [-limit, limit]), f"effort limit of {name}")
    return model


def arm_only(xml, losses=True):
    """The arm with welded fingers, without contacts and joint stops; without `losses` nothing brakes it."""
    spec = mujoco.MjSpec.from_file(str(xml))
    spec.delete(spec.body("cube"))
    for side, sign in [("left", 1.0), ("right", -1.0)]:
        spec.delete(spec.actuator(f"{side}_finger_joint"))
        joint, body = spec.joint(f"{side}_finger_joint"), spec.body(f"{side}_finger")
        shift = np.zeros(3)
        mujoco.mju_rotVecQuat(shift, joint.axis * sign * INITIAL_OPENING, body.quat)
        body.pos = body.pos + shift
        spec.delete(joint)
    model = spec.compile()
    model.jnt_limited[:] = 0
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    if not losses:
        model.dof_frictionloss[:], model.dof_damping[:] = 0, 0
        model.opt.density, model.opt.viscosity = 0, 0
    require(model.nv == 7 and model.nu == 7, "welding left other joints than the arm's")
    return model


def full_mass(model, data):
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    return mass


def states(full, model):
    """Rows of q, qd, tau, M (lower triangle by rows), bias, J (by rows, linear first), position, quaternion (w x y z), qdd."""
    rng = np.random.default_rng(SEED)
    data, data_full = mujoco.MjData(model), mujoco.MjData(full)
    gripper = model.body("gripper").id
    centre, half = model.jnt_range.mean(axis=1), np.ptp(model.jnt_range, axis=1) / 2
    for _ in range(STATES):
        q = np.round(centre + 0.9 * half * rng.uniform(-1, 1, 7), 6)
        qd = np.round(rng.uniform(-1.5, 1.5, 7), 6)
        tau = np.round(0.5 * model.actuator_ctrlrange[:, 1] * rng.uniform(-1, 1, 7), 6)
        data.qpos[:], data.qvel[:], data.ctrl[:] = q, qd, tau
        mujoco.mj_forward(model, data)
        mass = full_mass(model, data)
        point = data.xpos[gripper] + data.xmat[gripper].reshape(3, 3) @ GRIP_SITE
        linear, angular = np.zeros((3, 7)), np.zeros((3, 7))
        mujoco.mj_jac(model, data, linear, angular, point, gripper)

        data_full.qpos[:7], data_full.qpos[7:9] = q, [INITIAL_OPENING, -INITIAL_OPENING]
        data_full.qvel[:7] = qd
        mujoco.mj_forward(full, data_full)
        mass_full, bias_full = full_mass(full, data_full)[:7, :7], data_full.qfrc_bias[:7]
        require(close(mass_full, mass, 1e-10) and close(bias_full, data.qfrc_bias, 1e-10), "sliding and welded fingers differ")
        require(close(np.linalg.solve(mass_full, tau - bias_full), data.qacc, 1e-8), "forward dynamics of the arm block differ")

        lower = mass[np.tril_indices(7)]
        jacobian = np.vstack([linear, angular])
        yield np.concatenate([q, qd, tau, lower, data.qfrc_bias, jacobian.ravel(), point, data.xquat[gripper], data.qacc])


def gravity(model, scratch, q):
    scratch.qpos[:], scratch.qvel[:] = q, 0.0
    mujoco.mj_forward(model, scratch)
    return scratch.qfrc_bias.copy()


MOTIONS = {
    "fall": lambda t, gravity: np.zeros(7),
    "push": lambda t, gravity: gravity() + PUSH,
    "sinusoids": lambda t, gravity: AMPLITUDE * np.sin(2 * np.pi * FREQUENCY * t),
}


def simulate(model, torque, substeps, integrator):
    """Joint angles at each step from HOME at rest; the torque is held for DT."""
    model.opt.timestep, model.opt.integrator = DT / substeps, integrator
    data, scratch = mujoco.MjData(model), mujoco.MjData(model)
    data.qpos[:] = HOME
    trajectory = [data.qpos.copy()]
    for k in range(round(DURATION / DT)):
        data.ctrl[:] = torque(k * DT, lambda: gravity(model, scratch, data.qpos))
        require((np.abs(data.ctrl) <= model.actuator_ctrlrange[:, 1]).all(), "a motion asks for more torque than the motors have")
        for _ in range(substeps):
            mujoco.mj_step(model, data)
        trajectory.append(data.qpos.copy())
    return np.array(trajectory)


def air(scene, xml):
    """Rows of scene, q, qd, torque of the air: seven joints of the arm, two of the fingers (zero where there are none)."""
    rng = np.random.default_rng(SEED)
    model = mujoco.MjModel.from_xml_path(str(xml))
    require(model.opt.density == 1.2 and model.opt.viscosity == 2e-5, "no air")
    for row in air_torques(model, mujoco.MjData(model), 7 if scene == "wipe" else 9, rng):
        yield [scene, *row]


def contact_force(model, data, geom):
    """Sum of the contact forces on a geom, world axes."""
    total, force = np.zeros(3), np.zeros(6)
    for i in range(data.ncon):
        contact = data.contact[i]
        if geom in contact.geom:
            mujoco.mj_contactForce(model, data, i, force)
            on_second = contact.frame.reshape(3, 3).T @ force[:3]
            total += on_second if contact.geom[1] == geom else -on_second
    return total


def block(xml, applied):
    """Mean contact force and horizontal acceleration of the block during 80 ms of a constant force at its centre.

    Means, because MuJoCo's block hops as it slides: its friction cone is relaxed to a convex problem in which sliding lifts.
    """
    spec = mujoco.MjSpec.from_file(str(xml))
    body, geom = spec.body("cube"), spec.geom("cube")
    body.pos = [-0.2, 0.0, 0.8 + BLOCK_HALF[2]]
    geom.size = BLOCK_HALF
    body.mass, s = BLOCK_MASS, BLOCK_HALF**2 * BLOCK_MASS / 3
    body.fullinertia = [s[1] + s[2], s[0] + s[2], s[0] + s[1], 0, 0, 0]
    model = spec.compile()
    model.opt.timestep = DT / FINE
    data = mujoco.MjData(model)
    data.qpos[:7] = HOME
    body, geom, dof = model.body("cube").id, model.geom("cube").id, model.joint("cube").dofadr[0]

    def run(duration, force):
        forces, start = [], data.qvel[dof]
        for _ in range(round(duration / model.opt.timestep)):
            data.xfrc_applied[body, :3] = force
            data.qfrc_applied[:9] = data.qfrc_bias[:9]  # holds the arm
            mujoco.mj_step(model, data)
            forces.append(contact_force(model, data, geom))
        return np.mean(forces, axis=0), (data.qvel[dof] - start) / duration

    run(0.5, [0, 0, 0])
    run(0.02 if applied[0] else 0.5, applied)
    return run(0.08, applied)


def door_only(xml):
    """The door without the arm, in fine steps."""
    spec = mujoco.MjSpec.from_file(str(xml))
    for actuator in list(spec.actuators):
        spec.delete(actuator)
    spec.delete(spec.body("link0"))
    model = spec.compile()
    require([model.joint(i).name for i in range(model.njnt)] == ["hinge", "handle"], "the arm is still there")
    model.opt.timestep = DT / FINE
    return model


def door_motion(model, case):
    """Opening and handle angle (rad) every SAMPLE steps under a list of loads as in DOOR_CASES."""
    data, last, out = mujoco.MjData(model), np.zeros(2), [np.zeros(2)]
    for *target, duration in case:
        steps = round(duration / DT)
        for k in range(steps):
            data.qfrc_applied[:] = last + (np.array(target) - last) * (k / steps)
            for _ in range(FINE):
                mujoco.mj_step(model, data)
            if (k + 1) % SAMPLE == 0:
                out.append(data.qpos.copy())
        last = np.array(target)
    return out


def release(model, sign):
    """Smallest load on the handle (Nm) with which 5 Nm open the door."""
    low, high = 0.8, 1.5
    while high - low > 0.002:
        load = sign * (low + high) / 2
        opening, _ = door_motion(model, [(0.0, load, 3.0), (5.0, load, 0.0), (5.0, load, 1.0)])[-1]
        low, high = (low, abs(load)) if opening > 0.2 else (abs(load), high)
    return sign * (low + high) / 2


def write(name, header, rows, digits=12):
    def text(value):
        return value if isinstance(value, str) else f"{value + 0.0:.{digits}g}"

    path = OUT / name
    with whole_file(path) as file:
        file.write(f"# MuJoCo {mujoco.__version__}, numpy {np.__version__}; seed {SEED}; made by scripts/mujoco_reference.py\n")
        file.write(",".join(header) + "\n")
        for row in rows:
            file.write(",".join(text(value) for value in row) + "\n")
    require(path.stat().st_size < 100_000, f"{name} is too large to be committed")
    print(f"{name}: {path.stat().st_size} bytes")


def numbered(name, count):
    return [f"{name}{i}" for i in range(count)]


def main():
    OUT.mkdir(exist_ok=True)
    errors = []
    with tempfile.TemporaryDirectory() as folder:
        for name in SETS:
            xml, table = export("lift", name, Path(folder))
            full = check_export(xml, table)
            header = numbered("q", 7) + numbered("qd", 7) + numbered("tau", 7) + numbered("mass", 28) + numbered("bias", 7)
            header += numbered("jacobian", 42) + ["x", "y", "z", "qw", "qx", "qy", "qz"] + numbered("qdd", 7)
            write(f"states_{name}.csv", header, states(full, arm_only(xml, losses=False)))

            model, rows = arm_only(xml), []
            for motion, torque in MOTIONS.items():
                fine = simulate(model, torque, FINE, mujoco.mjtIntegrator.mjINT_RK4)[::SAMPLE]
                euler = simulate(model, torque, 1, mujoco.mjtIntegrator.mjINT_EULER)[::SAMPLE]
                rows += [[motion, k * SAMPLE * DT, *q] for k, q in enumerate(fine)]
                for window in WINDOWS:
                    last = round(window / DT / SAMPLE) + 1
                    errors.append([name, motion, window, np.abs(euler - fine)[:last].max(), np.ptp(fine[:last], axis=0).max()])
            write(f"motions_{name}.csv", ["motion", "t"] + numbered("q", 7), rows)
        xml = Path(folder) / "lift_robosuite.xml"
        loads = {"rest": [0, 0, 0], "press": [0, 0, -PRESS], "slide": [PULL, 0, 0]}
        contacts = []
        for name, load in loads.items():
            force, acceleration = block(xml, np.array(load, float))
            contacts.append([name, *load, *force, acceleration])
        airs = list(air("lift", xml)) + list(air("wipe", export("wipe", "robosuite", Path(folder))[0]))
        xml, table = export("door", "robosuite", Path(folder))
        check_export(xml, table)
        airs += air("door", xml)
        model = door_only(xml)
        motions = [[case, k * SAMPLE * DT, *q] for case, loads in DOOR_CASES.items() for k, q in enumerate(door_motion(model, loads))]
        releases = [[release(model, sign)] for sign in [1, -1]]
    write("errors.csv", ["set", "motion", "window", "max_error", "travel"], errors, 4)
    write("contacts.csv", ["case", "applied_x", "applied_y", "applied_z", "fx", "fy", "fz", "acceleration"], contacts, 8)
    write("door.csv", ["case", "t", "hinge", "handle"], motions, 6)
    write("release.csv", ["handle_load"], releases, 4)
    write("air.csv", ["scene"] + numbered("q", 9) + numbered("qd", 9) + numbered("tau", 9), airs, 10)
    require(not warnings, f"warnings {warnings}")


if __name__ == "__main__":
    main()
