"""Libraries of others step an environment as plain Gymnasium does: the same observations, rewards and ends, to the bit.

TorchRL's and Minari's tests run where these are installed beside the wheel. `make test-python` does not install them:

    target/venv/bin/pip install torchrl "minari[hdf5]" pillow
"""

import gymnasium as gym
import numpy as np
import pytest
from common import make

NAME = "aforce/Lift-v0"
OPTIONS = {"scaled": True, "horizon": 12}
SEED = 7


def actions(count=12):
    return np.random.default_rng(3).uniform(-1, 1, (count, make(**OPTIONS).action_space.shape[0])).astype(np.float32)


def plain(taken, seed=SEED):
    """Observations from the reset on, then rewards, ends and infos of each action."""
    env = make(**OPTIONS)
    first, info = env.reset(seed=seed)
    steps = [env.step(action) for action in taken]
    observations, rewards, terminated, truncated, infos = zip(*steps, strict=True)
    return np.array([first, *observations]), np.array(rewards), list(terminated), list(truncated), [info, *infos]


def test_time_aware_observation_counts_to_the_horizon():
    env = gym.wrappers.TimeAwareObservation(make(**OPTIONS), normalize_time=True)
    taken = actions()
    seen = [env.reset(seed=SEED)[0], *(env.step(action)[0] for action in taken)]
    observations, *_ = plain(taken)
    for index, (found, expected) in enumerate(zip(seen, observations, strict=True)):
        assert np.array_equal(found[:-1], expected)
        assert found[-1] == pytest.approx(index / OPTIONS["horizon"])


def test_torchrl_steps_as_gymnasium_does():
    envs = pytest.importorskip("torchrl.envs", reason="TorchRL is not installed")
    import torch

    env = envs.GymEnv(NAME, **OPTIONS)
    now = env.reset(seed=SEED)
    taken = actions()
    observations, rewards, terminated, truncated, _ = plain(taken)
    assert np.array_equal(now["observation"].numpy(), observations[0])
    for index, action in enumerate(taken):
        now = env.step(now.set("action", torch.from_numpy(action)))["next"]
        assert np.array_equal(now["observation"].numpy(), observations[index + 1])
        assert now["reward"].item() == np.float32(rewards[index])
        assert now["terminated"].item() == terminated[index]
        assert now["truncated"].item() == truncated[index] == (index == len(taken) - 1)
    env.close()


def test_minari_reads_back_what_was_recorded(tmp_path, monkeypatch):
    minari = pytest.importorskip("minari", reason="Minari is not installed")
    for needed in ("h5py", "PIL"):
        pytest.importorskip(needed, reason=f"Minari's files need {needed}")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    env = minari.DataCollector(make(**OPTIONS), record_infos=True)
    taken = actions()
    env.reset(seed=SEED)
    for action in taken:
        env.step(action)
    env.create_dataset("aforce/lift-v0", algorithm_name="random", description="a test")
    (episode,) = minari.load_dataset("aforce/lift-v0").iterate_episodes()
    observations, rewards, terminated, truncated, infos = plain(taken)
    assert np.array_equal(episode.observations, observations)
    assert np.array_equal(episode.actions, taken)
    assert np.array_equal(episode.rewards, rewards)
    assert list(episode.terminations) == terminated and list(episode.truncations) == truncated
    assert set(episode.infos) == set(infos[0])
    for name, values in episode.infos.items():
        if name != "reward_terms":
            assert np.array_equal(values, [info[name] for info in infos]), name
    for name, values in episode.infos["reward_terms"].items():
        assert np.array_equal(values, [info["reward_terms"][name] for info in infos]), name
