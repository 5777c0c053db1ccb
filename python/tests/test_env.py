"""The environments fulfil Gymnasium's interface, and behave as this package documents."""

import copy
import pickle
import threading
import warnings

import gymnasium as gym
import numpy as np
import pytest
from common import TASKS, make
from gymnasium.utils.env_checker import check_env

import aforce

OPTIONS = [
    {"observation": {"markers": "ends", "controller": True}},
    {"observation": {"force": True, "critic": ["contact", "task"]}},
    {"observation": {"camera": {"width": 40, "height": 36, "kind": "rgb"}}},
    {"observation": {"camera": {"width": 20, "height": 10, "from": "hand"}}},
    {"disturbance": {"friction": [0.5, 2.0], "position_noise_rad": 0.001}},
    {"setup": "small-steps", "horizon": 7, "ends_on_success": True, "motion_price": 0.01},
    {"robot": "identified", "controller": {"policy_hz": 10}},
    {"render_mode": "rgb_array", "render_size": (32, 24)},
]


@pytest.mark.parametrize("scaled", [False, True])
@pytest.mark.parametrize("space", aforce.spaces())
@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("checker", ["gymnasium", "stable_baselines3"])
def test_checkers_pass_in_every_space(checker, task, space, scaled):
    check(checker, make(task, space=space, scaled=scaled))


@pytest.mark.parametrize("options", OPTIONS, ids=str)
@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("checker", ["gymnasium", "stable_baselines3"])
def test_checkers_pass_under_every_kind_of_option(checker, task, options):
    check(checker, make(task, scaled=True, **options))


def check(checker, env):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # An observation that is not scaled has no bounds.
        warnings.filterwarnings("ignore", ".*Box observation space m.*imum value is -?infinity.*")
        if checker == "gymnasium":
            check_env(env.unwrapped, skip_render_check=env.render_mode is None)
        else:
            # The default network takes pictures of bytes with at least 36 pixels a side, not small pictures of depth in metres.
            warnings.filterwarnings("ignore", ".*observation (space )?pixels is an image but|The minimal resolution for an image")
            theirs = pytest.importorskip("stable_baselines3.common.env_checker", reason="Stable-Baselines3 is not installed")
            theirs.check_env(env.unwrapped, warn=True)


def test_a_seed_fixes_this_episode_and_all_that_follow():
    first, second = make(), make()
    starts = [[env.reset(seed=7)[0], *(env.reset()[0] for _ in range(3))] for env in (first, second)]
    assert np.array_equal(*starts)
    assert len({start.tobytes() for start in starts[0]}) == 4
    # Each episode can be repeated by its own seed.
    again, _ = second.reset(seed=first.unwrapped.episode_seed)
    assert np.array_equal(again, starts[0][-1])
    # Without a seed every environment has other episodes.
    assert not np.array_equal(make().reset()[0], make().reset()[0])


def test_info_and_description_say_what_happened():
    env = make("Door", space="aforce-force", scaled=True)
    env.reset(seed=1)
    total = 0.0
    for _ in range(100):
        _, reward, terminated, truncated, info = env.step(env.unwrapped.expert_action())
        assert sum(info["reward_terms"].values()) == pytest.approx(reward, abs=1e-12)
        total += info["energy"]
    assert list(info) == ["is_success", "stopped", "diverged", "energy", "force", "hand_force", "joint_speed", "penalty", "motion_cost", "stop_cost", "reward_terms"]
    assert total > 1 and info["force"] >= 0 and not terminated and not truncated
    description = env.unwrapped.describe()
    assert [entry["name"] for entry in description["action"]][-2:] == ["normal_force", "gripper"]
    assert len(description["observation"]) == env.observation_space.shape[0]
    assert description["env"]["space"]["force"] and description["reward_terms"] == list(info["reward_terms"])


def test_info_has_the_same_keys_from_reset_on():
    env = make("Door", observation={"critic": ["task"]})
    _, first = env.reset(seed=1)
    *_, later = env.step(env.action_space.sample())
    assert list(first) == list(later) and list(first["reward_terms"]) == list(later["reward_terms"])
    assert not any(first[key] for key in first if key not in ("reward_terms", "critic")) and not any(first["reward_terms"].values())


def test_the_spec_tells_the_horizon():
    assert make().spec.max_episode_steps == 500
    assert make(horizon=7).spec.max_episode_steps == 7
    assert make(horizon=7, max_episode_steps=3).spec.max_episode_steps == 3
    env = gym.wrappers.TimeAwareObservation(make(horizon=1000))
    assert env.spec.max_episode_steps == 1000
    assert gym.make(env.unwrapped.spec).unwrapped.describe()["env"]["horizon"] == 1000
    env.reset(seed=1)
    ends = [step for step in range(1, 1002) if env.step(np.zeros(7))[3]]
    assert ends[0] == 1000, "no shorter limit lies on top"


def test_terms_less_the_cost_of_motion_add_up_to_the_reward():
    env = make(motion_price=0.1)
    env.reset(seed=1)
    for _ in range(5):
        _, reward, *_, info = env.step(env.unwrapped.expert_action())
        assert info["motion_cost"] == 0.1 * info["energy"] > 0
        assert sum(info["reward_terms"].values()) - info["motion_cost"] == pytest.approx(reward, abs=1e-12)


def test_a_stop_with_a_price_cuts_the_episode_short_and_costs_it():
    env = make(stops=True, stop_price=3, protection={"joint_speed": 0.05})
    env.reset(seed=1)
    for _ in range(10):
        _, reward, terminated, truncated, info = env.step(np.full(7, 0.5))
        if truncated:
            break
    assert (terminated, truncated, info["stopped"]) == (False, True, True)
    assert (info["stop_cost"], reward, sum(info["reward_terms"].values())) == (3, -3, 0)
    with pytest.raises(ValueError, match="env.stops = true is missing"):
        make(stop_price=3)


@pytest.mark.parametrize("of, key", [("arm", "force"), ("hand", "hand_force")])
def test_the_penalty_is_of_the_force_that_counts(of, key):
    env = make("Wipe", space="osc", force_penalty={"of": of, "limit": 40, "weight": 0.1}).unwrapped
    env.reset(seed=1)
    # An arm that keeps moving down also presses with links before the wrist.
    infos = [env.step([0, 0, -1, 0, 0, 0])[-1] for _ in range(60)]
    penalties = [info["penalty"] for info in infos]
    assert penalties == [0.1 * info[key] if info[key] > 40 else 0 for info in infos]
    assert min(penalties) == 0 and max(penalties) > 10
    assert all(info["force"] >= info["hand_force"] for info in infos)
    assert max(info["force"] - info["hand_force"] for info in infos) > 100


def test_the_script_lifts_the_cube():
    env = make(setup="small-steps", ends_on_success=True)
    env.reset(seed=1)
    while True:
        *_, terminated, truncated, info = env.step(env.unwrapped.expert_action())
        if terminated or truncated:
            break
    assert truncated and info["is_success"]


@pytest.mark.parametrize("task, space", [("Lift", "aforce"), ("Wipe", "variable")])
def test_a_script_rests_when_its_task_is_done(task, space):
    env = make(task, space=space).unwrapped
    env.reset(seed=1)
    infos = [env.step(env.expert_action())[-1] for _ in range(env.describe()["env"]["horizon"])]
    done = next(index for index, info in enumerate(infos) if info["is_success"])
    # The second after success, in which the arm comes to rest, is left out.
    way, rest = (sum(info["energy"] for info in part) for part in (infos[:done], infos[done + 20 :]))
    assert rest < 0.1 * way
    assert max(info["hand_force"] for info in infos[done + 20 :]) < 2


def test_every_call_returns_arrays_of_its_own():
    env = make()
    first, _ = env.reset(seed=1)
    kept = first.copy()
    second, *_ = env.step(env.action_space.sample())
    assert first is not second and np.array_equal(first, kept)
    second[:] = 0
    assert env.step(env.action_space.sample())[0].any()


def test_a_picture_shows_something():
    env = make(render_mode="rgb_array", render_size=(64, 48))
    env.reset(seed=1)
    picture = env.render()
    assert picture.shape == (48, 64, 3) and picture.dtype == np.uint8 and picture.std() > 10


def test_pickle_and_deepcopy_make_the_same_environment_anew():
    space = {"extends": "low", "name": "soft", "stiffness": {"fixed": [90, 9]}}
    env = make("Wipe", space=space, horizon=9).unwrapped
    space["stiffness"]["fixed"] = [1, 1]  # Must not change the environment, which has its own copy.
    for other in (pickle.loads(pickle.dumps(env)), copy.deepcopy(env)):
        assert other.describe()["env"] == env.describe()["env"]
        assert np.array_equal(other.reset(seed=4)[0], env.reset(seed=4)[0])


def test_a_copy_finds_its_files_from_elsewhere(tmp_path, monkeypatch):
    (tmp_path / "soft.toml").write_text("extends = 'osc'\nstiffness.fixed = 45")
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path)
    stored = pickle.dumps(make(space="soft.toml").unwrapped)
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert pickle.loads(stored).describe()["env"]["space"]["name"] == "soft"


def test_a_space_is_a_name_a_file_or_changes(tmp_path):
    file = tmp_path / "soft.toml"
    file.write_text("extends = 'osc-force'\nstiffness.fixed = 45")
    for space, name in [("osc", "osc"), (str(file), "soft"), (file, "soft"), ({"force": True}, "aforce")]:
        assert make(space=space).unwrapped.describe()["env"]["space"]["name"] == name


def test_a_runs_configuration_is_taken_over(tmp_path):
    config = tmp_path / "config.toml"
    config.write_text("steps = 7\n[learner]\ngamma = 0.5\n[env]\ntask = 'wipe'\nhorizon = 5\nspace = 'low'")
    settings = make("Wipe", config=config, horizon=6).unwrapped.describe()["env"]
    assert (settings["horizon"], settings["space"]["name"]) == (6, "low")
    with pytest.raises(ValueError, match='env.task = "wipe" contradicts'):
        make("Door", config=config)
    for text, key in [("horizon = 3", "horizon"), ("[evn]\nhorizon = 3", "evn"), ("extends = 'osc'", "extends")]:
        config.write_text(text)
        with pytest.raises(ValueError, match=f'config.toml: "{key}" is no key of a run\'s config.toml; known are env, setup, preset'):
            make(config=config)


ENDLESS = {}
ENDLESS["again"] = ENDLESS


def bad(words, kind=ValueError, **keywords):
    return pytest.param(kind, words, keywords, id=words)


@pytest.mark.parametrize(
    "kind, words, keywords",
    [
        bad('unknown key "env.horzon"; did you mean "env.horizon"?', TypeError, horzon=3),
        bad("got an unexpected keyword argument 'frameskip': keywords: unknown key \"env.frameskip\"; known are task, ", TypeError, frameskip=4),
        bad("got an unexpected keyword argument 'callback': ", TypeError, callback=object()),
        bad(" (Python's own: config, render_mode, render_size, scaled, setup)", TypeError, scale=True),
        bad("scaled = 'false' is not allowed; allowed: True or False", scaled="false"),
        bad("env.horizon = 0 is not allowed; allowed: 1 to 1000000", horizon=0),
        bad('env.force_penalty.limt"; did you mean "env.force_penalty.limit"?', force_penalty={"limt": 1}),
        bad("env.force_penalty.limit = NaN is not allowed", force_penalty={"limit": np.nan}),
        bad("did you mean `aforce`", space="aforze"),
        bad("env.space.stiffness.adaptive.alpha (axis x) = 100000 is unstable", space={"stiffness": {"adaptive": {"alpha": 1e5}}}),
        bad("control_hz = 500 is not a whole multiple of policy_hz = 30", controller={"policy_hz": 30}),
        bad("invalid type: string", horizon="many"),
        bad("env.horizon: invalid type: floating point `1000.0`, expected a whole number", horizon=1e3),
        bad("env.observation: invalid type: string \"force\", expected a table", observation="force"),
        bad("setup = \"tiny\": known are paper-steps, small-steps, solve", setup="tiny"),
        bad("horizon is a object", TypeError, horizon=object()),
        bad("space is a bytes", TypeError, space=b"aforce"),
        bad("horizon = 1180591620717411303424 is too large", horizon=2**70),
        bad("env.disturbance.hinge_spring: ", disturbance={"hinge_spring": 1.0}),
        bad("none.toml", FileNotFoundError, config="none.toml"),
        bad("none.toml", space="none.toml"),
        bad("render_mode = 'ansi' is not allowed", render_mode="ansi"),
        bad('env.task = "door" contradicts the environment\'s name, which says "lift"', task="door"),
        bad("env.disturbance is a list; a table is wanted", disturbance=[0.5, 2.0]),
        bad("env.controller.force is a list", controller={"force": [10.0]}),
        bad("is a dict or a list part of itself?", disturbance=ENDLESS),
        bad("render_size = (0, 5)", render_size=(0, 5)),
        bad("render_size = (1, 2, 3)", render_size=(1, 2, 3)),
        bad("render_size = (True, 5)", render_size=(True, 5)),
        bad("render_size = (5, 5.5)", render_size=(5, 5.5)),
        bad("1 to 8192", render_size=(2_000_000, 5)),
    ],
)
def test_bad_settings_are_answered(kind, words, keywords):
    with pytest.raises(kind) as error, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # gym.make also warns of an unknown render mode.
        make(**keywords)
    assert words in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize(
    "kind, words, action",
    [
        (ValueError, "action has shape (3,), must have (7,)", np.zeros(3)),
        (ValueError, "action has shape (1, 7), must have (7,)", np.zeros((1, 7), np.float32)),
        (ValueError, "action: entry 2 is NaN, must be a finite number", np.array([0, 0, np.nan, 0, 0, 0, 0])),
        (ValueError, "entry 0 is inf", np.full(7, np.inf, np.float32)),
        (TypeError, "action must be an array of numbers", "forward"),
        (TypeError, "action must be an array of numbers", ["0"] * 7),
        (TypeError, "action must be an array of numbers", np.ones(7) * 1j),
        (ValueError, "action has shape (), must have (7,)", None),
    ],
)
def test_bad_actions_are_answered(kind, words, action):
    env = make().unwrapped
    env.reset(seed=1)
    with pytest.raises(kind) as error:
        env.step(action)
    assert words in str(error.value)
    env.step([0] * 7)  # A refused action does not end the episode.


def urdf(shape):
    """An arm of seven joints whose links have this collision shape."""
    text, parent = '<robot name="arm"><link name="l0"/>', "l0"
    for i, (axis, height) in enumerate(zip(["0 0 1", "0 1 0"] * 4, [0.3, 0, 0.3, 0, 0.3, 0, 0.1]), 1):
        inertia = '<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/>'
        text += f'<link name="l{i}"><inertial><mass value="2"/>{inertia}</inertial><collision><geometry>{shape}</geometry></collision></link>'
        text += f'<joint name="j{i}" type="revolute"><parent link="{parent}"/><child link="l{i}"/><origin xyz="0 0 {height}"/>'
        text += f'<axis xyz="{axis}"/><limit lower="-2.8" upper="2.8" effort="80" velocity="2"/></joint>'
        parent = f"l{i}"
    return text + "</robot>"


def test_bad_arms_are_answered_in_one_line(tmp_path):
    known = "known are robosuite, identified, fr3, iiwa14, ur5e, or a file that ends with .toml or .urdf"
    (tmp_path / "down.toml").write_text("urdf = 'arm.urdf'\nhome = [0.0, 2.4, 0.0, 0.0, 0.0, 0.0, 0.0]\n")
    (tmp_path / "arm.urdf").write_text(urdf('<sphere radius="0.05"/>'))
    (tmp_path / "mesh.urdf").write_text(urdf('<mesh filename="nowhere.stl"/>'))
    for robot, words in [
        ("ur5", f'no robot is called "ur5"; did you mean "ur5e"? {known}'),
        ("nowhere.toml", "nowhere.toml: No such file"),
        (str(tmp_path / "down.toml"), " overlap at the start of lift, with the arm down"),
        (str(tmp_path / "mesh.urdf"), 'link "l1": '),
    ]:
        with pytest.raises(ValueError) as error:
            make(robot=robot)
        text = str(error.value).replace('\\"', '"')
        assert words in text and "\n" not in text


@pytest.mark.parametrize("seed", [-1, 2**64, 1.5, "one"])
def test_bad_seeds_are_answered(seed):
    with pytest.raises(ValueError, match="allowed: a whole number from 0 to 2"):
        make().unwrapped.reset(seed=seed)


def test_bad_order_is_answered():
    env = make(render_mode="rgb_array").unwrapped
    for early in (lambda: env.step(np.zeros(7)), env.render, env.expert_action, lambda: env.episode_seed):
        with pytest.raises(RuntimeError, match="call reset first"):
            early()
    with pytest.raises(ValueError, match="no option 'x'"):
        env.reset(options={"x": 1})
    env.reset(seed=1)
    env.close()
    env.close()
    for late in (lambda: env.step(np.zeros(7)), env.reset, env.render, env.describe):
        with pytest.raises(RuntimeError, match="closed"):
            late()


def test_two_threads_on_one_environment_are_told_so():
    env = make(render_mode="rgb_array", render_size=(640, 480)).unwrapped
    env.reset(seed=1)
    started, errors = threading.Event(), []

    def draw():
        started.set()
        env.render()

    drawing = threading.Thread(target=draw)
    drawing.start()
    started.wait()
    while drawing.is_alive():  # Drawing takes half a second, in which other Python threads run.
        try:
            env.step(np.zeros(7))
        except RuntimeError as error:
            errors.append(str(error))
    drawing.join()
    assert "this object is in use, by another thread or by the task's method that called it: one at a time" in errors
    env.step(np.zeros(7))


def test_wild_starts_do_not_panic():
    for task in TASKS:
        env = make(task, initial_noise=0.5)
        for seed in range(5):
            env.reset(seed=seed)
            env.step(env.action_space.sample())


@pytest.mark.parametrize("scaled", [False, True])
def test_a_critic_is_told_what_the_policy_is_not(scaled):
    plain = make("Door", scaled=scaled)
    options = {"observation": {"critic": ["disturbance", "contact"], "force": True}, "disturbance": {"hinge_spring": [0, 2]}}
    env = make("Door", scaled=scaled, **options)
    names = [number["name"] for number in env.unwrapped.describe()["critic"]]
    assert names[:2] == ["disturbance_hinge_spring", "contact_x"]
    assert "critic" not in plain.reset(seed=1)[1] and "critic" not in plain.unwrapped.describe()
    observation, info = env.reset(seed=1)
    assert observation.shape[0] == plain.observation_space.shape[0] + 6 and not observation[-6:].any()
    springs = []
    for seed in range(10):
        critic = env.reset(seed=seed)[1]["critic"]
        assert critic.dtype == np.float32 and critic.shape == (len(names),)
        springs.append(critic[0])
        assert env.step(env.action_space.sample())[-1]["critic"][0] == springs[-1], "the same throughout the episode"
    assert len(set(springs)) == 10
    low, high = (-1, 1) if scaled else (0, 2)
    assert low <= min(springs) < (low + high) / 2 < max(springs) <= high
    with pytest.raises(ValueError, match="unknown variant `nonsense`, expected one of `contact`"):
        make(observation={"critic": ["nonsense"]})


def test_a_camera_is_observed_beside_the_numbers():
    plain, _ = make().reset(seed=1)
    env = make(observation={"camera": {"width": 60, "height": 40}})
    observation, _ = env.reset(seed=1)
    assert np.array_equal(observation["state"], plain)
    depth = observation["pixels"]
    assert depth.shape == (40, 60, 1) and depth.dtype == np.float32
    # The table, seen from above: the lower the row, the nearer.
    column = depth[25:, 30, 0]
    assert 0.7 < column.min() and column.max() < 1.5 and column[-1] < column[0] and depth.max() <= 5.0
    moved, *_ = env.step(env.action_space.sample())
    assert not np.array_equal(moved["pixels"], depth)
    hand = make(observation={"camera": {"kind": "rgb", "from": "hand"}}).reset(seed=1)[0]["pixels"]
    assert hand.shape == (84, 84, 3) and hand.dtype == np.uint8 and hand.std() > 5
    with pytest.raises(ValueError, match="unknown variant `dept`, expected `depth` or `rgb`"):
        make(observation={"camera": {"kind": "dept"}})
    with pytest.raises(ValueError, match="observation.camera is not for this vector"):
        gym.make_vec("aforce/Lift-v0", num_envs=2, observation={"camera": {}})


def test_what_it_describes_makes_it_again(tmp_path):
    (tmp_path / "arm.urdf").write_text(urdf('<sphere radius="0.05"/>'))
    made = aforce.Env("lift", robot=tmp_path / "arm.urdf", horizon=30, space=None, observation={"force": True, "camera": None})
    settings = made.describe()["env"]
    assert settings.pop("task") == "lift" and settings["robot"]["air"] is None
    assert aforce.Env("lift", **settings).describe() == made.describe()


def test_a_dict_of_none_is_not_given_and_an_empty_one_is_refused():
    assert aforce.Env("lift", observation={"camera": None}).describe() == aforce.Env("lift").describe()
    with pytest.raises(ValueError, match=r"env\.observation = \{\} changes nothing"):
        aforce.Env("lift", observation={})


def test_an_unknown_task_is_told_with_the_known_ones():
    with pytest.raises(ValueError, match='no task is called "Lift"; there are lift, door, wipe, insert'):
        aforce.Env("Lift")
