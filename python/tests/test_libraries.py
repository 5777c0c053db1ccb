"""Other libraries step an environment as plain Gymnasium does: the same observations, rewards and ends, to the bit.

A test is skipped unless its library is installed beside the wheel. `make test-python` installs none of them; this does:

    target/venv/bin/pip install torchrl "minari[hdf5]" pillow tianshou rl_zoo3 "ray[rllib]"
"""

import os
import subprocess
import sys

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


def test_tianshou_collects_an_episode():
    data = pytest.importorskip("tianshou.data", reason="Tianshou is not installed")
    from tianshou.algorithm.algorithm_base import Policy
    from tianshou.env import DummyVectorEnv

    taken = actions()

    class Given(Policy):
        """Takes the actions that are given, one after the other."""

        def forward(self, batch, state=None, **_):
            index = 0 if state is None else int(state["index"][0])
            return data.Batch(act=taken[index : index + 1], state={"index": np.array([index + 1])})

    env = make(**OPTIONS)
    policy = Given(action_space=env.action_space, observation_space=env.observation_space, action_scaling=False, action_bound_method=None)
    buffer = data.VectorReplayBuffer(100, 1)
    collector = data.Collector(policy, DummyVectorEnv([lambda: env]), buffer)
    collector.reset(gym_reset_kwargs={"seed": SEED})
    collected = collector.collect(n_episode=1)
    observations, rewards, terminated, truncated, _ = plain(taken)
    assert collected.n_collected_steps == len(taken)
    assert np.array_equal(buffer.obs[: len(taken)], observations[:-1])
    assert np.array_equal(buffer.obs_next[: len(taken)], observations[1:])
    assert np.array_equal(buffer.rew[: len(taken)], rewards)
    assert list(buffer.terminated[: len(taken)]) == terminated and list(buffer.truncated[: len(taken)]) == truncated


def test_rllib_samples_an_episode():
    ppo = pytest.importorskip("ray.rllib.algorithms.ppo", reason="RLlib is not installed")
    from ray.rllib.env.single_agent_env_runner import SingleAgentEnvRunner

    config = ppo.PPOConfig().environment(f"aforce:{NAME}", env_config=OPTIONS)
    config = config.env_runners(num_env_runners=0, num_envs_per_env_runner=1).debugging(seed=SEED)
    runner = SingleAgentEnvRunner(config=config, worker_index=0)
    (episode,) = runner.sample(num_episodes=1, random_actions=True)
    observations, rewards, _, truncated, _ = plain(np.array(episode.get_actions()), seed=SEED)
    assert len(episode) == OPTIONS["horizon"]
    assert np.array_equal(np.array(episode.get_observations()), observations)
    assert np.array_equal(np.array(episode.get_rewards()), rewards)
    assert episode.is_truncated and not episode.is_terminated and truncated[-1]
    runner.stop()


def test_rl_zoo3_trains(tmp_path):
    pytest.importorskip("rl_zoo3", reason="rl_zoo3 is not installed")
    settings = tmp_path / "sac.yml"
    settings.write_text(f"{NAME}:\n  policy: MlpPolicy\n  n_timesteps: 300\n  learning_starts: 100\n  batch_size: 16\n  normalize: true\n")
    options = ["--algo", "sac", "--env", NAME, "--gym-packages", "aforce", "--conf-file", str(settings), "--log-folder", str(tmp_path)]
    options += ["--env-kwargs", "scaled:True", "horizon:50", "--eval-freq", "200", "--eval-episodes", "1", "--n-eval-envs", "1"]
    command = [sys.executable, "-m", "rl_zoo3.train", *options, "--seed", "1"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, env={**os.environ, "CUDA_VISIBLE_DEVICES": ""})
    assert done.returncode == 0, done.stderr[-2000:]
    (run,) = (tmp_path / "sac").glob("*Lift-v0_1")
    scored = np.load(run / "evaluations.npz")
    assert list(scored["timesteps"]) == [200] and (scored["ep_lengths"] == 50).all()
    assert any(run.glob("*.zip"))
