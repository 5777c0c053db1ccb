#!/usr/bin/env python3
"""The index of the policies that are kept in results: results/zoo.json.

    python3 scripts/zoo.py [--check]

`return` is that of the evaluation by which the policy was kept, mean actions, of the commit that trained it. `--check` only says whether the
index is true.
"""

import argparse
import hashlib
import json
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
RESULTS = ROOT / "results"


def entry(weights):
    checkpoint = weights.parent
    run = checkpoint.parent.parent
    state = json.loads((checkpoint / "state.json").read_text())
    made_for = state["caller"]
    return {
        "run": str(run.relative_to(RESULTS)),
        "task": made_for["task"],
        "space": made_for["space"],
        "step": made_for["step"],
        "return": round(made_for["evaluation_return"], 1),
        "file": str(weights.relative_to(RESULTS)),
        "sha256": hashlib.sha256(weights.read_bytes()).hexdigest(),
        "commit": json.loads((run / "manifest.json").read_text())["commit"],
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--check", action="store_true")
    index = RESULTS / "zoo.json"
    entries = [entry(weights) for weights in sorted(RESULTS.rglob("checkpoints/best/actor.safetensors"))]
    text = json.dumps(entries, indent=1) + "\n"
    if not parser.parse_args().check:
        index.write_text(text)
    elif not index.exists() or index.read_text() != text:
        sys.exit("results/zoo.json is not what is there: make it again with scripts/zoo.py")


if __name__ == "__main__":
    main()
