"""Learners of others run, and their evaluation takes what was learned here."""

import pytest
from common import ROOT, make

import aforce

stable_baselines3 = pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed")


def test_sac_runs_with_the_shipped_settings():
    env = make(scaled=True, horizon=50)
    settings = aforce.SB3_SAC | {"learning_starts": 100}
    model = stable_baselines3.SAC("MlpPolicy", env, seed=1, **settings).learn(300)
    assert model.num_timesteps == 300 and model._n_updates > 50


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
