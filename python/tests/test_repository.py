"""What the repository says about Python is true."""

import subprocess
import sys

import pytest
from common import ROOT

PAGE = ROOT / "docs" / "python.md"


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
