"""The law alone: what it reads, and its errors. test_rust.py compares its torques with the golden vectors."""

import numpy as np
import pytest

import aforce

# Six axes that move the tool along and about the world's axes, and an idle seventh joint.
STILL = {
    "q": np.zeros(7),
    "qd": np.zeros(7),
    "position": [0.4, 0.0, 0.3],
    "orientation": [0.0, 0.0, 0.0, 1.0],
    "jacobian": np.eye(6, 7),
    "mass": np.eye(7),
    "bias": np.full(7, 0.5),
}


def measurement(**changes):
    return aforce.Measurement(**{**STILL, **changes})


def test_a_displaced_tool_is_pulled_back():
    law = aforce.Controller("mid")
    law.reset(measurement())
    tau = law.update(measurement(position=[0.41, 0.0, 0.3]))
    assert tau == pytest.approx([0.5 - 5.0, *[0.5] * 6]) and law.stiffness[0] == 500.0
    assert law.error[0] == pytest.approx(0.01) and law.wrench[0] == pytest.approx(-5.0)
    law.set_goal([1, 0, 0, 0, 0, 0], measurement())
    assert law.goal[0] == pytest.approx(0.45)
    law.update(measurement())
    assert law.set_point[0] == pytest.approx(0.402)


def test_orientation_is_a_quaternion_or_a_matrix():
    half = np.sqrt(0.5)
    turned = {"quaternion": [0, 0, half, half], "matrix": [[0, -1, 0], [1, 0, 0], [0, 0, 1]]}
    torques = []
    for orientation in (turned["quaternion"], turned["matrix"], np.array(turned["matrix"])):
        law = aforce.Controller("mid", torque_limits=[1e3] * 7)
        law.reset(measurement())
        torques.append(law.update(measurement(orientation=orientation)))
    assert torques[0][5] < -10
    np.testing.assert_allclose(torques[1:], [torques[0]] * 2, atol=1e-12)


def test_twist_follows_from_the_joints():
    qd = np.arange(7.0) / 10
    laws = [aforce.Controller("low"), aforce.Controller("low")]
    given = [measurement(qd=qd), measurement(qd=qd, twist=STILL["jacobian"] @ qd)]
    for law, y in zip(laws, given, strict=True):
        law.reset(y)
    assert np.array_equal(laws[0].update(given[0]), laws[1].update(given[1]))


def test_settings_have_the_names_of_the_configuration():
    law = aforce.Controller("variable", 0.001, policy_hz=50, position_step=0.01, force={"force_max": 30})
    assert law.dim == 12
    assert [entry["high"] for entry in law.entries()[6:7]] == [0.01]


def test_a_measurement_that_is_not_finite_is_a_fault_and_the_arm_is_held():
    law = aforce.Controller()
    law.reset(measurement())
    wrong = [{"qd": np.full(7, np.nan)}, {"orientation": [np.inf, 0, 0, 1]}, {"orientation": np.full((3, 3), np.inf)}]
    for faults, changes in enumerate(wrong, 1):
        assert law.update(measurement(**changes)).tolist() == STILL["bias"].tolist()
        assert law.faults == faults
        law.update(measurement())
        assert law.faults == faults


def test_the_contact_axis_turns():
    law = aforce.Controller("low-force")
    with pytest.raises(ValueError, match=r"contact_axis: \[0.0, 0.0, 0.0\] has no direction"):
        law.set_contact_axis([0, 0, 0])
    sideways = measurement(wrench=[10, 0, 0, 0, 0, 0])
    law.reset(sideways)
    for axis, engagement in (([0, 0, 1], 0.0), ([1, 0, 0], 1.0)):
        law.set_contact_axis(axis)
        for _ in range(100):
            law.update(sideways)
        assert law.engagement == engagement


@pytest.mark.parametrize(
    "words, arguments",
    [
        ("dt = 0.003 is not allowed", {"dt": 0.003}),
        ("dt = 0 is not allowed", {"dt": 0.0}),
        ("dt = NaN is not allowed", {"dt": np.nan}),
        ("did you mean `aforce`", {"space": "aforze"}),
        ("position_step = 3 is not allowed", {"position_step": 3}),
        ("control_hz is not allowed: dt = 0.002 s sets it", {"control_hz": 1000}),
        ("torque_limits has shape (3,), must have (7,)", {"torque_limits": [1, 2, 3]}),
        ("torque_limits.max (joint 2) = -1 is not allowed", {"torque_limits": [1, -1, 1, 1, 1, 1, 1]}),
        ("contact_axis: [0.0, 0.0, 0.0] has no direction", {"contact_axis": [0, 0, 0]}),
        ("contact_axis: [0.0, 0.0, 1e200] has no direction", {"contact_axis": [0, 0, 1e200]}),
        ("contact_axis: [inf, 0.0, 1.0] has no direction", {"contact_axis": [np.inf, 0, 1]}),
    ],
)
def test_bad_settings_are_answered(words, arguments):
    with pytest.raises(ValueError) as error:
        aforce.Controller(**arguments)
    assert words in str(error.value)


def test_an_unknown_keyword_is_a_type_error():
    with pytest.raises(TypeError, match='unknown key "env.controller.positon_step"; did you mean "env.controller.position_step"?'):
        aforce.Controller(positon_step=1)


@pytest.mark.parametrize(
    "kind, words, changes",
    [
        (ValueError, "q has shape (6,), must have (7,)", {"q": np.zeros(6)}),
        (ValueError, "jacobian has shape (7, 6), must have (6, 7)", {"jacobian": np.eye(7, 6)}),
        (ValueError, "orientation has length 2, a unit quaternion has 1", {"orientation": [0, 0, 0, 2.0]}),
        (ValueError, "orientation is no rotation matrix", {"orientation": -np.eye(3)}),
        (TypeError, "mass must be an array of numbers", {"mass": "heavy"}),
        (
            ValueError,
            "mass is not symmetric: mass[1, 0] = 0, mass[0, 1] = 0.5, a difference of 0.5",
            {"mass": np.triu(np.full((7, 7), 0.5))},
        ),
        (ValueError, "orientation has shape (2,), must have (4,)", {"orientation": [0, 1]}),
        (TypeError, "orientation must be an array of numbers", {"orientation": {"x": 1}}),
    ],
)
def test_bad_measurements_are_answered(kind, words, changes):
    with pytest.raises(kind) as error:
        measurement(**changes)
    assert words in str(error.value)


def test_what_an_array_has_to_say_is_told():
    class Gradient:
        def __array__(self, *_, **__):
            raise RuntimeError("detach it first")

    with pytest.raises(TypeError) as error:
        measurement(q=Gradient())
    assert "detach it first" in str(error.value.__cause__)


def test_bad_calls_are_answered():
    law = aforce.Controller()
    for early in (lambda: law.update(measurement()), lambda: law.set_goal(np.zeros(6), measurement())):
        with pytest.raises(RuntimeError, match="call reset first"):
            early()
    law.reset(measurement())
    with pytest.raises(ValueError, match=r"action has shape \(7,\), must have \(6,\)"):
        law.set_goal(np.zeros(7), measurement())
    with pytest.raises(ValueError, match="entry 0 is NaN"):
        law.set_goal(np.full(6, np.nan), measurement())
    with pytest.raises(TypeError):
        law.update({"q": np.zeros(7)})
