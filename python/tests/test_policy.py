"""Policies that `train` has saved play in Python."""

import json
import shutil
import zipfile

import numpy as np
import pytest
from common import ROOT, cargo, rows

from aforce import Policy

RESULTS = ROOT / "results"
ZOO = json.loads((RESULTS / "zoo.json").read_text())
STUDY = RESULTS / "study" / "table-1" / "lift"


def kept(space):
    """Path of the stored policy of a space."""
    (policy,) = (STUDY / space).glob("seed_*.zip")
    return policy


def unpacked(policy, folder):
    """A stored policy, unpacked into a run folder."""
    shutil.rmtree(folder, ignore_errors=True)
    with zipfile.ZipFile(policy) as archive:
        archive.extractall(folder)
    return folder


LIFT = kept("osc")


@pytest.mark.parametrize("entry", ZOO, ids=lambda entry: entry["run"])
def test_every_kept_policy_plays_in_its_environment(entry):
    policy = Policy.load(RESULTS / entry["file"])
    assert {key: getattr(policy, key) for key in ("task", "space", "checkpoint", "step")}.items() <= entry.items()
    env = policy.make()
    observation, _ = env.reset(seed=1)
    for _ in range(3):
        action, _ = policy.predict(observation)
        assert env.action_space.contains(action)
        observation, *_ = env.step(action)


@pytest.mark.skipif(not (ROOT / "target/release/replay").exists(), reason="no replay to compare with: cargo build --release")
def test_actions_are_those_of_the_programs(tmp_path):
    table = tmp_path / "episode.csv"
    cargo("run", "--quiet", "--release", "--bin", "replay", "--", "--run", str(LIFT), "--actions", "20", "--csv", str(table))
    policy = Policy.load(LIFT)
    description = policy.make().unwrapped.describe()
    parts = description["observation"]
    centre, scale = (np.array([part[key] for part in parts], np.float32) for key in ("centre", "scale"))
    played = list(rows(table))
    assert len(played) == 20
    for row in played:
        observation = np.array([row[f"Observation, {part['name']} ({part['unit']})"] for part in parts], np.float32)
        limit = description["scaled_limit"]
        action, _ = policy.predict(np.clip((observation - centre) * scale, -limit, limit))
        done = [float(row[f"Action, {entry['name']} (-1 to 1)"]) for entry in description["action"]]
        np.testing.assert_allclose(action, done, atol=2e-6)


def test_a_run_folder_and_its_archive_are_the_same_policy(tmp_path):
    ours, theirs = Policy.load(LIFT), Policy.load(unpacked(LIFT, tmp_path))
    observation = np.linspace(-1, 1, 42)
    assert np.array_equal(ours.predict(observation)[0], theirs.predict(observation)[0])
    assert ours.make().unwrapped.describe() == theirs.make().unwrapped.describe()
    with pytest.raises(FileNotFoundError, match="seed_.*zip/checkpoints/last.*no such checkpoint"):
        Policy.load(LIFT, "last")


def test_a_file_may_hold_the_last_policy_of_its_run(tmp_path):
    last = tmp_path / "seed_1.zip"
    with zipfile.ZipFile(LIFT) as best, zipfile.ZipFile(last, "w") as kept:
        for name in best.namelist():
            kept.writestr(name.replace("/best/", "/last/"), best.read(name))
    observation = np.linspace(-1, 1, 42)
    assert np.array_equal(Policy.load(last).predict(observation)[0], Policy.load(LIFT).predict(observation)[0])
    with pytest.raises(FileNotFoundError, match="checkpoints/best.*no such checkpoint"):
        Policy.load(last, "best")


def test_it_knows_its_file_and_its_scaling_from_every_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(LIFT.parent)
    policy = Policy.load(LIFT.name)
    monkeypatch.chdir(tmp_path)
    assert policy.make(horizon=3).unwrapped.scaled is policy.scaled is True
    with pytest.raises(ValueError, match="scaled = False is not allowed; allowed: True, as this policy was trained"):
        policy.make(scaled=False)
    policy.task = "drawer"
    with pytest.raises(ValueError, match="task 'drawer' is none of lift, door, wipe, insert"):
        policy.make()


def test_it_is_called_as_stable_baselines3_calls_a_model():
    policy, observations = Policy.load(LIFT), np.zeros((2, 42), np.float32)
    actions, state = policy.predict(observations, state=None, episode_start=np.ones(2, bool), deterministic=True)
    assert state is None and np.array_equal(actions, policy.predict(observations, None, np.ones(2, bool), True)[0])


def test_a_sample_scatters_about_the_mean():
    policy = Policy.load(LIFT)
    observation = np.zeros((500, 42), np.float32)
    sampled, _ = policy.predict(observation, deterministic=False, rng=np.random.default_rng(1))
    mean, _ = policy.predict(observation)
    assert sampled.shape == mean.shape == (500, 7) and np.ptp(mean, axis=0).max() < 1e-6
    off = np.arctanh(np.clip(sampled, -0.999999, 0.999999)) - np.arctanh(mean)
    assert (np.abs(off.mean(axis=0)) < 0.25 * off.std(axis=0)).all() and off.std() > 0.01


def test_what_is_no_policy_is_answered(tmp_path):
    with pytest.raises(FileNotFoundError, match="no such checkpoint; a run folder"):
        Policy.load(tmp_path)
    with pytest.raises(ValueError, match="must end with 42"):
        Policy.load(LIFT).predict(np.zeros(3))

    broken = tmp_path / "broken.zip"
    whole = LIFT.read_bytes()
    middle = len(whole) // 2
    flipped = whole[:middle] + bytes([whole[middle] ^ 1]) + whole[middle + 1 :]
    for data in [b"", whole[:-30], flipped]:
        broken.write_bytes(data)
        with pytest.raises(ValueError, match="broken.zip: no zip archive, or a damaged one"):
            Policy.load(broken)

    def damaged(change):
        run = unpacked(LIFT, tmp_path / "run")
        change(run / "checkpoints" / "best")
        return run

    def weights(folder, to):
        file = folder / "actor.safetensors"
        file.write_bytes(to(file.read_bytes()))

    for change, words in [
        (lambda folder: weights(folder, lambda data: data[:-400] + b"\xff" * 400), "not finite"),
        (lambda folder: weights(folder, lambda data: data[:1000]), "no file of weights"),
        (lambda folder: weights(folder, lambda data: b""), "no file of weights"),
        (lambda folder: (folder / "state.json").write_text('{"format": 9}'), "format 9, this version reads 1"),
        (lambda folder: (folder / "state.json").write_text("{}"), "state.json: no state of a run, or a damaged one: KeyError"),
        (lambda folder: (folder / "state.json").write_text("{"), "state.json: no state of a run, or a damaged one: JSONDecodeError"),
        (lambda folder: (folder / "actor.safetensors").write_bytes(b"\2" + 7 * b"\0" + b"[]"), "actor.safetensors: no file of weights"),
    ]:
        with pytest.raises(ValueError, match=words):
            Policy.load(damaged(change))


def test_weights_of_another_state_are_refused(tmp_path):
    ours, theirs = (unpacked(kept(space), tmp_path / space) for space in ("aforce", "osc"))
    assert Policy.load(ours).task == "lift"
    weights = "checkpoints/best/actor.safetensors"
    shutil.copy(theirs / weights, ours / weights)
    with pytest.raises(ValueError, match="updates, state.json beside it"):
        Policy.load(ours)
