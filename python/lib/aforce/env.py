"""One environment."""

import copy
import json
import os
from typing import Any, TypeAlias

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import EnvSpec, load_env_creator
from gymnasium.utils import EzPickle
from numpy.typing import ArrayLike, NDArray

from ._native import Env as Native
from .task import Makes, Task

File: TypeAlias = str | os.PathLike[str]
Floats: TypeAlias = NDArray[np.float32]
Box: TypeAlias = "gym.spaces.Box[np.float32]"  # In quotes, as older releases of Gymnasium have no parameter here.
Observation: TypeAlias = Any  # Floats, or a dict of them as `state` and of `pixels`.


# The longest side of a picture.
LARGEST = 8192


def checked_scaled(scaled: bool) -> bool:
    if not isinstance(scaled, bool | np.bool_):
        raise ValueError(f"scaled = {scaled!r} is not allowed; allowed: True or False")
    return bool(scaled)


def spaces_of(description: dict[str, Any], scaled: bool) -> tuple[Box, Box]:
    """Spaces of observation and action: finite where observations are scaled."""
    limit = description["scaled_limit"] if scaled else np.inf
    observation = gym.spaces.Box(-limit, limit, (len(description["observation"]),), np.float32)
    return observation, gym.spaces.Box(-1.0, 1.0, (len(description["action"]),), np.float32)


def with_pixels(description: dict[str, Any], numbers: Box) -> "gym.spaces.Space[Any]":
    """The space of observations: that of the numbers, or with an observed camera a dict of the numbers as `state` and of `pixels`."""
    form = description.get("pixels")
    if form is None:
        return numbers
    dtype = np.uint8 if form["shape"][-1] == 3 else np.float32
    return gym.spaces.Dict({"state": numbers, "pixels": gym.spaces.Box(0, form["high"], form["shape"], dtype)})


def absolute(config: File | None, settings: dict[str, Any]) -> tuple[str | None, dict[str, Any]]:
    """Both arguments with absolute paths of files: a copy of the environment may be made in another working directory."""
    for key, endings in (("space", (".toml",)), ("robot", (".toml", ".urdf"))):
        file = settings.get(key)
        if isinstance(file, os.PathLike) or isinstance(file, str) and file.endswith(endings):
            settings = {**settings, key: os.path.abspath(file)}
    return None if config is None else os.path.abspath(config), settings


def maker(named: str | None, task: "Makes | str | None", settings: dict[str, Any]) -> "Makes | str":
    """The name of a built-in task, or the class or function that makes a task of one's own."""
    if named is not None and not isinstance(named, str):
        raise TypeError(f"named = {named!r} is not allowed; allowed: a built-in task's name. A task of one's own is given as task=")
    if named is not None:
        if task is not None:
            settings["task"] = task  # Passed on as a setting, which is refused if it contradicts the name.
        return named
    if isinstance(task, str) and ":" in task:
        task = load_env_creator(task)
    if task is None or isinstance(task, str):
        raise TypeError(
            f"task = {task!r}: a class below aforce.Task, or its place \"module:Class\", is wanted; a built-in task has an environment of its own, "
            'as "aforce/Lift-v0"'
        )
    if isinstance(task, Task):
        raise TypeError(f"task is an object of {type(task).__name__}; its class is wanted, of which every environment makes one")
    if not callable(task) or isinstance(task, type) and not issubclass(task, Task):
        raise TypeError(f"task = {task!r}: a class below aforce.Task is wanted")
    return task


def checked_seed(seed: int | None, others: int = 0) -> int | None:
    """The seed as the simulation takes it, checked: it and the `others` that follow it must be whole numbers of 64 bits."""
    if seed is not None and not (isinstance(seed, (int, np.integer)) and not isinstance(seed, bool) and 0 <= seed < 2**64 - others):
        raise ValueError(f"seed = {seed!r} is not allowed; allowed: a whole number from 0 to 2**64 - {1 + others}")
    return None if seed is None else int(seed)


def checked_options(options: dict[str, Any] | None) -> None:
    if options:
        raise ValueError(f"reset has no option {next(iter(options))!r}")


class Env(gym.Env[Observation, Floats], EzPickle):
    """A robot, a task and an action space; made by `gymnasium.make("aforce/Lift-v0", ...)`, `Door-v0`, `Wipe-v0` or `Insert-v0`, and of a task of
    one's own by `aforce.Env(task=Drawer, ...)` or `gymnasium.make("aforce/Task-v0", task=Drawer, ...)`.

    task         a class below `aforce.Task`, its place as "module:Class", or a function without arguments that makes such an object
    space        name of `aforce.spaces()`, file, or dict: what an action is; "aforce" if not given
    config       path of a run's config.toml: its environment, on top of which keywords come
    scaled       whether every number of an observation is scaled to about 1, and clipped to 10
    render_mode  None or "rgb_array"
    render_size  width and height of a picture
    **settings   everything else that `env` of a configuration has, with the same names, defaults and messages: setup, robot,
                 horizon, controller, force_penalty, disturbance, observation, ends_on_success, stops, stop_price, motion_price, ..
                 None counts as not given

    `own_task` is the environment's object of that class, which a curriculum can change between episodes; None for built-in tasks.

    Observations and actions are float32; NaN or a wrong shape is a ValueError. An episode is truncated at its horizon, and
    terminated if the simulation diverges, if a task of one's own is lost or, with `stops=True`, where a real arm would have
    stopped itself. With `stop_price` it is truncated there, and the last reward is less by that price. `info`: is_success,
    stopped (a real arm would have stopped itself during this action), diverged (the simulation has), energy (J, of this action), force and hand_force (N,
    largest sustained of the whole arm, and beyond the wrist), joint_speed (of the joint nearest to its limit, as a share of that),
    penalty, motion_cost and stop_cost (reward lost to the prices of motion and of a stop), reward_terms, which, less these two, add
    up to the reward. With
    `observation={"critic": [..]}` also critic, from `reset` on: what a critic may see and the policy may not, scaled as an
    observation is; `describe()["critic"]` names its numbers. With `observation={"camera": {"width": 84, "height": 84,
    "kind": "depth", "from": "task"}}` an observation is a dict: those numbers as `state`, and `pixels`, shape (height, width, 1),
    float32 metres up to 5, or with `"kind": "rgb"` (height, width, 3), uint8. `"from": "hand"` looks along the tool.
    """

    _spec: EnvSpec | None = None
    observation_space: "gym.spaces.Space[Any]"
    action_space: Box
    metadata = {"render_modes": ["rgb_array"], "render_fps": 20}

    def __init__(
        self,
        named: str | None = None,
        *,
        task: "Makes | str | None" = None,
        config: File | None = None,
        scaled: bool = False,
        render_mode: str | None = None,
        render_size: tuple[int, int] = (480, 360),
        **settings: Any,
    ) -> None:
        config, settings = absolute(config, copy.deepcopy(settings))  # A pickle holds the settings as they are now.
        EzPickle.__init__(
            self, named, task=task, config=config, scaled=scaled, render_mode=render_mode, render_size=render_size, **settings
        )
        made_by = maker(named, task, settings)
        own = None if isinstance(made_by, str) else made_by()
        self.own_task = own
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ValueError(f'render_mode = {render_mode!r} is not allowed; allowed: None, "rgb_array"')
        self.scaled, self.render_mode = checked_scaled(scaled), render_mode
        sides = list(render_size) if np.iterable(render_size) else []
        whole = all(isinstance(side, int | np.integer) and not isinstance(side, bool) for side in sides)
        if len(sides) != 2 or not whole or not all(1 <= side <= LARGEST for side in sides):
            raise ValueError(f"render_size = {render_size!r} is not allowed; allowed: a width and a height, 1 to {LARGEST}")
        self._width, self._height = (int(side) for side in sides)
        self._native = Native(made_by if own is None else lambda: own, config, settings, self.scaled)
        description = self.describe()
        self.task: str = description["env"]["task"]
        self._horizon: int = description["env"]["horizon"]
        numbers, self.action_space = spaces_of(description, scaled)
        self.observation_space = with_pixels(description, numbers)
        self._has_pixels = "pixels" in description
        self.metadata = {**self.metadata, "render_fps": description["env"]["controller"]["policy_hz"]}

    @property
    def spec(self) -> EnvSpec | None:  # type: ignore[override]
        """The spec with which `gymnasium.make` made the environment. `max_episode_steps` is the horizon, at which the simulation itself
        truncates. If `make` was given one, a wrapper of gymnasium truncates too. Another length is asked for with `horizon`."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = spec
        if spec is not None:
            spec.max_episode_steps = self._horizon

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Observation, dict[str, Any]]:
        """Starts the episode of `seed`, which also fixes all later episodes that are reset without a seed."""
        checked_options(options)
        seed = checked_seed(seed)
        super().reset(seed=seed)
        observation, info = self._native.reset(seed)
        return self._seen(observation), info

    def step(self, action: ArrayLike) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        observation, *rest = self._native.step(action)
        return self._seen(observation), *rest

    def _seen(self, numbers: Floats) -> Observation:
        return {"state": numbers, "pixels": self._native.pixels()} if self._has_pixels else numbers

    def render(self) -> NDArray[np.uint8] | None:
        return self._native.render(self._width, self._height) if self.render_mode else None

    def close(self) -> None:
        self._native.close()

    def expert_action(self) -> Floats:
        """What the task's script would do now."""
        return self._native.expert_action()

    @property
    def episode_seed(self) -> int:
        """Seed of the present episode, with which `reset` starts it again."""
        return self._native.episode_seed()

    def describe(self) -> dict[str, Any]:
        """Entries of action and observation with unit, frame and scaling, reward terms, the action space's record and what
        follows from it, all settings: what `train --describe --json` prints."""
        description: dict[str, Any] = json.loads(self._native.describe())
        return description
