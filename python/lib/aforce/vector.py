"""Several environments in one process, on several threads."""

import copy
import json
import os
from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.utils import EzPickle
from gymnasium.vector import AutoresetMode, VectorEnv as Base
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from ._native import Vector as Native
from .env import File, Floats, absolute, checked_scaled, checked_seed, maker, spaces_of
from .task import Makes


class VectorEnv(Base[Floats, Floats, NDArray[Any]], EzPickle):
    """`num_envs` environments that take their actions at the same time; made by
    `gymnasium.make_vec("aforce/Lift-v0", num_envs=8, threads=2)`.

    threads         number of threads; that of the processors if not given
    autoreset_mode  gymnasium.vector.AutoresetMode: NEXT_STEP, SAME_STEP (with `final_obs` and `final_info`) or DISABLED
    max_episode_steps  the horizon, unless `horizon` gives it; `gymnasium.make_vec` passes what it reads in an environment's spec

    Everything else as in `Env`, but a vector draws no pictures. Environment i of `reset(seed=s)` plays the episode of seed s + i.
    `info` has arrays.
    """

    def __init__(
        self,
        named: str | None = None,
        num_envs: int = 1,
        *,
        task: "Makes | str | None" = None,
        threads: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None,
        config: File | None = None,
        scaled: bool = False,
        render_mode: None = None,
        render_size: None = None,
        **settings: Any,
    ) -> None:
        for name, value in (("render_mode", render_mode), ("render_size", render_size)):
            if value is not None:
                raise ValueError(f"{name} = {value!r} is not allowed; allowed: None, a vector draws no pictures")
        for name, count in (("num_envs", num_envs), ("threads", threads)):
            if count is not None and not (isinstance(count, (int, np.integer)) and count >= 1):
                raise ValueError(f"{name} = {count!r} is not allowed; allowed: a whole number, 1 or above")
        config, settings = absolute(config, copy.deepcopy(settings))
        if settings.get("horizon") is None and max_episode_steps is not None:
            if not (isinstance(max_episode_steps, (int, np.integer)) and max_episode_steps >= 1):
                raise ValueError(f"max_episode_steps = {max_episode_steps!r} is not allowed; allowed: a whole number, 1 or above")
            settings["horizon"] = max_episode_steps
        EzPickle.__init__(
            self, named, num_envs, task=task, threads=threads, autoreset_mode=autoreset_mode, config=config, scaled=scaled, **settings
        )
        threads = len(os.sched_getaffinity(0)) if threads is None else threads
        made_by = maker(named, task, settings)
        self._native = Native(num_envs, threads, made_by, config, settings, checked_scaled(scaled))
        description = self.describe()
        if "pixels" in description:
            raise ValueError('observation.camera is not for this vector; allowed with vectorization_mode="sync" or "async"')
        horizon = description["env"]["horizon"]
        if max_episode_steps not in (None, horizon):
            raise ValueError(f"max_episode_steps = {max_episode_steps!r} is not allowed; allowed: None or the horizon, {horizon}")
        self.single_observation_space, self.single_action_space = spaces_of(description, scaled)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        if autoreset_mode not in list(AutoresetMode) and autoreset_mode not in (modes := [mode.value for mode in AutoresetMode]):
            raise ValueError(f"autoreset_mode = {autoreset_mode!r} is not allowed; allowed: an AutoresetMode or one of {', '.join(modes)}")
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        rate = description["env"]["controller"]["policy_hz"]
        self.metadata = {"render_modes": [], "render_fps": rate, "autoreset_mode": self.autoreset_mode}
        self.num_envs = num_envs
        self._ended = np.zeros(num_envs, bool)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Floats, dict[str, Any]]:
        """`seed`: a number, or one (or None) for each environment; `options={"reset_mask": mask}` resets some of them."""
        options = dict(options or {})
        mask = np.asarray(options.pop("reset_mask", np.ones(self.num_envs, bool)))
        if mask.shape != (self.num_envs,) or mask.dtype != bool or not mask.any():
            raise ValueError(f"reset_mask must be {self.num_envs} booleans, one of them true")
        if options:
            raise ValueError(f"reset has no option {next(iter(options))!r}")
        if np.iterable(seed):
            seeds = list(seed)
        else:
            first = checked_seed(seed, self.num_envs - 1)
            super().reset(seed=first)
            seeds = [None if first is None else first + i for i in range(self.num_envs)]
        if len(seeds) != self.num_envs:
            raise ValueError(f"{len(seeds)} seeds for {self.num_envs} environments")
        observations, info = self._native.reset([checked_seed(seed) for seed in seeds], mask.tolist())
        self._ended[mask] = False
        return observations, self._masked(info, mask)

    def step(
        self, actions: ArrayLike
    ) -> tuple[Floats, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Observations, rewards, terminated, truncated, info: arrays, one row for each environment."""
        if self.autoreset_mode == AutoresetMode.DISABLED and self._ended.any():
            raise RuntimeError(f"environment {self._ended.argmax()} has ended: reset it (reset_mask)")
        begins = self._ended if self.autoreset_mode == AutoresetMode.NEXT_STEP else np.zeros(self.num_envs, bool)
        if begins.any() and np.shape(actions) == self.action_space.shape:  # The actions of environments that begin an episode are ignored.
            actions = np.where(begins[:, None], 0, actions)
        observations, rewards, terminated, truncated, info = self._native.step(actions, begins.tolist())
        self._ended = terminated | truncated
        final: dict[str, Any] = {}
        if self.autoreset_mode == AutoresetMode.SAME_STEP and self._ended.any():
            ended, self._ended = self._ended, np.zeros(self.num_envs, bool)
            last = np.full(self.num_envs, None, object)
            for i in ended.nonzero()[0]:
                last[i] = observations[i].copy()
            final = {"final_obs": last, "_final_obs": ended}
            final |= {"final_info": self._masked(info, ended), "_final_info": ended.copy()}
            observations, begun = self._native.reset([None] * self.num_envs, ended.tolist())
            info = self._merged(info, begun, ended)
        return observations, rewards, terminated, truncated, self._masked(info, np.ones(self.num_envs, bool)) | final

    @classmethod
    def _merged(cls, info: dict[str, Any], other: dict[str, Any], mask: NDArray[np.bool_]) -> dict[str, Any]:
        """`info` with the rows of `other` for the environments in the mask."""
        merged: dict[str, Any] = {}
        for name, values in info.items():
            if isinstance(values, dict):
                merged[name] = cls._merged(values, other[name], mask)
            else:
                merged[name] = np.where(mask.reshape(-1, *[1] * (values.ndim - 1)), other[name], values)
        return merged

    @classmethod
    def _masked(cls, numbers: dict[str, Any], mask: NDArray[np.bool_]) -> dict[str, Any]:
        """Info in Gymnasium's form: beside each array `name` a mask `_name` of the environments for which it has numbers."""
        info: dict[str, Any] = {}
        for name, values in numbers.items() if mask.any() else ():
            nested = isinstance(values, dict)
            rows = mask if nested else mask.reshape(-1, *[1] * (values.ndim - 1))
            info[name] = cls._masked(values, mask) if nested else np.where(rows, values, values.dtype.type(0))
            info[f"_{name}"] = mask.copy()
        return info

    def expert_actions(self) -> Floats:
        """What the task's script would do now, a row for each environment."""
        return self._native.expert_actions()

    @property
    def episode_seeds(self) -> list[int]:
        """Seeds of the present episodes, one for each environment, with which `reset` of an `Env` or a vector starts them again."""
        return self._native.episode_seeds()

    def describe(self) -> dict[str, Any]:
        """As `Env.describe`: all environments are alike."""
        description: dict[str, Any] = json.loads(self._native.describe())
        return description

    def close_extras(self, **kwargs: Any) -> None:
        if hasattr(self, "_native"):  # Absent if the constructor failed: the object is closed then too.
            self._native.close()
