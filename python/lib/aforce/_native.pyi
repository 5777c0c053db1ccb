"""The types of the part that is written in Rust. SI units; world axes, linear part first."""

import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["TASKS", "Controller", "Env", "Measurement", "Place", "State", "Vector", "__version__", "spaces"]

_File: TypeAlias = str | os.PathLike[str]
_Floats: TypeAlias = NDArray[np.float32]
_Numbers: TypeAlias = NDArray[np.float64]

__version__: str
TASKS: list[str]
"""Names of the built-in tasks."""

def spaces() -> list[str]:
    """Names of the built-in action spaces."""

@final
class Measurement:
    """What the law reads of an arm at one control sample, at the tool point.

    q, qd        joint angles (rad) and velocities (rad/s); shapes (7,)
    position     of the tool (m); shape (3,)
    orientation  of the tool: a unit quaternion x, y, z, w, shape (4,), or a rotation matrix, shape (3, 3)
    jacobian     twist = jacobian @ qd; shape (6, 7)
    mass         joint mass matrix with rotor inertia (kg m2); shape (7, 7)
    bias         torques that hold the arm against gravity and Coriolis forces (Nm); shape (7,)
    wrench       what the environment exerts on the tool (N, Nm), 0 if not given; shape (6,)
    twist        velocity of the tool (m/s, rad/s), jacobian @ qd if not given; shape (6,)
    """

    def __new__(
        cls,
        *,
        q: ArrayLike,
        qd: ArrayLike,
        position: ArrayLike,
        orientation: ArrayLike,
        jacobian: ArrayLike,
        mass: ArrayLike,
        bias: ArrayLike,
        wrench: ArrayLike | None = None,
        twist: ArrayLike | None = None,
    ) -> Measurement: ...

@final
class Controller:
    """From the actions of an action space to joint torques: `reset`, then one `set_goal` for each action and one `update` for each
    control sample.

    space               a name of `spaces()`, a file, or a dict of changes; "aforce" if not given
    dt                  length of a control sample (s)
    torque_limits       largest torque of each joint (Nm), the Panda's if not given; shape (7,)
    torque_rate_limits  largest rate of each joint's torque (Nm/s), none if not given; shape (7,)
    contact_axis        direction in which the environment pushes on the tool, (0, 0, 1) if not given; shape (3,)
    settings            the keys of `env.controller` in a configuration, but for control_hz, which is 1/dt
    """

    def __new__(
        cls,
        space: _File | Mapping[str, Any] | None = None,
        dt: float = 0.002,
        *,
        torque_limits: ArrayLike | None = None,
        torque_rate_limits: ArrayLike | None = None,
        contact_axis: ArrayLike | None = None,
        **settings: Any,
    ) -> Controller: ...
    def reset(self, measurement: Measurement) -> None:
        """Begins an episode: goal at the measured pose, K at its initial value, no force."""

    def set_goal(self, action: ArrayLike, measurement: Measurement) -> None:
        """A new goal: one action of the space, shape (dim,), entries in [-1, 1] (others are clipped)."""

    def set_contact_axis(self, axis: ArrayLike) -> None:
        """Turns the contact axis, from the next control sample on and through a reset: the direction, world axes, in which the
        environment pushes on the tool; shape (3,)."""

    def update(self, measurement: Measurement) -> _Numbers:
        """The joint torques of one control sample (Nm), gravity compensation included; shape (7,)."""

    def entries(self) -> list[dict[str, Any]]:
        """What each entry of an action means: name, unit, frame, low, high."""

    @property
    def dim(self) -> int:
        """Number of entries of an action."""

    @property
    def stiffness(self) -> _Numbers:
        """K (N/m, Nm/rad; world axes), of which the share `engagement` does not act along the contact axis; shape (6,)."""

    @property
    def own_stiffness(self) -> _Numbers:
        """K in the space's own unit; shape (6,)."""

    @property
    def feedforward(self) -> _Numbers:
        """F_ff as it acts (N, Nm), which enters the torque law with a minus sign; shape (6,)."""

    @property
    def wrench(self) -> _Numbers:
        """Wrench with which the law has the tool push (N, Nm): -F_ff - F_cmd - K e - D e_dot; shape (6,)."""

    @property
    def error(self) -> _Numbers:
        """e = x - x_d of the latest sample (m, rad); shape (6,)."""

    @property
    def goal(self) -> _Numbers:
        """The goal of the latest action: position (m), quaternion x, y, z, w; shape (7,)."""

    @property
    def set_point(self) -> _Numbers:
        """The set-point of the latest sample: position (m), quaternion x, y, z, w; shape (7,)."""

    @property
    def desired_force(self) -> float:
        """F_d, to which force control holds the force along the contact axis (N); 0 without contact."""

    @property
    def force_command(self) -> float:
        """F_cmd, the output of force control along the contact axis (N)."""

    @property
    def engagement(self) -> float:
        """Share of the contact axis that force control has taken over, 0 to 1."""

    @property
    def saturated(self) -> list[bool]:
        """Whether each of the 7 joints' latest torque was cut by a limit."""

    @property
    def faults(self) -> int:
        """Samples since reset without a torque: measurement or torque was not finite, or the mass matrix not positive definite."""

@final
class Place:
    """Pose and velocity of a body or of the tool, world axes."""

    @property
    def position(self) -> _Numbers:
        """Origin of its frame (m); shape (3,)."""

    @property
    def quaternion(self) -> _Numbers:
        """Orientation as x, y, z, w; shape (4,)."""

    @property
    def rotation(self) -> _Numbers:
        """Rotation matrix with its axes as columns; shape (3, 3)."""

    @property
    def velocity(self) -> _Numbers:
        """Velocity of its origin (m/s); shape (3,)."""

    @property
    def angular_velocity(self) -> _Numbers:
        """Angular velocity (rad/s); shape (3,)."""

    def point(self, within: ArrayLike) -> _Numbers:
        """World position of a point that is given in its frame (m); shapes (3,)."""

@final
class State:
    """State of the simulation that a task's methods read, as it was when they were called. World axes, SI units."""

    @property
    def time(self) -> float:
        """Time since the start of the episode (s)."""

    @property
    def tool(self) -> Place:
        """The tool point: z out of the hand, x along which the fingers open."""

    @property
    def q(self) -> _Numbers:
        """Joint angles (rad); shape (7,)."""

    @property
    def qd(self) -> _Numbers:
        """Joint velocities (rad/s); shape (7,)."""

    @property
    def force(self) -> _Numbers:
        """Force of the environment on the hand, filtered (N); shape (3,)."""

    @property
    def torque(self) -> _Numbers:
        """Torque of the environment on the hand about the tool point, filtered (Nm); shape (3,)."""

    @property
    def contact_force(self) -> float:
        """Sustained force on the whole arm at this moment (N)."""

    @property
    def fingers(self) -> float | None:
        """Distance of the finger pads (m); None for a tool without fingers."""

    @property
    def penalty(self) -> float:
        """`force_penalty.weight` (0.05) times this action's largest force, if that is above the limit, else 0. Only `reward`, `success` and
        `lost` get it; elsewhere it is 0."""

    def body(self, name: str) -> Place:
        """Pose and velocity of a body of the scene; KeyError if there is none of this name."""

    def joint(self, name: str) -> float:
        """Position of a joint of the scene (rad or m)."""

    def joint_velocity(self, name: str) -> float:
        """Velocity of a joint of the scene (rad/s or m/s)."""

    def grasped(self, name: str) -> bool:
        """Whether each finger pad presses on the shape of this name, or on a shape of the body of this name. A mesh of several parts is one
        shape. Nothing presses before an episode's first action."""

@final
class Env:
    """An environment; Gymnasium's interface is `aforce.Env`."""

    def __new__(
        cls, task: str | Callable[[], object], config: _File | None, keywords: dict[str, Any], scaled: bool
    ) -> Env: ...
    def reset(self, seed: int | None) -> tuple[_Floats, dict[str, Any]]:
        """Starts an episode and returns its first observation, and info."""

    def step(self, action: ArrayLike) -> tuple[_Floats, float, bool, bool, dict[str, Any]]:
        """Observation, reward, terminated, truncated, info."""

    def pixels(self) -> NDArray[Any] | None:
        """What the observed camera sees now; shape (height, width, 1 or 3); None if no camera is observed."""

    def expert_action(self) -> _Floats:
        """What the task's script would do now."""

    def episode_seed(self) -> int:
        """Seed of the present episode."""

    def describe(self) -> str:
        """Description as JSON."""

    def render(self, width: int, height: int) -> NDArray[np.uint8]:
        """A picture; shape (height, width, 3)."""

    def record(self) -> None:
        """Episodes are recorded from the next reset on."""

    def write_page(self, path: _File, who: str) -> bool:
        """Writes the present episode, played by `who`, as a page; false if nothing of it is recorded."""

    def close(self) -> None: ...

@final
class Vector:
    """A vector of environments, one row of every array for each; Gymnasium's interface is `aforce.VectorEnv`."""

    def __new__(
        cls,
        count: int,
        threads: int,
        task: str | Callable[[], object],
        config: _File | None,
        keywords: dict[str, Any],
        scaled: bool,
    ) -> Vector: ...
    def reset(self, seeds: Sequence[int | None], which: Sequence[bool]) -> tuple[_Floats, dict[str, Any]]:
        """Starts an episode in each environment that `which` names, and returns all observations and info."""

    def step(
        self, actions: ArrayLike, reset: Sequence[bool]
    ) -> tuple[_Floats, _Numbers, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Observations, rewards, terminated, truncated, numbers of info. Those that `reset` names begin an episode instead."""

    def expert_actions(self) -> _Floats:
        """What the task's script would do now, a row for each environment."""

    def episode_seeds(self) -> list[int]:
        """Seeds of the present episodes."""

    def describe(self) -> str:
        """Description of one environment, for all are alike, as JSON."""

    def close(self) -> None: ...
