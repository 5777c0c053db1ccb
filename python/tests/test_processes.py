"""The same bytes in every process, however it was started."""

import multiprocessing

import gymnasium as gym
import pytest
from common import digest, make


@pytest.mark.parametrize("start", ["fork", "spawn", "forkserver"])
def test_processes_compute_the_same(start):
    expected = digest()
    gym.make_vec("aforce/Lift-v0", num_envs=2, threads=2).reset(seed=1)  # Threads have run before the fork.
    with multiprocessing.get_context(start).Pool(2) as pool:
        assert pool.map(digest, ["Lift", "Lift"]) == [expected, expected]


def start(_):
    return make().reset()[0].tobytes()


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_without_a_seed_processes_play_other_episodes(method):
    make().reset()  # The parent has drawn a seed before the fork.
    with multiprocessing.get_context(method).Pool(3) as pool:
        starts = pool.map(start, range(3), chunksize=1)
    assert len(set(starts)) == 3


def vector_digest(_=None):
    envs = gym.make_vec("aforce/Lift-v0", num_envs=4, threads=2)
    envs.action_space.seed(1)
    envs.reset(seed=1)
    return b"".join(envs.step(envs.action_space.sample())[0].tobytes() for _ in range(5))


def test_a_vector_works_on_after_a_fork():
    expected = vector_digest()
    with multiprocessing.get_context("fork").Pool(1) as pool:
        assert pool.map_async(vector_digest, [None]).get(timeout=60) == [expected]


def test_gymnasiums_vector_of_processes_takes_the_environments():
    envs = gym.vector.AsyncVectorEnv([make, make], context="spawn")
    observations, _ = envs.reset(seed=3)
    assert (observations[0] == make().reset(seed=3)[0]).all()
    envs.close()
