"""What the repository says about Python is true."""

import subprocess
import sys

import pytest
from common import ROOT

PAGE = ROOT / "docs" / "python.md"
TUTORIAL = ROOT / "docs" / "tutorial-task-python.md"


def examples():
    """The page's examples, each behind its heading; those of one heading go on from one another."""
    heading, code = "", None
    sections = {}
    for line in PAGE.read_text().splitlines():
        if code is None and line.startswith("#"):
            heading = line.lstrip("# ")
        elif line == "```python":
            code = []
        elif line == "```" and code is not None:
            sections.setdefault(heading, []).extend([*code, ""])
            code = None
        elif code is not None:
            code.append(line)
    return sections


def test_the_tutorial_of_a_task_runs(tmp_path):
    (tmp_path / "reach.py").symlink_to(ROOT / "python" / "examples" / "reach.py")
    page, learning = (block.partition("```")[0] for block in TUTORIAL.read_text().split("```python\n")[2:4])
    subprocess.run([sys.executable, "-c", page], cwd=tmp_path, check=True)
    assert (tmp_path / "reach.html").stat().st_size > 50_000
    pytest.importorskip("stable_baselines3", reason="the example needs Stable-Baselines3")
    assert "10_000" in learning
    subprocess.run([sys.executable, "-c", learning.replace("10_000", "300")], cwd=tmp_path, check=True)


@pytest.mark.parametrize("heading", examples())
def test_examples_of_the_page_run(heading, tmp_path):
    code = "\n".join(examples()[heading])
    for package, words in [("stable_baselines3", "Stable-Baselines3"), ("robosuite", "robosuite")]:
        if package in code:
            pytest.importorskip(package, reason=f"the example needs {words}")
    # As if it were typed in the repository, but nothing is left there.
    (tmp_path / "results").symlink_to(ROOT / "results")
    run = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr


def test_the_index_of_policies_is_what_is_there():
    subprocess.run([sys.executable, ROOT / "scripts" / "zoo.py", "--check"], check=True)
