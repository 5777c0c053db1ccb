"""The native vector behaves like Gymnasium's vector of single environments."""

import copy
import pickle

import gymnasium as gym
import numpy as np
import pytest
from common import make
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import aforce


def vector(count=3, task="Lift", **keywords):
    return gym.make_vec(f"aforce/{task}-v0", num_envs=count, **keywords)


def same(a, b):
    """Checks that two infos are equal. The mask of the environments that have an entry stands under its name with a leading _."""
    assert a.keys() == b.keys()
    for key, value in a.items():
        if isinstance(value, dict):
            same(value, b[key])
        elif value.dtype == object:
            assert all(x is y is None or np.array_equal(x, y) for x, y in zip(value, b[key], strict=True))
        else:
            assert np.array_equal(value, b[key]), key


def reset_alike(ours, theirs, mask):
    """Whether some environments begin the same episodes in both vectors."""
    (a, our_info), (b, their_info) = (envs.reset(options={"reset_mask": mask}) for envs in (ours, theirs))
    same(our_info, their_info)
    return np.array_equal(a, b)


@pytest.mark.parametrize("critic", [[], ["contact", "task"]], ids=["plain", "critic"])
@pytest.mark.parametrize("threads", [1, 2, 5])
@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_it_does_what_gymnasiums_own_vector_does(mode, threads, critic):
    options = {"scaled": True, "horizon": 3, "observation": {"critic": critic}}
    ours = vector(autoreset_mode=mode, threads=threads, **options)
    theirs = SyncVectorEnv([lambda: make(**options)] * 3, autoreset_mode=mode)
    assert ours.metadata["autoreset_mode"] == mode
    assert (ours.observation_space, ours.action_space) == (theirs.observation_space, theirs.action_space)
    ours.action_space.seed(1)
    (a, our_info), (b, their_info) = ours.reset(seed=5), theirs.reset(seed=5)
    assert np.array_equal(a, b) and ("critic" in our_info) == bool(critic)
    same(our_info, their_info)
    ends = []
    for step in range(12):
        if step == 1:  # From here on environment 1 ends after the others.
            assert reset_alike(ours, theirs, np.array([False, True, False]))
        actions = ours.action_space.sample()
        (*a, our_info), (*b, their_info) = ours.step(actions), theirs.step(actions)
        assert all(np.array_equal(x, y) and x.dtype == y.dtype for x, y in zip(a, b, strict=True))
        same(our_info, their_info)
        ends.append(a[3].tolist())
        if mode == AutoresetMode.DISABLED and a[3].any():
            assert reset_alike(ours, theirs, a[3])
    assert [True, False, True] in ends and [False, True, False] in ends


def test_environment_i_plays_seed_plus_i():
    envs, single = vector(), make()
    observations, _ = envs.reset(seed=10)
    for i in range(3):
        assert np.array_equal(observations[i], single.reset(seed=10 + i)[0])
    observations, _ = envs.reset(seed=[4, None, 4])
    assert np.array_equal(observations[0], observations[2]) and not np.array_equal(observations[0], observations[1])
    seeds = envs.episode_seeds
    assert seeds[0] == seeds[2] == 4
    single.reset(seed=seeds[1])
    assert np.array_equal(envs.expert_actions()[1], single.unwrapped.expert_action())


def test_it_is_copied_anew_and_tells_its_seed():
    envs = vector(horizon=9)
    for other in (copy.deepcopy(envs), pickle.loads(pickle.dumps(envs))):
        assert np.array_equal(other.reset(seed=3)[0], envs.reset(seed=3)[0])
        assert (other.num_envs, other.autoreset_mode) == (envs.num_envs, envs.autoreset_mode)
    assert envs.np_random_seed == 3


def test_wrappers_for_vectors_take_it():
    envs = gym.wrappers.vector.RecordEpisodeStatistics(vector(horizon=3))
    envs = gym.wrappers.vector.NormalizeObservation(envs)
    envs.reset(seed=1)
    for _ in range(3):
        *_, info = envs.step(envs.action_space.sample())
    assert info["episode"]["l"].tolist() == [3, 3, 3]


def test_it_describes_what_each_environment_is():
    assert vector(horizon=9).describe() == make(horizon=9).unwrapped.describe()


def test_bad_input_is_answered():
    with pytest.raises(ValueError, match="threads = 0 is not allowed; allowed: a whole number, 1 or above"):
        vector(threads=0)
    with pytest.raises(ValueError, match="num_envs = -1 is not allowed"):
        vector(-1)
    with pytest.raises(TypeError, match='unknown key "env.horzon"'):
        vector(horzon=3)
    for picture in ({"render_mode": "rgb_array"}, {"render_size": (32, 24)}):
        with pytest.raises(ValueError, match="is not allowed; allowed: None, a vector draws no pictures"):
            vector(**picture)
    vector(render_mode=None, render_size=None).close()
    envs = vector(horizon=1, autoreset_mode=AutoresetMode.DISABLED)
    with pytest.raises(RuntimeError, match="call reset first"):
        envs.step(np.zeros((3, 7)))
    for bad in ({"seed": [1, 2]}, {"seed": -1}, {"seed": 1.5}, {"seed": 2**64 - 2}, {"options": {"reset_mask": [True]}}, {"options": {"x": 1}}):
        with pytest.raises(ValueError):
            envs.reset(**bad)
    envs.reset(seed=1)
    with pytest.raises(ValueError, match=r"action has shape \(2, 7\), must have \(3, 7\)"):
        envs.step(np.zeros((2, 7)))
    with pytest.raises(ValueError, match="entry 8 is NaN"):
        envs.step(np.where(np.arange(21).reshape(3, 7) == 8, np.nan, 0.0))
    envs.step(np.zeros((3, 7)))
    with pytest.raises(RuntimeError, match="environment 0 has ended"):
        envs.step(np.zeros((3, 7)))
    envs.close()
    with pytest.raises(RuntimeError, match="closed"):
        envs._native.step(np.zeros((3, 7)), [False] * 3)


def test_the_action_of_an_environment_that_begins_does_not_count():
    envs = vector(horizon=1)
    envs.reset(seed=1)
    envs.step(np.zeros((3, 7)))
    _, rewards, *_ = envs.step(np.full((3, 7), np.nan))
    assert rewards.tolist() == [0, 0, 0]


def test_it_is_made_of_a_single_environments_spec():
    single = gym.make("aforce/Lift-v0", horizon=20)
    vectors = gym.make_vec(single.spec, num_envs=2), gym.make_vec(single.spec, num_envs=2, vectorization_mode="sync")
    a, b = (envs.reset(seed=1)[0] for envs in vectors)
    assert np.array_equal(a, b)
    short = gym.make_vec("aforce/Lift-v0", num_envs=2, max_episode_steps=7)
    assert [envs.describe()["env"]["horizon"] for envs in (short, copy.deepcopy(short))] == [7, 7]
    with pytest.raises(ValueError, match="max_episode_steps = 1.5 is not allowed"):
        aforce.VectorEnv("lift", num_envs=2, max_episode_steps=1.5)
    for keyword, value in [("max_episode_steps", 21), ("threads", 0), ("threads", 1.5), ("num_envs", 0), ("autoreset_mode", "SAME_STEP")]:
        with pytest.raises(ValueError, match=f"{keyword} = {value!r} is not allowed"):
            aforce.VectorEnv("lift", **{"num_envs": 2, "horizon": 20} | {keyword: value})
    assert aforce.VectorEnv("lift", num_envs=2, autoreset_mode="SameStep").autoreset_mode == AutoresetMode.SAME_STEP
