"""The law as a controller of robosuite 1.4: nothing in robosuite is edited.

    import aforce.robosuite
    env = robosuite.make("Lift", robots="Panda", controller_configs={"type": "AFORCE", "space": "aforce"}, ...)

Other keys of `controller_configs` are those of `aforce.Controller`: position_step, rotation_step, contact_axis, .. robosuite itself
sets dt, torque_limits and policy_hz.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from robosuite import macros
from robosuite.controllers.base_controller import Controller as Base
from robosuite.robots import single_arm

from ._native import Controller, Measurement

GRAVITY = 9.81
CUTOFF_HZ = 100.0  # Cut-off of the low-pass filter on the force, as in this package's own tasks.


class LawController(Base):
    """`aforce.Controller` between robosuite's actions and its torques."""

    def __init__(
        self,
        sim: Any,
        eef_name: str,
        joint_indexes: dict[str, Any],
        actuator_range: tuple[ArrayLike, ArrayLike],
        policy_freq: float,
        space: Any = "aforce",
        **settings: Any,
    ) -> None:
        own = sorted({"dt", "torque_limits", "policy_hz"} & settings.keys())
        if own:
            raise ValueError(f"controller_configs: {', '.join(own)} is not allowed; robosuite itself sets it")
        super().__init__(sim, eef_name, joint_indexes, actuator_range)
        for key in ("type", "robot_name", "eef_rot_offset", "ndim"):  # What robosuite adds and the law does not need.
            settings.pop(key)
        prefix = eef_name.removesuffix("grip_site")
        sensor = sim.model.sensor_name2id(f"{prefix}force_ee")
        self._sensor = slice(sim.model.sensor_adr[sensor], sim.model.sensor_adr[sensor] + 3)
        self._frame = sim.model.site_name2id(f"{prefix}ft_frame")
        # Weight of all that the sensor carries (N).
        self._weight = GRAVITY * sim.model.body_subtreemass[sim.model.site_bodyid[self._frame]]
        self._smoothing = 1.0 - np.exp(-2.0 * np.pi * CUTOFF_HZ * macros.SIMULATION_TIMESTEP)
        self._force = self._contact_force()
        limits = np.broadcast_to(self.actuator_max, (7,))
        if int(policy_freq) != policy_freq:
            raise ValueError(f"control_freq = {policy_freq} is not allowed; allowed: a whole number of actions a second")
        self.law = Controller(
            space, macros.SIMULATION_TIMESTEP, torque_limits=limits, policy_hz=int(policy_freq), **settings
        )
        self.law.reset(self._measurement())
        self.control_dim = self.law.dim
        self.input_min, self.input_max = -np.ones(self.law.dim), np.ones(self.law.dim)

    @property
    def name(self) -> str:
        return "AFORCE"

    def set_goal(self, action: ArrayLike) -> None:
        self.update()
        self.law.set_goal(action, self._measurement())

    def run_controller(self) -> NDArray[np.float64]:
        self.update()
        self._force = self._force + self._smoothing * (self._contact_force() - self._force)
        self.torques = self.law.update(self._measurement())
        super().run_controller()
        return self.torques

    def _contact_force(self) -> NDArray[np.float64]:
        """Force of the environment on the tool (N, world). The sensor reads minus the sum of this force and the weight."""
        rotation = self.sim.data.site_xmat[self._frame].reshape(3, 3)
        return np.array([0.0, 0.0, self._weight]) - rotation @ self.sim.data.sensordata[self._sensor]

    def _measurement(self) -> Measurement:
        return Measurement(
            q=self.joint_pos,
            qd=self.joint_vel,
            position=self.ee_pos,
            orientation=self.ee_ori_mat,
            jacobian=self.J_full,
            mass=self.mass_matrix,
            bias=self.torque_compensation,
            wrench=np.concatenate([self._force, np.zeros(3)]),  # The law reads no moment.
        )


_factory = single_arm.controller_factory


def _with_the_law(name: str, params: dict[str, Any]) -> Any:
    return LawController(**params) if name == "AFORCE" else _factory(name, params)


# Robots ask this function for their controller at every reset.
single_arm.controller_factory = _with_the_law
