"""What Python gets is what the Rust crates compute, to the last bit."""

import numpy as np
import pytest
from common import ROOT, cargo, make, rows

import aforce

tomllib = pytest.importorskip("tomllib", reason="Python 3.11 or later")

GOLDEN = ROOT / "crates" / "aforce" / "tests" / "golden"


@pytest.mark.parametrize("task, space", [("Lift", "aforce"), ("Door", "variable"), ("Wipe", "aforce-force")])
def test_a_thousand_actions_are_the_same(task, space):
    env = make(task, space=space, horizon=1001).unwrapped
    rng = np.random.default_rng(1)
    actions = rng.uniform(-1, 1, (1000, *env.action_space.shape)).astype(np.float32)
    text = "\n".join(",".join(repr(float(entry)) for entry in action) for action in actions)
    program = ["run", "--quiet", "--release", "--example", "episode", "--"]
    expected = cargo(*program, task.lower(), space, "42", "1001", input=text).splitlines()
    env.reset(seed=42)
    for action, line in zip(actions, expected, strict=True):
        observation, reward, *_, info = env.step(action)
        numbers = line.split(",")
        assert (reward, info["energy"]) == (float(numbers[0]), float(numbers[1]))
        assert np.array_equal(observation, np.array(numbers[2:-4], np.float32))
        cost = [info[name] for name in ("force", "hand_force", "joint_speed", "penalty")]
        assert cost == [float(number) for number in numbers[-4:]]


def measurements():
    def group(row, *names):
        return np.array([float(row[name]) for name in names])

    def joints(row, name):
        return group(row, *(f"{name}_{i}" for i in range(1, 8)))

    def matrix(row, name, count):
        return np.array([[float(row[f"{name}_{i}{j}"]) for j in range(1, 8)] for i in range(1, count + 1)])

    for row in rows(GOLDEN / "measurements.csv"):
        yield aforce.Measurement(
            q=joints(row, "q"),
            qd=joints(row, "qd"),
            position=group(row, "p_x", "p_y", "p_z"),
            orientation=group(row, "quat_x", "quat_y", "quat_z", "quat_w"),
            twist=group(row, "v_x", "v_y", "v_z", "w_x", "w_y", "w_z"),
            jacobian=matrix(row, "j", 6),
            mass=matrix(row, "m", 7),
            bias=joints(row, "bias"),
            wrench=group(row, "f_x", "f_y", "f_z", "m_x", "m_y", "m_z"),
        )


def test_the_law_keeps_to_the_golden_vectors():
    samples = list(measurements())
    actions = {int(row.pop("sample")): [float(entry) for entry in row.values()] for row in rows(GOLDEN / "actions.csv")}
    torques = list(rows(GOLDEN / "torques.csv"))
    assert len(torques) == len(aforce.spaces()) * len(samples)
    controllers = {name: aforce.Controller(name, torque_limits=[80] * 5 + [12] * 2) for name in aforce.spaces()}
    for row in torques:
        space, sample = row.pop("space"), int(row.pop("sample"))
        law, y = controllers[space], samples[sample]
        if sample == 0:
            law.reset(y)
        if sample in actions:
            law.set_goal(actions[sample][: law.dim], y)
        tau = law.update(y)
        force = [law.desired_force, law.force_command, law.engagement]
        found = [*tau, *law.own_stiffness, *law.feedforward, *force]
        assert found == [float(value) for value in row.values()], (space, sample)


def test_the_wheel_is_built_of_the_same_crates():
    def versions(lock):
        return {(package["name"], package["version"]) for package in tomllib.loads(lock.read_text())["package"]}

    ours, theirs = versions(ROOT / "python" / "Cargo.lock"), versions(ROOT / "Cargo.lock")
    names = {name for name, _ in ours} & {name for name, _ in theirs}
    assert {pair for pair in ours if pair[0] in names} <= theirs
    assert {"nalgebra", "rapier3d-f64", "parry3d-f64", "libm", "rand_chacha"} <= names
