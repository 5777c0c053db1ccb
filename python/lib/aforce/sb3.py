"""Settings for the learners of other packages."""

from typing import Any

SB3_SAC: dict[str, Any] = {
    "learning_rate": 5e-4,
    "batch_size": 128,
    "train_freq": 2,
    "gradient_steps": 1,
    "gamma": 0.97,
    "n_steps": 3,
    "learning_starts": 3300,
    "ent_coef": "auto_0.1",
}
"""Stable-Baselines3's SAC on these tasks, with scaled observations: `SAC("MlpPolicy", env, **SB3_SAC)`. Its own settings begin at a
temperature of 1, which outweighs what an action of Lift earns, at most 1, and learn nothing in 30 000 actions of Lift. `n_steps` wants release
2.7.0 or later."""
