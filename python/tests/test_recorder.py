"""Episodes as pages."""

import base64
import copy
import json

import gymnasium as gym
import numpy as np
import pytest
from common import make

from aforce import Recorder


def data(page):
    text = page.read_text()
    return json.loads(text.partition('<script id="data" type="application/json">')[2].partition("</script>")[0])


def test_every_episode_becomes_a_page(tmp_path):
    env = Recorder(make(horizon=4), tmp_path / "lift_{}.html", who="a test")
    total = 0.0
    for seed in range(2):
        env.reset(seed=seed)
        for _ in range(4):
            total += env.step(env.action_space.sample())[1]
    env.reset()
    env.step(env.action_space.sample())
    env.close()  # The third is broken off.
    pages = sorted(tmp_path.iterdir())
    assert [page.name for page in pages] == ["lift_0.html", "lift_1.html", "lift_2.html"]
    episodes = [data(page)["episodes"][0] for page in pages]
    assert [episode["frames"] for episode in episodes] == [4, 4, 1]
    assert (episodes[0]["title"], episodes[0]["who"]) == ("lift aforce", "a test")
    tool = np.frombuffer(base64.b64decode(episodes[0]["tool"]), "<f4")
    assert len(tool) == 12 and 0.5 < tool[2] < 1.5


def test_an_episode_that_began_without_the_recorder_is_not_recorded_and_a_warning_says_so(tmp_path):
    env = make()
    env.reset(seed=1)
    env = Recorder(env, tmp_path / "lift_{}.html")
    env.step(env.action_space.sample())
    with pytest.warns(UserWarning, match="lift_0.html: not written, for the episode began without the Recorder") as caught:
        env.reset(seed=2)
    assert caught[0].filename == __file__ and not list(tmp_path.iterdir())
    env.step(env.action_space.sample())
    env.close()
    assert [page.name for page in tmp_path.iterdir()] == ["lift_0.html"]


def test_what_cannot_be_recorded_is_answered(tmp_path):
    with pytest.raises(TypeError, match="wants an environment of aforce"):
        Recorder(gym.make("CartPole-v1"), tmp_path / "page.html")
    env = Recorder(make(horizon=1), tmp_path / "none" / "page.html")
    env.reset(seed=1)
    with pytest.raises(OSError, match="page.html"):
        env.step(env.action_space.sample())
    env.reset(seed=1)  # The environment can go on, and be closed.
    env.close()


def test_an_episode_is_one_page_however_long_it_is_stepped_and_however_often_written(tmp_path):
    env = Recorder(make(horizon=3), tmp_path / "lift_{}.html")
    env.reset(seed=1)
    env.step(env.action_space.sample())
    env.write()
    for _ in range(4):  # Two of them after its end.
        env.step(env.action_space.sample())
    assert [page.name for page in tmp_path.iterdir()] == ["lift_0.html"]
    assert data(tmp_path / "lift_0.html")["episodes"][0]["frames"] == 3
    copied = copy.deepcopy(env)
    copied.reset(seed=2)
    copied.step(env.action_space.sample())
    copied.close()
    assert sorted(page.name for page in tmp_path.iterdir()) == ["lift_0.html", "lift_1.html"]
