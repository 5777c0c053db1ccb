#!/usr/bin/env python3
"""Regenerate crates/physics/reference/contact_card.csv: MuJoCo's half of results/contact.

    VENV/bin/python scripts/mujoco_contact_card.py          (VENV as for scripts/mujoco_reference.py)

Exports the scenes (example `contact_card`) and does in MuJoCo what crates/physics/examples/contact_card/cases.rs does in Rapier: once
with MuJoCo's default contacts, once with a time constant of two steps. Cells are separated by semicolons: names contain commas.
"""

import subprocess
import tempfile
from pathlib import Path

import mujoco
import numpy as np

from whole_file import whole_file

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "crates" / "physics" / "reference" / "contact_card.csv"
HOME = np.array([0.0, np.pi / 16, 0.0, -5 * np.pi / 6, 0.0, np.pi - 0.2, np.pi / 4])
LIMIT = np.array([80.0] * 5 + [12.0] * 2)
FINGER, SERVO, LARGEST = 0.020833, 1000.0, 20.0
DT, GRAVITY = 0.002, 9.81
CUBE_HALF, TABLE = 0.021, 0.8
WEIGHT = 8 * CUBE_HALF**3 * 1000 * GRAVITY
GRIP = 2.0
SHARES = [0.90, 0.98, 1.00, 1.02, 1.10]
CLEARANCES = [0.003, 0.001, 0.0005, 0.000114]
OVERSIZE, OFFSETS = 0.00002, 40
GAP, DEPTH, MASS, SPRING, LOWERING = 0.005, 0.025, 2.0, 500.0, 0.02
WEDGED = [
    [-2.83, -0.97, 2.64, -2.38, 0.71, 0.45, 2.15],
    [-1.49, 0.76, 1.29, -1.88, 1.55, 0.45, 2.30],
    [2.61, 0.65, 2.01, -1.98, 1.78, 0.17, -0.35],
    [2.03, -0.10, 2.10, -1.89, 2.34, 0.07, 1.51],
]
BEYOND_WRIST = {"gripper", "left_finger", "right_finger", "left_tip", "right_tip", "right_hand", "left", "right"}


class Bench:
    def __init__(self, folder, name, time_constant):
        self.model = mujoco.MjModel.from_xml_path(str(folder / f"{name}.xml"))
        self.model.geom_solref[:, 0] = time_constant
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:7] = HOME
        self.data.qpos[7:9] = FINGER, -FINGER
        self.loads = {}

    def at(self, joint):
        joint = self.model.joint(joint)
        return self.data.qpos[joint.qposadr[0]], self.data.qvel[joint.dofadr[0]]

    def step(self, target=HOME):
        data, model = self.data, self.model
        mujoco.mj_step1(model, data)
        tau = data.qfrc_bias[:7] + 200 * (np.asarray(target) - data.qpos[:7]) - 40 * data.qvel[:7]
        data.qfrc_applied[:] = 0
        data.qfrc_applied[:7] = np.clip(tau, -LIMIT, LIMIT)
        data.qfrc_applied[7:9] = np.clip(SERVO * (np.array([FINGER, -FINGER]) - data.qpos[7:9]), -LARGEST, LARGEST)
        for joint, load in self.loads.items():
            data.qfrc_applied[model.joint(joint).dofadr[0]] = load
        mujoco.mj_step2(model, data)

    def force(self):
        """Contact force on what is beyond the wrist (N, world); sum over the links' contact pairs of the size of their force (N)."""
        hand, links, six = np.zeros(3), {}, np.zeros(6)
        for i in range(self.data.ncon):
            contact = self.data.contact[i]
            names = [self.model.body(self.model.geom_bodyid[geom]).name for geom in contact.geom]
            mujoco.mj_contactForce(self.model, self.data, i, six)
            on_second = contact.frame.reshape(3, 3).T @ six[:3]
            beyond = [name in BEYOND_WRIST for name in names]
            if beyond[0] != beyond[1]:
                hand += on_second if beyond[1] else -on_second
            elif not beyond[0] and any(name.startswith("link") for name in names):
                pair = tuple(contact.geom)
                links[pair] = links.get(pair, np.zeros(3)) + on_second
        return hand, sum(np.linalg.norm(force) for force in links.values())

    def depth(self):
        return max([-contact.dist for contact in self.data.contact[: self.data.ncon]], default=0.0)


def held(folder, share, softness):
    bench = Bench(folder, f"held_{share:.2f}", softness)
    bench.loads = {"left": -GRIP, "right": GRIP}
    steps = int((0.2 if share < 1 else 5.0) / DT)
    force = 0.0
    for _ in range(steps):
        bench.step()
        force -= bench.force()[0][2] / steps
    slip = 1000 * (1.2 - bench.data.body("cube").xpos[2])
    yield f"held cube, friction x {share:.2f}", "slip in 0.2 s" if share < 1 else "slip in 5 s", slip
    yield f"held cube, friction x {share:.2f}", "force of its weight", force / WEIGHT


def dropped(folder, softness):
    bench = Bench(folder, "drop", softness)
    place = bench.model.jnt_qposadr[bench.model.body("cube").jntadr[0]]
    bench.data.qpos[place : place + 3] = 0.2, 0.2, TABLE + CUBE_HALF + 0.05
    deepest, after = 0.0, [np.array([0.2, 0.2])]
    for steps in (500, 5000):
        for _ in range(steps):
            bench.step()
            deepest = max(deepest, bench.depth())
        after.append(bench.data.qpos[place : place + 2].copy())
    case = "cube dropped from 5 cm"
    yield case, "deepest overlap", 1000 * max(deepest, 0.0)
    yield case, "slide in 1 s", 1000 * np.linalg.norm(after[1] - after[0])
    yield case, "creep in the next 10 s", 1000 * np.linalg.norm(after[2] - after[1])


def wedged(folder, softness):
    for i, posture in enumerate(WEDGED):
        bench, total = Bench(folder, "drop", softness), 0.0
        for step in range(2000):
            bench.step(posture)
            if step >= 1500:
                hand, links = bench.force()
                total += (np.linalg.norm(hand) + links) / 500
        yield f"driven into itself, {i + 1}", "force", total


def lowered(folder, clearance, x, softness):
    bench = Bench(folder, f"peg_{1e6 * clearance:.0f}", softness)
    damping = 2 * (SPRING * MASS) ** 0.5
    for step in range(1100):
        sunk = min(LOWERING * DT * step, GAP + DEPTH)
        for joint, rest, constant in (("peg x", x, 0.0), ("peg y", 0.0, 0.0), ("peg z", -sunk, MASS * GRAVITY)):
            q, qd = bench.at(joint)
            bench.loads[joint] = constant + SPRING * (rest - q) - damping * qd
        bench.step()
    return -bench.at("peg z")[0] - GAP


def pegs(folder, softness):
    for clearance in CLEARANCES:
        offsets = [2.2 * clearance * i / OFFSETS for i in range(1, OFFSETS + 1)]
        right = sum((lowered(folder, clearance, x, softness) > DEPTH / 2) == (x < clearance / 2) for x in offsets)
        yield f"peg, clearance {1000 * clearance:g} mm", "enters rightly", right
    yield "peg 0.02 mm too wide", "sinks in", 1000 * lowered(folder, -OVERSIZE, 0.0, softness)


def latch(folder, softness):
    for case, handle in (("door, handle at rest", 0.0), ("door, handle turned", 3.0)):
        bench = Bench(folder, "door", softness)
        bench.loads = {"handle": handle}
        for step in range(1000):
            if step == 500:
                bench.loads["hinge"] = 5.0
            bench.step()
        yield case, "opens in 1 s", 1000 * bench.at("hinge")[0]


def card(folder, softness):
    for share in SHARES:
        yield from held(folder, share, softness)
    for case in (dropped, wedged, pegs, latch):
        yield from case(folder, softness)


def main():
    with tempfile.TemporaryDirectory() as folder:
        command = ["cargo", "run", "--release", "--quiet", "-p", "physics", "--example", "contact_card", "--", "--mjcf", folder]
        subprocess.run(command, cwd=ROOT, check=True)
        soft, stiff = (list(card(Path(folder), time_constant)) for time_constant in (0.02, 2 * DT))
    with whole_file(OUT) as file:
        file.write(f"# MuJoCo {mujoco.__version__}, numpy {np.__version__}; made by scripts/mujoco_contact_card.py\n")
        file.write("case;quantity;mujoco;mujoco_stiff\n")
        for (case, quantity, a), (_, _, b) in zip(soft, stiff):
            file.write(f"{case};{quantity};{a:.4g};{b:.4g}\n")


if __name__ == "__main__":
    main()
