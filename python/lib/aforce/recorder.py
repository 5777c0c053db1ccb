"""Episodes as pages for a browser."""

import os
import warnings
from typing import Any, SupportsFloat, cast

import gymnasium as gym

from .env import Env, File, Floats


class Recorder(gym.Wrapper[Floats, Floats, Floats, Floats]):
    """Writes every episode of an environment as an interactive page: `Recorder(env, "lift.html")`, one file that any browser
    opens, with the scene in three dimensions and all curves. The next episode replaces it, unless the name holds `{}`, which
    becomes the episode's number. An episode that is broken off is written at the next reset, or by `close`. One that began without
    the Recorder is not recorded, and a warning says so."""

    def __init__(self, env: gym.Env[Floats, Floats], path: File, who: str = "Python") -> None:
        super().__init__(env)
        if not isinstance(env.unwrapped, Env):
            raise TypeError(f"Recorder wants an environment of aforce, not {env.unwrapped}")
        self._path, self._who, self._episode = os.path.abspath(path), who, 0
        self._unwritten = self._written = self._over = False
        env.unwrapped._native.record()

    @property
    def unwrapped(self) -> Env:
        return cast(Env, self.env.unwrapped)

    def reset(self, **keywords: Any) -> tuple[Floats, dict[str, Any]]:
        self.write()
        self._episode += self._written
        self._written = self._over = False
        self.unwrapped._native.record()  # Once more, as a copy of the environment does not record by itself.
        return self.env.reset(**keywords)

    def step(self, action: Floats) -> tuple[Floats, SupportsFloat, bool, bool, dict[str, Any]]:
        result = self.env.step(action)
        self._unwritten = not self._over
        if self._unwritten and (result[2] or result[3]):
            self._over = True
            self.write()
        return result

    def write(self) -> None:
        """Writes what happened since the last reset, unless it is already written."""
        if not self._unwritten:
            return
        self._unwritten = False  # Also if writing fails, so that the next episode is not held up by this one.
        path = self._path.replace("{}", str(self._episode))
        self._written = self.unwrapped._native.write_page(path, self._who)
        if not self._written:
            warnings.warn(f"{path}: not written, for the episode began without the Recorder: reset through it", stacklevel=3)

    def close(self) -> None:
        try:
            self.write()
        finally:
            super().close()
