"""Learners of other packages run, and Stable-Baselines3's evaluation takes a policy of `train`."""

import gymnasium as gym
import numpy as np
import pytest
from common import ROOT, make

import aforce

stable_baselines3 = pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed")


def test_sac_runs_with_the_shipped_settings():
    env = make(scaled=True, horizon=50)
    settings = aforce.SB3_SAC | {"learning_starts": 100}
    model = stable_baselines3.SAC("MlpPolicy", env, seed=1, **settings).learn(300)
    assert model.num_timesteps == 300 and model._n_updates > 50


def as_a_picture(env):
    """Depth in the form in which Stable-Baselines3 takes a picture of floats: channel first, 0 to 1."""
    pixels = env.observation_space["pixels"]
    rows, columns, channels = pixels.shape
    space = gym.spaces.Dict({**env.observation_space, "pixels": gym.spaces.Box(0, 1, (channels, rows, columns), np.float32)})
    turned = lambda seen: {**seen, "pixels": seen["pixels"].transpose(2, 0, 1) / pixels.high.max()}  # noqa: E731
    return gym.wrappers.TransformObservation(env, turned, space)


@pytest.mark.parametrize("kind", ["rgb", "depth"])
def test_sac_learns_from_pixels_with_a_cnn(kind):
    from stable_baselines3.common.torch_layers import NatureCNN

    # Stable-Baselines3's network takes pictures of at least 36 pixels a side.
    env = make(scaled=True, horizon=100, observation={"camera": {"width": 40, "height": 40, "kind": kind}})
    env = env if kind == "rgb" else as_a_picture(env)
    policy = {"net_arch": [32], "normalize_images": kind == "rgb"}
    settings = {"buffer_size": 1000, "learning_starts": 100, "batch_size": 16, "train_freq": 5}
    model = stable_baselines3.SAC("MultiInputPolicy", env, seed=1, policy_kwargs=policy, **settings)
    assert isinstance(model.actor.features_extractor.extractors["pixels"], NatureCNN)
    layers = model.critic.features_extractor.extractors["pixels"]
    before = [weights.clone() for weights in layers.parameters()]
    model.learn(1000)
    assert model.num_timesteps == 1000 and model._n_updates > 150
    assert all(not old.equal(new) and new.isfinite().all() for old, new in zip(before, layers.parameters(), strict=True))


def test_ppo_runs_on_processes():
    from stable_baselines3.common.env_util import make_vec_env
    from stable_baselines3.common.vec_env import SubprocVecEnv

    envs = make_vec_env(
        "aforce:aforce/Wipe-v0", 2, seed=1, vec_env_cls=SubprocVecEnv, env_kwargs={"scaled": True, "horizon": 20}
    )
    model = stable_baselines3.PPO("MlpPolicy", envs, n_steps=32, batch_size=32, seed=1).learn(64)
    assert model.num_timesteps == 64
    envs.close()


def test_a_policy_of_train_is_evaluated():
    from stable_baselines3.common.evaluation import evaluate_policy
    from stable_baselines3.common.vec_env import DummyVecEnv

    (kept,) = (ROOT / "results" / "study" / "table-1" / "lift" / "osc").glob("seed_*")
    policy = aforce.Policy.load(kept)
    env = policy.make(horizon=20)
    observation, _ = env.reset(seed=1)
    total, truncated = 0.0, False
    while not truncated:
        observation, reward, _, truncated, _ = env.step(policy.predict(observation)[0])
        total += reward
    envs = DummyVecEnv([lambda: policy.make(horizon=20)])
    envs.seed(1)
    found, _ = evaluate_policy(policy, envs, n_eval_episodes=1, warn=False)
    assert found == pytest.approx(total, rel=1e-5)
