"""A task of one's own."""

from collections.abc import Callable, Mapping
from typing import Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ._native import State

# One number, or several.
Numbers: TypeAlias = "float | ArrayLike"


class Task:
    """Base class of a task of one's own. The subclass defines the scene, what is drawn, observed and rewarded, and success. Every environment
    makes an object of its own. When an environment is made it calls `reset`, `observe`, `reward` and `success` for a first time. Lengths are in
    metres, angles in radians; world axes with z up, quaternions x, y, z, w.

    scene        a dict, or the path of an MJCF (.xml) or URDF (.urdf) file, counted from the working directory. Floor,
                 table and robot are added to it
        table        {"height": 0.8, "centre": [0, 0], "size": [0.8, 0.8], "friction": 1}
        bodies       a list, parents before children, of dicts {"name", "parent", "pose", "joint", "mass" or "density", "shapes"},
                     or of files {"file", "pose"; for a URDF "free", "friction"}. The origin of an MJCF file's body with a joint is
                     the joint's "pos", here and in "poses"
        prediction   distance below which two shapes become a contact (m); a few times the clearance of a narrow hole
    tool         "gripper" or "wiping-tool"
    gripper      whether the last entry of an action moves the fingers
    name         the task's name in descriptions and pages; the class's name in kebab-case if it is None
    achievement  what success is: a verb and its object
    defaults     settings that differ from those of other tasks, with the keys of `env`: {"horizon": 300}
    scaling      by name of the observation, a pair of typical value and typical deviation; (0, 1) for the other names
    units        by name of the observation, its unit
    camera       {"eye": [..], "target": [..], "field_of_view": ..}, which takes the pictures
    disturbances of the scene's bodies and joints: {"stiff": {"joint_friction": "slide", "allowed": [0, 10]}}, drawn with
                 disturbance={"own": {"stiff": [0.5, 2]}}. Kinds: body_mass, body_friction, joint_friction, joint_damping (factors),
                 joint_spring (added, Nm/rad or N/m)

    A pose is a list of 3 (x, y, z), 4 (and the turn about z) or 7 numbers (and a quaternion). `joint` is "fixed" (the default), "free",
    or a dict with the axis, {"slide": [1, 0, 0]} or {"hinge": [0, 0, 1]}, and optionally name, range, damping, friction, armature, spring, rest,
    stop ([stiffness, damping]). A shape has one of box (half extents), sphere (radius), capsule and cylinder ([half length,
    radius]), points, mesh (an OBJ or STL file; with scale), hole ({"radius", "outer", "depth", "chamfer", "sectors"}), and name, pose,
    friction, color.

    Besides the methods below a class may have:

    script(state)          where a script goes next: {"position": [..], "grip": -1 opens, +1 closes, "force": N to press with}, and
                           "forward" (hand straight down, fingers open along it; with "turns": how many turns about z do as well) or
                           "quaternion"; without these the hand keeps its rotation
    advance(state)         called once after every action, before observe, reward and success, for what the object remembers. A reward of
                           progress needs both distances: `self.before, self.now = self.now, distance` here, their difference in reward
    lost(state)            whether the task can no longer be fulfilled: the episode is then terminated
    observe_critic(state)  as observe: what a critic may see besides the observation, with observation={"critic": ["task"]}
    marks()                discs that are drawn: a list of x, y, z, radius
    """

    scene: ClassVar[dict[str, Any] | str] = {}
    tool: ClassVar[str] = "gripper"
    gripper: ClassVar[bool] = True
    name: ClassVar[str | None] = None
    achievement: ClassVar[str] = "fulfils the task"
    defaults: ClassVar[dict[str, Any]] = {}
    scaling: ClassVar[Mapping[str, tuple[Numbers, Numbers]]] = {}
    units: ClassVar[Mapping[str, str]] = {}
    camera: ClassVar[dict[str, Any]] = {}
    disturbances: ClassVar[Mapping[str, dict[str, Any]]] = {}

    def reset(self, rng: np.random.Generator) -> dict[str, Any] | None:
        """Draws an episode from `rng`, which the episode's seed fixes. Returns what is different from the scene at the start, or None: "poses"
        (by body), "joints" (positions by joint), "arm" (7 joint angles), "fingers" (distance of the pads) and "holding" ({"body",
        "grip": its pose as seen from the tool point, "width": its size along x of the tool})."""
        return None

    def observe(self, state: State) -> dict[str, Numbers]:
        """Numbers by name: the same names with as many numbers every time. The robot's own numbers are added to them."""
        raise NotImplementedError(f"{type(self).__name__} has no observe(state)")

    def reward(self, state: State) -> dict[str, float] | float:
        """The terms that add up to the reward, at most sixteen: the same names every time."""
        raise NotImplementedError(f"{type(self).__name__} has no reward(state)")

    def success(self, state: State) -> bool:
        """Whether the task is fulfilled in this state."""
        raise NotImplementedError(f"{type(self).__name__} has no success(state)")


# A class of a task, or a function that makes one.
Makes: TypeAlias = Callable[[], Task]
