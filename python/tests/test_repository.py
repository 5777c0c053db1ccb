"""The Python code in the repository's pages runs, and the index of policies is up to date."""

import importlib.util
import subprocess
import sys

import pytest
from common import ROOT

PAGE = ROOT / "docs" / "python.md"
TUTORIAL = ROOT / "docs" / "tutorial-task-python.md"


def examples():
    """The lines of the page's examples by heading. The examples below one heading are one program."""
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


@pytest.mark.parametrize(("libc", "reason"), [(None, "musl"), ("glibc 2.27", "this system has 2.27"), ("glibc 2.28", None)])
def test_another_c_library_is_told_before_the_download(monkeypatch, libc, reason):
    spec = importlib.util.spec_from_file_location("setup_libtorch", ROOT / "scripts" / "setup-libtorch.py")
    setup = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(setup)

    def confstr(name):
        assert name == "CS_GNU_LIBC_VERSION"
        if libc is None:  # as musl's Python does
            raise ValueError("unrecognized configuration name")
        return libc

    monkeypatch.setattr(setup.os, "confstr", confstr)
    monkeypatch.setattr(setup.platform, "system", lambda: "Linux")
    monkeypatch.setattr(setup.platform, "machine", lambda: "x86_64")
    monkeypatch.setattr(setup, "FREE_BYTES_NEEDED", 0)
    monkeypatch.setattr(setup, "TARGET", ROOT / "libtorch")
    if reason is None:
        setup.check_machine()
    else:
        with pytest.raises(SystemExit, match=reason) as told:
            setup.check_machine()
        assert "nothing was downloaded" in str(told.value)


def test_the_tutorial_of_a_task_runs(tmp_path):
    (tmp_path / "reach.py").symlink_to(ROOT / "python" / "examples" / "reach.py")
    page, learning, comparing = (block.partition("```")[0] for block in TUTORIAL.read_text().split("```python\n")[2:5])
    subprocess.run([sys.executable, "-c", page], cwd=tmp_path, check=True)
    assert (tmp_path / "reach.html").stat().st_size > 50_000
    pytest.importorskip("stable_baselines3", reason="the example needs Stable-Baselines3")
    assert "10_000" in learning
    subprocess.run([sys.executable, "-c", learning.replace("10_000", "300")], cwd=tmp_path, check=True)
    assert "10_000" in comparing and "[11, 12, 13, 14, 15]" in comparing
    shorter = comparing.replace("10_000", "1000").replace("[11, 12, 13, 14, 15]", "[11]")
    subprocess.run([sys.executable, "-c", shorter], cwd=tmp_path, check=True)
    folders = (tmp_path / "exp" / "reach").glob("*/seed_11/evaluations.npz")
    assert sorted(file.parent.parent.name for file in folders) == ["aforce,sb3", "osc,sb3", "variable,sb3"]


@pytest.mark.parametrize("heading", examples())
def test_examples_of_the_page_run(heading, tmp_path):
    code = "\n".join(examples()[heading])
    for package, words in [("stable_baselines3", "Stable-Baselines3"), ("robosuite", "robosuite")]:
        if package in code:
            pytest.importorskip(package, reason=f"the example needs {words}")
    # The example finds results/ as in the repository, but leaves no files there.
    (tmp_path / "results").symlink_to(ROOT / "results")
    run = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr


def test_the_index_of_policies_is_what_is_there():
    subprocess.run([sys.executable, ROOT / "scripts" / "zoo.py", "--check"], check=True)


def test_the_gallery_has_its_policies():
    sys.path.insert(0, str(ROOT / "scripts"))
    try:
        gallery = importlib.import_module("gallery")
    finally:
        sys.path.pop(0)
    results = ROOT / "results"
    runs = [
        gallery.Runs(results / "study", stage, task, space + suffix)
        for task, (_, stage, suffix, _) in gallery.TASKS.items()
        for space in ("aforce", "variable")
    ]
    assert len(runs) == 6 and all(run.policy.is_file() for run in runs)
    assert len(gallery.policies_of_insert(results / "insert" / "again")) == 2
