"""Contact tasks with the AFORCE control law: Gymnasium environments, and the law alone.

    import gymnasium as gym, aforce
    env = gym.make("aforce/Lift-v0", space="aforce", scaled=True)

The environments `aforce/Lift-v0`, `aforce/Door-v0`, `aforce/Wipe-v0`, `aforce/Insert-v0` and, for a `Task` of one's own, `aforce/Task-v0` are
registered by the import. See `Env`, `VectorEnv`, `Task`, `Controller`, `Measurement`, `Policy`, `Recorder`.
"""

from gymnasium import register

from ._native import TASKS, Controller, Measurement, Place, State, __version__, spaces
from .env import Env
from .policy import Policy
from .recorder import Recorder
from .sb3 import SB3_SAC
from .task import Task
from .vector import VectorEnv

__all__ = ["SB3_SAC", "Controller", "Env", "Measurement", "Place", "Policy", "Recorder", "State", "Task", "VectorEnv", "__version__", "spaces"]

for _task in TASKS:
    register(
        id=f"aforce/{_task.capitalize()}-v0",
        entry_point="aforce:Env",
        vector_entry_point="aforce:VectorEnv",
        kwargs={"named": _task},
    )

register(id="aforce/Task-v0", entry_point="aforce:Env", vector_entry_point="aforce:VectorEnv")
