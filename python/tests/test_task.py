"""Tasks that are written in Python."""

import copy
import functools
import importlib.util
import pickle
import sys
import warnings

import gymnasium as gym
import numpy as np
import pytest
from common import ROOT
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import aforce


def example(name):
    """The class in an example's file, as if the file had been imported."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "python" / "examples" / f"{name}.py")
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return getattr(module, name.capitalize())


EXAMPLES = {name: example(name) for name in ("reach", "drawer", "plug")}
Reach, Drawer = EXAMPLES["reach"], EXAMPLES["drawer"]


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_has_forty_lines(name):
    assert len((ROOT / "python" / "examples" / f"{name}.py").read_text().splitlines()) <= 40


@pytest.mark.parametrize("space", ["aforce", "osc", "aforce-force"])
@pytest.mark.parametrize("name", EXAMPLES)
def test_the_script_does_every_example(name, space):
    env = gym.make("aforce/Task-v0", task=EXAMPLES[name], space=space, horizon=500)
    for seed in range(3):
        env.reset(seed=seed)
        over = False
        while not over:
            *_, terminated, truncated, info = env.step(env.unwrapped.expert_action())
            over = terminated or truncated
            assert info["force"] < 100
        assert info["is_success"] and not terminated, seed


@pytest.mark.parametrize("space", aforce.spaces())
@pytest.mark.parametrize("name", EXAMPLES)
def test_checkers_pass(name, space):
    env = aforce.Env(task=EXAMPLES[name], space=space, scaled=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env, skip_render_check=True)


def test_a_task_has_what_the_built_in_ones_have(tmp_path):
    env = aforce.Recorder(
        gym.make(
            "aforce/Task-v0",
            task=Drawer,
            robot="iiwa14",
            disturbance={"friction": [0.5, 2], "own": {"slide_friction": [0.5, 2]}},
            observation={"force": True, "controller": True, "critic": ["disturbance", "contact"], "camera": {"width": 20, "height": 10}},
            render_mode="rgb_array",
        ),
        tmp_path / "drawer.html",
    )
    observation, info = env.reset(seed=1)
    assert observation["pixels"].shape == (10, 20, 1) and info["critic"][1] != info["critic"][0]
    *_, info = env.step(env.action_space.sample())
    assert list(info["reward_terms"]) == ["reach", "grasp", "open"] and info["energy"] > 0
    assert env.render().std() > 10
    env.close()
    assert "drawer aforce" in (tmp_path / "drawer.html").read_text()
    description = aforce.Env(task=Drawer).describe()
    assert description["env"]["task"] == "drawer" and description["env"]["horizon"] == 300
    entry = next(entry for entry in description["observation"] if entry["name"] == "knob_to_eef_z")
    assert (entry["centre"], entry["scale"]) == (0, 10)
    assert [entry["name"] for entry in aforce.Env(task=Reach).describe()["action"]][-1] != "gripper"


def test_an_episode_is_a_function_of_its_seed_and_copies_make_it_anew():
    env = aforce.Env(task=Drawer)
    first, _ = env.reset(seed=7)
    step = env.step(np.ones(7))[0]
    for other in (env, pickle.loads(pickle.dumps(env)), copy.deepcopy(env), aforce.Env(task=functools.partial(Drawer))):
        assert np.array_equal(other.reset(seed=7)[0], first) and np.array_equal(other.step(np.ones(7))[0], step)
    assert not np.array_equal(env.reset(seed=8)[0], first)
    assert isinstance(env.own_task, Drawer) and aforce.Env("lift").own_task is None
    assert np.array_equal(aforce.Env(task="drawer:Drawer").reset(seed=7)[0], first)


class Button(aforce.Task):
    """A mass of one gram on a spring so stiff that the simulation diverges."""

    scene = {
        "bodies": [
            {
                "name": "cap",
                "pose": [0.1, 0.1, 0.83],
                "mass": 0.001,
                "shapes": [{"cylinder": [0.005, 0.01]}],
                "joint": {"slide": [0, 0, 1], "name": "press", "range": [-0.01, 0.0], "spring": 2000, "rest": 0.0},
            }
        ]
    }

    def observe(self, state):
        return {"z": state.joint("press")}

    def reward(self, state):
        return 0.0

    def success(self, state):
        return False


def test_a_simulation_that_diverges_says_so():
    for substeps in (1, 4):
        env = aforce.Env(task=Button, simulation={"substeps": substeps})
        env.reset(seed=1)
        observation, _, terminated, _, info = env.step(np.zeros(7))
        assert terminated and info["diverged"] and abs(observation[0]) < 10


class Lost(Reach):
    """Lost with the third action."""

    def reset(self, rng):
        self.actions = 0
        super().reset(rng)

    def advance(self, state):
        self.actions += 1

    def lost(self, state):
        return self.actions == 3


def test_an_episode_is_terminated_where_the_task_is_lost():
    env = aforce.Env(task=Lost)
    for _ in range(2):
        env.reset(seed=1)
        ends = [env.step(np.zeros(6))[2:4] for _ in range(3)]
        assert ends == [(False, False), (False, False), (True, False)]


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_the_vector_is_gymnasiums(mode):
    ours = gym.make_vec("aforce/Task-v0", num_envs=3, threads=2, task=Drawer, horizon=3, autoreset_mode=mode)
    theirs = SyncVectorEnv([lambda: gym.make("aforce/Task-v0", task=Drawer, horizon=3)] * 3, autoreset_mode=mode)
    assert np.array_equal(ours.reset(seed=5)[0], theirs.reset(seed=5)[0])
    for _ in range(5):
        actions = ours.action_space.sample()
        (*a, one), (*b, two) = ours.step(actions), theirs.step(actions)
        assert all(np.array_equal(x, y) for x, y in zip(a, b, strict=True)) and one.keys() == two.keys()


class Plain(aforce.Task):
    """A task without errors. Tests change one part of it."""

    scene = {"bodies": [{"name": "ball", "joint": "free", "pose": [0, 0, 0.83], "mass": 0.1, "shapes": [{"sphere": 0.03}]}]}

    def observe(self, state):
        return {"ball": state.body("ball").position}

    def reward(self, state):
        return 0.5

    def success(self, state):
        return False


def with_scene(*bodies, **scene):
    return type("Wrong", (Plain,), {"scene": {"bodies": [*Plain.scene["bodies"], *bodies], **scene}})


def returning(method, value):
    return type("Wrong", (Plain,), {method: lambda self, _: value})


def block(**keys):
    return {"name": "block", "mass": 1, "shapes": [{"box": [0.1, 0.1, 0.1]}], "pose": [0, 0.3, 0.95], **keys}


def test_a_state_tells_what_is():
    seen = {}

    class Looks(Plain):
        scene = {"bodies": [
            {"name": "door", "pose": [0, 0.3, 0.9, np.pi / 2], "density": 500, "shapes": [{"box": [0.05, 0.01, 0.05], "pose": [0.05, 0, 0]}],
             "joint": {"hinge": [0, 0, 1], "name": "hinge", "range": [-1, 1], "damping": 0.1}},
        ]}

        def reset(self, rng):
            return {"joints": {"hinge": 0.5}, "fingers": 0.05}

        def observe(self, state):
            seen["state"] = state
            return {"angle": state.joint("hinge")}

    env = aforce.Env(task=Looks, initial_noise=0.0, disturbance={"hinge_damping": 2.0})
    observation, _ = env.reset(seed=1)
    state = seen["state"]
    assert observation[0] == np.float32(0.5) == np.float32(state.joint("hinge")) and state.joint_velocity("hinge") == 0
    assert state.time == 0 and state.fingers == pytest.approx(0.05) and not state.grasped("door")
    door = state.body("door")
    angle = np.pi / 2 + 0.5
    assert np.allclose(door.point([1, 0, 0]) - door.position, [np.cos(angle), np.sin(angle), 0])
    assert np.allclose(door.rotation[:, 0], [np.cos(angle), np.sin(angle), 0])
    assert np.allclose(door.quaternion, [0, 0, np.sin(angle / 2), np.cos(angle / 2)])
    assert np.allclose(state.tool.position, observation[1 + 21 : 1 + 24]) and state.q.shape == (7,)
    assert not state.force.any() and state.contact_force == 0
    env.step(np.zeros(7))
    assert seen["state"].time == pytest.approx(0.05) and state.time == 0, "a state stays what it was"
    with pytest.raises(KeyError, match="no joint \\\\?\"hinj\\\\?\"; known are hinge"):
        state.joint("hinj")


def test_velocities_are_those_of_origins_at_the_moment():
    seen = {}

    class Swings(Plain):
        scene = {"bodies": [
            {"name": "door", "pose": [0, 0.3, 0.9], "density": 500, "shapes": [{"box": [0.05, 0.01, 0.05], "pose": [0.05, 0, 0]}],
             "joint": {"hinge": [0, 0, 1], "name": "hinge", "range": [-2, 2], "spring": 2.0, "rest": 1.0}},
            {"name": "knob", "parent": "door", "pose": [0.1, 0, 0.02], "mass": 0.1, "shapes": [{"sphere": 0.01}]},
        ]}

        def observe(self, state):
            seen["state"] = state
            return {"angle": state.joint("hinge")}

    env = aforce.Env(task=Swings, initial_noise=0.0)
    env.reset(seed=1)
    for _ in range(3):
        env.step(np.zeros(7))
        state = seen["state"]
        turning = np.array([0, 0, state.joint_velocity("hinge")])
        door, knob = state.body("door"), state.body("knob")
        assert abs(turning[2]) > 0.1 and np.allclose(knob.angular_velocity, turning, atol=1e-12)
        assert np.allclose(door.velocity, 0, atol=1e-12)
        assert np.allclose(knob.velocity, np.cross(turning, knob.position - door.position), atol=1e-12)


def test_what_a_joint_carries_comes_into_the_hand_too():
    class Holds(Plain):
        scene = {"bodies": [
            {"name": "box", "joint": "free", "pose": [0, 0.3, 0.85], "mass": 0.1, "shapes": [{"box": [0.02, 0.02, 0.02]}]},
            {"name": "lid", "parent": "box", "pose": [0, 0.03, 0], "mass": 0.02, "shapes": [{"box": [0.01, 0.005, 0.01]}],
             "joint": {"hinge": [1, 0, 0], "name": "lid", "range": [-1, 1], "damping": 0.01}},
        ]}

        def reset(self, rng):
            return {"holding": {"body": "box", "width": 0.04}}

        def observe(self, state):
            return {"tool": state.tool.position, "box": state.body("box").position, "lid": state.body("lid").position}

    env = aforce.Env(task=Holds, initial_noise=0.0)
    observation, _ = env.reset(seed=1)
    for steps in range(5):
        tool, box, lid = observation[:3], observation[3:6], observation[6:9]
        assert np.linalg.norm(box - tool) < 0.005 and np.linalg.norm(lid - box) == pytest.approx(0.03, abs=1e-4), steps
        observation, *_ = env.step([0, 0, 0, 0, 0, 0, 1])


def solid(low, high, first):
    """A box in the lines of an OBJ file, whose corners count from `first`."""
    corners = [[(low, high)[i >> axis & 1][axis] for axis in range(3)] for i in range(8)]
    faces = [(0, 2, 6, 4), (1, 3, 7, 5), (0, 1, 5, 4), (2, 3, 7, 6), (0, 1, 3, 2), (4, 5, 7, 6)]
    lines = [f"o part{first}", *(f"v {x} {y} {z}" for x, y, z in corners), *("f " + " ".join(str(first + i) for i in face) for face in faces)]
    return "\n".join(lines) + "\n"


def test_pads_that_press_on_two_parts_grasp_what_is_between_them(tmp_path):
    """A cube of two halves, each before one finger."""
    seen = {}
    halves = [([-0.02, -0.02, -0.02], [0, 0.02, 0.02]), ([0, -0.02, -0.02], [0.02, 0.02, 0.02])]
    (tmp_path / "cube.obj").write_text("".join(solid(*ends, 1 + 8 * i) for i, ends in enumerate(halves)))
    boxes = [{"name": name, "box": [0.01, 0.02, 0.02], "pose": [x, 0, 0]} for name, x in (("one", -0.01), ("other", 0.01))]

    def grasped(shapes, *names, actions=5):
        class Holds(Plain):
            scene = {"bodies": [{"name": "cube", "joint": "free", "pose": [0, 0.3, 0.85], "mass": 0.1, "shapes": shapes}]}

            def reset(self, rng):
                return {"holding": {"body": "cube", "width": 0.04}}

            def observe(self, state):
                seen["state"] = state
                return {"cube": state.body("cube").position}

        env = aforce.Env(task=Holds, initial_noise=0.0)
        env.reset(seed=1)
        for _ in range(actions):
            env.step([0, 0, 0, 0, 0, 0, 1])
        return [seen["state"].grasped(name) for name in names]

    mesh = [{"name": "halves", "mesh": str(tmp_path / "cube.obj")}]
    assert grasped(mesh, "halves", "cube") == [True, True]
    with pytest.raises(KeyError) as error:
        seen["state"].grasped("halves_1")
    assert str(error.value).count("halves") == 2, "the name asked for, and the shape's once"
    assert grasped(mesh, "halves", "cube", actions=0) == [False, False], "nothing presses at first"
    assert grasped(boxes, "cube", "one", "other") == [True, False, False], "each pad presses on one of them"


@pytest.mark.parametrize(
    "kind, words, task",
    [
        (ValueError, 'body "block": it is free and has a mass of 0 kg', with_scene({"name": "block", "joint": "free", "shapes": [{"sphere": 0.1}], "pose": [0, 0.3, 0.95]})),
        (ValueError, 'body "block": it is free and nothing that stands still is below it', with_scene(block(joint="free", pose=[9, 0, 1]))),
        (ValueError, 'body "block": joint "block" moves a body without mass', with_scene({"name": "block", "joint": {"slide": [1, 0, 0]}})),
        (ValueError, 'body "ball": the name "ball" is that of two bodies', with_scene(block(name="ball"))),
        (ValueError, 'the name "table" is that of two bodies', with_scene(block(name="table"))),
        (ValueError, "ball and block overlap", with_scene(block(pose=[0, 0, 0.95]))),
        (ValueError, "open.obj: the mesh is not closed: 3 edges", with_scene(block(shapes=[{"mesh": "open.obj"}]))),
        (ValueError, 'its parent "blok" does not stand before it; before it stand: ball', with_scene(block(parent="blok"))),
        (ValueError, "exactly one of box, sphere,", with_scene(block(shapes=[{"box": [1, 1, 1], "sphere": 1}]))),
        (ValueError, "a pose of 2 numbers; 3 (x, y, z), 4", with_scene(block(pose=[0, 1]))),
        (ValueError, "a size of -1 m", with_scene(block(shapes=[{"sphere": -1}]))),
        (ValueError, 'one of "slide" and "hinge"', with_scene(block(joint={"range": [0, 1]}))),
        (ValueError, 'joint "loose"; "fixed", "free"', with_scene(block(joint="loose"))),
        (ValueError, "mass and density", with_scene(block(density=1))),
        (ValueError, "missing field `name`", with_scene({"shapes": []})),
        (ValueError, "prediction distance of -1", with_scene(prediction=-1.0)),
        (ValueError, "table: height -1 m", with_scene(table={"height": -1})),
        (ValueError, "none.xml", type("Wrong", (Plain,), {"scene": "none.xml"})),
        (ValueError, "an MJCF file (.xml) or a URDF file", type("Wrong", (Plain,), {"scene": "scene.obj"})),
        (TypeError, "Wrong.scene: a int; a dict", type("Wrong", (Plain,), {"scene": 3})),
        (TypeError, "Wrong.scene: unknown key 'bodys'; known are table, bodies", type("Wrong", (Plain,), {"scene": {"bodys": []}})),
        (TypeError, "Wrong.scene: bodies: a list of dicts is wanted", type("Wrong", (Plain,), {"scene": {"bodies": 3}})),
        (TypeError, "Wrong.scene: prediction: a distance (m) is wanted", type("Wrong", (Plain,), {"scene": {"prediction": "x"}})),
        (TypeError, "Wrong.name: a string or None is wanted", type("Wrong", (Plain,), {"name": 3})),
        (TypeError, "Wrong.achievement: a string is wanted", type("Wrong", (Plain,), {"achievement": 3})),
        (ValueError, "Wrong.camera: field_of_view 0; an angle above 0", type("Wrong", (Plain,), {"camera": {"field_of_view": 0}})),
        (ValueError, "Wrong.camera: eye and target; two places", type("Wrong", (Plain,), {"camera": {"eye": [1, 0, 1], "target": [1, 0, 1]}})),
        (TypeError, 'Wrong.scaling: "bal" is not observed; observed are ball', type("Wrong", (Plain,), {"scaling": {"bal": (0, 1)}})),
        (TypeError, 'Wrong.units: "bal" is not observed; observed are ball', type("Wrong", (Plain,), {"units": {"bal": "m"}})),
        (TypeError, 'bodies[1]: unknown key "colour"', with_scene(block(colour=[1, 2, 3]))),
        (TypeError, 'unknown key "shapes[0].colour"; did you mean "shapes[0].color"?', with_scene(block(shapes=[{"sphere": 0.1, "colour": [1, 2, 3]}]))),
        (TypeError, 'unknown key "dampin"; did you mean "damping"?', with_scene(block(joint={"slide": [1, 0, 0], "dampin": 1}))),
        (TypeError, "Wrong.reward: \"reward\" is 'much'; a number is wanted", returning("reward", "much")),
        (TypeError, "\"near\" is None; a number is wanted", returning("reward", {"near": None})),
        (TypeError, "\"ball\" is None; a number or an array", returning("observe", {"ball": None})),
        (ValueError, 'Wrong.reward: "near" is nan; a finite number is wanted', returning("reward", {"near": np.nan})),
        (ValueError, "17 terms; sixteen are allowed", returning("reward", {str(i): 0 for i in range(17)})),
        (TypeError, "Wrong.success: it returned a float; True or False is wanted", returning("success", 1.0)),
        (TypeError, "Wrong.lost: it returned a int; True or False is wanted", returning("lost", 1)),
        (TypeError, "Wrong.observe: it returned a list; a dict", returning("observe", [1.0])),
        (TypeError, "\"ball\" is 'red'; a number or an array", returning("observe", {"ball": "red"})),
        (ValueError, 'two numbers of its observation are called "eef_pos_x"', returning("observe", {"eef_pos_x": 0})),
        (ValueError, '"ball" holds inf', returning("observe", {"ball": [0, np.inf]})),
        (TypeError, 'Wrong.reset: unknown key "pose"; did you mean "poses"?', returning("reset", {"pose": {}})),
        (ValueError, 'no body "bal"; known are ball', returning("reset", {"poses": {"bal": [0, 0, 1]}})),
        (ValueError, 'no joint "ball"; known are none', returning("reset", {"joints": {"ball": 1}})),
        (ValueError, "fingers 0.2 m; 0 to 0.079", returning("reset", {"fingers": 0.2})),
        (ValueError, "holding: width 0.2 m; 0 to 0.079", returning("reset", {"holding": {"body": "ball", "width": 0.2}})),
        (ValueError, "fingers and holding; one of them", returning("reset", {"fingers": 0.04, "holding": {"body": "ball", "width": 0.2}})),
        (ValueError, "free and friction are for a URDF", with_scene({"file": "ball.xml", "free": True})),
        (TypeError, '"ball" is [\'0\', \'1\']; a number or an array', returning("observe", {"ball": ["0", "1"]})),
        (ValueError, '"ball" holds 1', returning("observe", {"ball": 1e300})),
        (TypeError, '"bal" is not observed; observed are ball, far', type("Wrong", (Plain,), {"units": {"bal": "m"}, "observe_critic": lambda self, _: {"far": 1}})),
        (ValueError, "arm: joint 1 at 9 rad", returning("reset", {"arm": [9, 0, 0, 0, 0, 0, 0]})),
        (ValueError, "nothing that stands still is below", returning("reset", {"poses": {"ball": [9, 0, 1]}})),
        (ValueError, "overlap", returning("reset", {"poses": {"ball": [-0.1, 0, 1.0]}})),
        (TypeError, 'Wrong.defaults: unknown key "env.horzon"', type("Wrong", (Plain,), {"defaults": {"horzon": 3}})),
        (ValueError, "a typical deviation of [0.0]; above 0", type("Wrong", (Plain,), {"scaling": {"ball": (0, 0)}})),
        (ValueError, "a typical deviation of [1e-320]; above 0", type("Wrong", (Plain,), {"scaling": {"ball": (0, 1e-320)}})),
        (ValueError, '"ball" has 2 numbers, 3 are observed', type("Wrong", (Plain,), {"scaling": {"ball": ([0, 0], 1)}})),
        (ValueError, """'hammer'; "gripper" or "wiping-tool\"""", type("Wrong", (Plain,), {"tool": "hammer"})),
        (ValueError, 'no joint "slide"', type("Wrong", (Plain,), {"disturbances": {"x": {"joint_friction": "slide", "allowed": [0, 1]}}})),
        (ValueError, "the name is that of a task in Rust", type("Lift", (Plain,), {})),
        (NotImplementedError, "Empty has no reward(state)", type("Empty", (aforce.Task,), {})),
        (KeyError, "no body", type("Wrong", (Plain,), {"observe": lambda self, state: {"x": state.body("x").position}})),
        (TypeError, "its class is wanted", Plain()),
        (TypeError, "a class below aforce.Task", None),
        (TypeError, "a class below aforce.Task", "lift"),
        (TypeError, "a class below aforce.Task is wanted", dict),
        (TypeError, "task makes a dict", lambda: {}),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_is_wrong_is_told_in_one_line(kind, words, task, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "open.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\n")
    with pytest.raises(kind) as error:
        aforce.Env(task=task)
    text = str(error.value).replace('\\"', '"')
    assert words in text and "\n" not in text


@pytest.mark.parametrize(
    "kind, words, later",
    [
        (ValueError, '"ball" has 2 numbers, at first 3', {"observe": lambda self, state: {"ball": [0, 0]}}),
        (ValueError, "the names cube, at first ball", {"observe": lambda self, state: {"cube": [0, 0, 0]}}),
        (ValueError, "the terms near, at first reward", {"reward": lambda self, state: {"near": 0}}),
        (ZeroDivisionError, "division by zero", {"reward": lambda self, state: 1 / 0}),
        (ZeroDivisionError, "division by zero", {"advance": lambda self, state: 1 / 0}),
    ],
)
@pytest.mark.parametrize("count", [1, 2])
def test_what_goes_wrong_later_ends_the_episode(kind, words, later, count):
    task = type("Late", (Plain,), {})
    env = aforce.VectorEnv(task=task, num_envs=count, threads=2) if count > 1 else aforce.Env(task=task)
    actions = np.zeros(env.action_space.shape)
    env.reset(seed=1)
    env.step(actions)
    for name, method in later.items():
        setattr(task, name, method)
    with pytest.raises(kind, match=words):
        env.step(actions)
    with pytest.raises(RuntimeError, match="call reset first"):
        env.step(actions)
    for name in later:
        delattr(task, name)
    env.reset(seed=1)
    env.step(actions)


def test_marks_are_finite():
    task = type("Wrong", (Plain,), {"marks": lambda self: [(0, 0, float("nan"), 1)]})
    env = aforce.Env(task=task, render_mode="rgb_array")
    with pytest.raises(ValueError, match="Wrong.marks: .* all finite"):
        env.reset(seed=1)
        env.render()


def test_a_reward_of_progress_has_both_distances():
    class Closer(Reach):
        calls = []

        def reset(self, rng):
            self.before = self.now = None
            return super().reset(rng)

        def advance(self, state):
            self.calls.append("advance")
            self.before, self.now = self.now, float(state.tool.position[2])

        def observe(self, state):
            self.calls.append("observe")
            return super().observe(state)

        def reward(self, state):
            self.calls.append("reward")
            return {"progress": 0.0 if self.before is None else self.before - self.now}

        def success(self, state):
            self.calls.append("success")
            return False

    env = aforce.Env(task=Closer, space="osc")
    env.reset(seed=1)
    env.step(np.zeros(6))
    Closer.calls.clear()
    rewards = [env.step([0, 0, -1, 0, 0, 0])[1] for _ in range(5)]
    assert Closer.calls[:4] == ["advance", "observe", "reward", "success"]
    assert rewards[-1] > 0


def test_a_waypoint_that_cannot_be_is_told():
    for waypoint, words in [
        ({"forward": [0, 0, 1]}, r"forward \[0.0, 0.0, 1.0\]; a direction that is not straight up or down"),
        ({"force": -5}, "force -5; a force to press with"),
    ]:
        script = {"script": lambda self, state, waypoint=waypoint: {"position": [0, 0, 1], **waypoint}}
        env = aforce.Env(task=type("Wrong", (Plain,), script))
        env.reset(seed=1)
        with pytest.raises(ValueError, match=words):
            env.expert_action()


def test_a_task_without_a_script_says_so():
    env = aforce.Env(task=Plain)
    env.reset(seed=1)
    with pytest.raises(NotImplementedError, match="Plain has no script"):
        env.expert_action()
    env.step(np.zeros(7))  # The missing script does not end the episode.


def test_a_class_that_is_written_anew_is_another_task():
    for key in ("soft", "stiff"):
        disturbances = {key: {"body_mass": "ball", "allowed": [0.1, 10]}}
        env = aforce.Env(task=type("Twice", (Plain,), {"disturbances": disturbances}), disturbance={"own": {key: 2.0}})
        assert env.describe()["env"]["disturbance"]["own"] == {key: 2.0}


def test_objects_come_from_files(tmp_path):
    (tmp_path / "ball.xml").write_text(
        '<mujoco model="m"><worldbody><body name="ball" pos="0 0 0.83"><freejoint/><geom type="sphere" size="0.03" mass="0.1"/></body></worldbody></mujoco>'
    )
    for scene in (str(tmp_path / "ball.xml"), {"bodies": [{"file": tmp_path / "ball.xml", "pose": [0.1, 0, 0]}]}):
        env = aforce.Env(task=type("Filed", (Plain,), {"scene": scene}))
        at = env.reset(seed=1)[0][:3]
        assert np.allclose(at, [0.1 if isinstance(scene, dict) else 0, 0, 0.83])


class Press(Plain):
    """Presses on the table."""

    tool = "wiping-tool"
    scene = {"table": {"height": 0.9, "friction": 0.03, "centre": [0.15, 0], "size": [0.5, 0.8]}}

    def observe(self, state):
        assert state.fingers is None
        return {"force": state.force[2]}

    def script(self, state):
        return {"position": [0, 0, 0.9], "forward": [0, 1, 0], "force": 20}


def test_the_wiping_tool_wipes():
    env = aforce.Env(task=Press, space="aforce-force")
    env.reset(seed=1)
    for _ in range(100):
        observation, *_ = env.step(env.expert_action())
    assert 10 < observation[0] < 30


def test_a_state_tells_velocities_forces_and_the_penalty():
    class Edge(Press):
        scene = {"table": {**Press.scene["table"], "centre": [0.15, 0.42]}}  # The table is only below the part of the pad beyond y = 2 cm.

        def reset(self, rng):
            self.states = []

        def observe(self, state):
            self.states.append(state)
            return super().observe(state)

        def reward(self, state):
            self.paid = state.penalty
            return 0.5

    env = aforce.Env(task=Edge, space="aforce-force", initial_noise=0.0, observation={"force": True}, force_penalty={"limit": 25})
    assert [number["unit"] for number in env.describe()["observation"][-6:]] == ["N, tool"] * 3 + ["Nm, tool"] * 3
    env.reset(seed=1)
    speeds, levers, penalties = [], [], []
    for _ in range(120):
        observation, *_, info = env.step(env.expert_action())
        before, now = env.own_task.states[-2:]
        to_tool = now.tool.rotation.T
        assert np.allclose(observation[-6:], [*to_tool @ now.force, *to_tool @ now.torque], atol=1e-4)
        if now.force.any():
            levers.append(now.torque[0] / now.force[2])
            penalties.append(env.own_task.paid)
            assert env.own_task.paid == (0.05 * info["force"] if info["force"] > 25 else 0)
            assert 0 < now.contact_force <= info["force"]
        else:
            speeds.append(np.abs(now.qd).max())
            assert np.allclose((now.q - before.q) / (now.time - before.time), (now.qd + before.qd) / 2, atol=0.01)
    assert max(speeds) > 0.1
    # A force of 1 N upwards at y has the moment y about x, and the pad ends 6 cm from the tool point.
    assert 0.02 < min(levers) and max(levers) < 0.06
    assert len(levers) > 10 and max(penalties) > 1 and min(penalties) == 0
    assert now.contact_force == pytest.approx(np.linalg.norm(now.force), rel=0.02), "at rest both filters have what presses"


def test_no_body_is_needed_and_a_critic_may_see_more():
    class Empty(Reach):
        def observe_critic(self, state):
            return {"target": self.target}

    env = aforce.Env(task=Empty, observation={"critic": ["task"]})
    _, info = env.reset(seed=1)
    assert info["critic"].shape == (3,) and [number["name"] for number in env.describe()["critic"]][0] == "target_x"
