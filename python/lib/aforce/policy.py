"""Policies that `train` has learned, played with numpy alone."""

import json
import struct
import time
import zipfile
import zlib
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from ._native import TASKS
from .env import File, Floats

FORMAT = 1


class Policy:
    """A trained policy: `Policy.load("runs/mine/lift/aforce/seed_1")`.

    task, space, step  what it was trained for, and after how many actions it was saved
    checkpoint         "best" or "last": which of its run's policies it is
    scaled             whether it expects scaled observations
    config             path of its run's config.toml, or of the .zip that has it
    """

    def __init__(
        self,
        layers: list[tuple[Floats, Floats]],
        log_std_range: tuple[float, float],
        *,
        task: str,
        space: str,
        step: int,
        checkpoint: str,
        scaled: bool,
        config: Path,
    ) -> None:
        self._layers, self._log_std_range = layers, log_std_range
        self.task, self.space, self.step, self.checkpoint = task, space, step, checkpoint
        self.scaled, self.config = scaled, config

    @classmethod
    def load(cls, run: File, checkpoint: str | None = None) -> "Policy":
        """The policy of a run folder: its "best" one, unless `checkpoint` is "last". A .zip of `archive` has one of the two."""
        run = Path(run).absolute()
        if run.suffix != ".zip":
            # A run that saves its state meanwhile renames the folder: then reading is tried again.
            for pause in (0.05, 0.1, 0.2):
                try:
                    return cls._read(run, checkpoint or "best", run / "config.toml")
                except (FileNotFoundError, ValueError):
                    time.sleep(pause)
            return cls._read(run, checkpoint or "best", run / "config.toml")
        try:
            with zipfile.ZipFile(run) as kept:
                files = zipfile.Path(kept)
                there = "last" if (files / "checkpoints" / "last").is_dir() else "best"
                return cls._read(files, checkpoint or there, run)
        except (zipfile.BadZipFile, zlib.error) as error:
            raise ValueError(f"{run}: no zip archive, or a damaged one: {error}") from None

    @classmethod
    def _read(cls, run: Path | zipfile.Path, checkpoint: str, config: Path) -> "Policy":
        folder, old = run / "checkpoints" / checkpoint, run / "checkpoints" / f".{checkpoint}.old"
        if not folder.is_dir() and old.is_dir():
            folder = old  # A run killed between the two renames of a save leaves the checkpoint under this name.
        if not folder.is_dir():
            raise FileNotFoundError(f"{folder}: no such checkpoint; a run folder of `train` or a .zip of `archive` is wanted")
        tensors, metadata = read_safetensors(folder / "actor.safetensors")
        try:
            return cls._of(folder, json.loads((folder / "state.json").read_text()), tensors, metadata, checkpoint, config)
        except (KeyError, TypeError, AttributeError, json.JSONDecodeError, UnicodeDecodeError) as error:
            raise ValueError(f"{folder / 'state.json'}: no state of a run, or a damaged one: {error!r}") from None

    @classmethod
    def _of(
        cls,
        folder: Path | zipfile.Path,
        state: dict[str, Any],
        tensors: dict[str, Floats],
        metadata: dict[str, str],
        checkpoint: str,
        config: Path,
    ) -> "Policy":
        if state["format"] != FORMAT:
            raise ValueError(f"{folder}: format {state['format']}, this version reads {FORMAT}")
        if metadata.get("updates", str(state["updates"])) != str(state["updates"]):
            seen = f"has seen {metadata['updates']} updates, state.json beside it {state['updates']}"
            raise ValueError(f"{folder / 'actor.safetensors'}: {seen}")
        layers = [
            (tensors[name], tensors[name.replace("weight", "bias")])
            for name in sorted((name for name in tensors if name.endswith("weight")), key=lambda n: int(n.split(".")[1]))
        ]
        sizes = [state["observation_dim"], *state["config"]["hidden"], 2 * state["action_dim"]]
        found = [layers[0][0].shape[1], *(weight.shape[0] for weight, _ in layers)] if layers else []
        if found != sizes:
            raise ValueError(f"{folder}: the network has layers of {found}, state.json says {sizes}")
        if not all(np.isfinite(part).all() for layer in layers for part in layer):
            raise ValueError(f"{folder}: a weight is not finite")
        made_for, learner = state["caller"], state["config"]
        return cls(
            layers,
            (learner["log_std_min"], learner["log_std_max"]),
            task=made_for["task"],
            space=made_for["space"],
            step=made_for["step"],
            checkpoint=checkpoint,
            scaled=learner["scaled_observations"],
            config=config,
        )

    def make(self, **keywords: Any) -> gym.Env[Floats, Floats]:
        """The environment in which the policy was trained; keywords change its settings."""
        if keywords.get("scaled") is None:
            keywords.pop("scaled", None)
        elif keywords["scaled"] != self.scaled:
            raise ValueError(f"scaled = {keywords['scaled']!r} is not allowed; allowed: {self.scaled}, as this policy was trained")
        if self.task not in TASKS:
            raise ValueError(
                f"task {self.task!r} is none of {', '.join(TASKS)}; a task written in Python: aforce.Env(task=YourTask, config={str(self.config)!r}, "
                f"scaled={self.scaled})"
            )
        own: dict[str, Any] = {"config": str(self.config), "scaled": self.scaled}
        return gym.make(f"aforce/{self.task.capitalize()}-v0", **own | keywords)

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
        *,
        rng: np.random.Generator | None = None,
    ) -> tuple[Floats, None]:
        """The action, or an array of actions, for an observation or an array of them, and None: Stable-Baselines3's form, so that
        its evaluate_policy takes a policy. There is no state: `state` and `episode_start` are ignored. If not `deterministic`, the
        action is a sample of the policy, drawn with `rng`, a numpy.random.Generator."""
        x = np.asarray(observation, np.float32)
        if x.shape[-1:] != self._layers[0][0].shape[1:]:
            raise ValueError(f"observation has shape {x.shape}, must end with {self._layers[0][0].shape[1]}")
        for weight, bias in self._layers[:-1]:
            x = np.maximum(x @ weight.T + bias, 0.0)
        weight, bias = self._layers[-1]
        mean, log_std = np.split(x @ weight.T + bias, 2, axis=-1)
        if not deterministic:
            low, high = self._log_std_range
            spread = np.exp(low + 0.5 * (high - low) * (np.tanh(log_std) + 1.0))
            mean = mean + spread * (rng or np.random.default_rng()).standard_normal(mean.shape, np.float32)
        return np.tanh(mean).astype(np.float32), None


def read_safetensors(path: Path | zipfile.Path) -> tuple[dict[str, Floats], dict[str, str]]:
    """The tensors of a file, all float32, by name, and its metadata."""
    data = path.read_bytes()
    try:
        (length,) = struct.unpack_from("<Q", data)
        header = json.loads(data[8 : 8 + length])
        metadata = header.pop("__metadata__", {})
        tensors = {}
        for name, entry in header.items():
            if entry["dtype"] != "F32":
                raise ValueError(f"{name} is {entry['dtype']}, not F32")
            begin, end = (8 + length + offset for offset in entry["data_offsets"])
            tensors[name] = np.frombuffer(data[begin:end], "<f4").reshape(entry["shape"])
        return tensors, metadata
    except (ValueError, KeyError, TypeError, AttributeError, struct.error) as error:
        raise ValueError(f"{path}: no file of weights: {error}") from None
