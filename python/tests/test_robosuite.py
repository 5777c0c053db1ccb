"""The law in robosuite, if robosuite is installed."""

import numpy as np
import pytest

robosuite = pytest.importorskip("robosuite", reason="robosuite is not installed: pip install robosuite==1.4.1 mujoco==3.2.7")

import aforce.robosuite  # noqa: E402, F401


def make(task, space, **settings):
    return robosuite.make(
        task,
        robots="Panda",
        controller_configs={"type": "AFORCE", "space": space, **settings},
        has_renderer=False,
        has_offscreen_renderer=False,
        use_camera_obs=False,
        initialization_noise=None,
    )


@pytest.mark.parametrize("task", ["Lift", "Wipe"])
def test_an_arm_at_rest_stays_and_feels_nothing(task):
    env = make(task, "high")
    env.reset()
    controller = env.robots[0].controller
    start, still = controller.ee_pos.copy(), np.zeros(env.action_dim)
    for _ in range(20):
        env.step(still)
    assert np.linalg.norm(controller.ee_pos - start) < 2e-3
    assert np.linalg.norm(controller._force) < 0.5 and controller.law.faults == 0


def test_an_action_moves_the_hand_where_it_says():
    env = make("Lift", "high", position_step=0.02)
    env.reset()
    controller = env.robots[0].controller
    start, action = controller.ee_pos.copy(), np.zeros(env.action_dim)
    action[1] = 1.0
    for _ in range(10):
        env.step(action)
    moved = controller.ee_pos - start
    assert moved[1] > 0.02 and np.abs(moved[[0, 2]]).max() < 0.02
    # The next episode has a new controller.
    env.reset()
    assert env.robots[0].controller is not controller


def test_other_controllers_are_as_they_were():
    config = robosuite.load_controller_config(default_controller="OSC_POSE")
    env = robosuite.make("Lift", robots="Panda", controller_configs=config, has_renderer=False, has_offscreen_renderer=False, use_camera_obs=False)
    assert env.robots[0].controller.name == "OSC_POSE"


def test_a_wrong_setting_is_answered():
    with pytest.raises(TypeError, match='did you mean "env.controller.position_step"'):
        make("Lift", "aforce", positon_step=0.1)
    with pytest.raises(ValueError, match="control_hz is not allowed"):
        make("Lift", "aforce", control_hz=1000)
    with pytest.raises(ValueError, match="policy_hz is not allowed; robosuite"):
        make("Lift", "aforce", policy_hz=20)
