"""Shared by the scripts that compare speeds: environment steps per second of this project beside those of another simulator.

Ours are the criterion benches `step/TASK/WHAT` of crates/tasks. Both sides get one core and take turns. Needs cargo.
"""

import json
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def ours(task, what):
    name = f"step/{task}/{what}"
    subprocess.run(["cargo", "bench", "--quiet", "-p", "tasks", "--bench", "step", "--", f"^{name}$"], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    # Criterion replaces the slashes of an id, after that behind the group, by underscores in the folder's name.
    estimates = ROOT / "target" / "criterion" / "step" / f"{task}_{what}" / "new" / "estimates.json"
    return 1e9 / json.loads(estimates.read_text())["mean"]["point_estimate"]


def compare(case, name, theirs, ours):
    """Prints the ratio of ours to `theirs` (functions that return steps per second) and returns it as a row; `name` is theirs."""
    before, mine, after = theirs(), ours(), theirs()
    ratio = mine / ((before + after) / 2)
    print(f"{case:<14} {name} {before:.0f} and {after:.0f}, ours {mine:.0f}: {ratio:.2f} times as many", flush=True)
    return {"case": case, "other": name, "other_before": f"{before:.1f}", "other_after": f"{after:.1f}", "ours": f"{mine:.1f}", "ratio": f"{ratio:.2f}"}
