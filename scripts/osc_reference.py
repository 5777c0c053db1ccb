#!/usr/bin/env python3
"""Regenerate tests/reference/osc.csv: torques of robosuite's OSC_POSE by its published formulas, in plain numpy.

    python3 scripts/osc_reference.py        # needs numpy

Mass matrix, bias, Jacobian and tool orientation of 50 random states are MuJoCo's (crates/physics/reference/states_robosuite.csv). Each
state gets two rows: fixed gains (kp 150) and commanded ones (`variable_kp`), with a random action and a random posture for the null space.
Read by tests/robosuite_osc.rs.

Torques are those before the limits. Two things differ from robosuite on purpose. The orientation error is the rotation vector (angle times
axis), where robosuite's sum of cross products is sine of the angle times axis: the script computes robosuite's and rescales it. And states
close to a singularity are left out (one of the 50): there the workbench damps J M^-1 J^T, robosuite in practice does not.
"""

import csv
from pathlib import Path

import numpy as np
from whole_file import whole_file

ROOT = Path(__file__).resolve().parent.parent
STATES = ROOT / "crates" / "physics" / "reference" / "states_robosuite.csv"
OUT = ROOT / "tests" / "reference" / "osc.csv"

SEED = 20261121
POSITION_STEP, ROTATION_STEP = 0.05, 0.5  # m, rad per action entry
NULL_SPACE = 10.0  # 1/s^2
SMALLEST_PIVOT = 2.5e-4  # 1/kg, of J M^-1 J^T: below it the workbench damps the matrix


def rotation(axis_angle):
    """Rodrigues' formula."""
    angle = np.linalg.norm(axis_angle)
    x, y, z = axis_angle / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def matrix(w, x, y, z):
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])


def torque(q, qd, mass, bias, jacobian, orientation, kp, delta, q0):
    """delta: position (m) and rotation vector (rad), world axes, from the measured pose to the goal."""
    goal = rotation(delta[3:]) @ orientation
    sine = 0.5 * sum(np.cross(orientation[:, k], goal[:, k]) for k in range(3))
    angle = np.linalg.norm(delta[3:])
    error = np.concatenate([delta[:3], sine * angle / np.sin(angle)])
    kd = 2 * np.sqrt(kp)
    wanted = kp * error - kd * (jacobian @ qd)

    inverse = np.linalg.inv(mass)
    position, turn = jacobian[:3], jacobian[3:]
    wrench = np.concatenate([
        np.linalg.inv(position @ inverse @ position.T) @ wanted[:3],
        np.linalg.inv(turn @ inverse @ turn.T) @ wanted[3:],
    ])
    full = np.linalg.inv(jacobian @ inverse @ jacobian.T)
    null = np.eye(7) - inverse @ jacobian.T @ full @ jacobian
    posture = mass @ (NULL_SPACE * (q0 - q) - 2 * np.sqrt(NULL_SPACE) * qd)
    return jacobian.T @ wrench + bias + null.T @ posture


def main():
    rng = np.random.default_rng(SEED)
    with open(STATES) as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))

    def numbers(row, name, count):
        return np.array([float(row[f"{name}{i}"]) for i in range(count)])

    OUT.parent.mkdir(exist_ok=True)
    with whole_file(OUT) as file:
        file.write(f"# numpy {np.__version__}; seed {SEED}; made by scripts/osc_reference.py\n")
        writer = csv.writer(file, lineterminator="\n")
        header = [("q", 7), ("qd", 7), ("q0", 7), ("kp", 6), ("action", 6), ("tau", 7)]
        writer.writerow(["space"] + [f"{name}{i}" for name, count in header for i in range(count)])
        for row in rows:
            q, qd = numbers(row, "q", 7), numbers(row, "qd", 7)
            mass = np.zeros((7, 7))
            mass[np.tril_indices(7)] = numbers(row, "mass", 28)
            mass += np.tril(mass, -1).T
            jacobian = numbers(row, "jacobian", 42).reshape(6, 7)
            if np.linalg.cholesky(jacobian @ np.linalg.inv(mass) @ jacobian.T).diagonal().min() ** 2 < SMALLEST_PIVOT:
                continue
            orientation = matrix(*(float(row[f"q{c}"]) for c in "wxyz"))
            for space, kp in [("osc", np.full(6, 150.0)), ("variable", np.round(300 * rng.uniform(size=6), 6))]:
                action = np.round(rng.uniform(-1, 1, 6), 6)
                q0 = np.round(q + rng.normal(0, 0.3, 7), 6)
                delta = action * np.repeat([POSITION_STEP, ROTATION_STEP], 3)
                tau = torque(q, qd, mass, numbers(row, "bias", 7), jacobian, orientation, kp, delta, q0)
                writer.writerow([space] + [f"{v:.10g}" for v in np.concatenate([q, qd, q0, kp, action, tau])])


if __name__ == "__main__":
    main()
