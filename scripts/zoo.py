#!/usr/bin/env python3
"""The index of the policies that are kept in results: results/zoo.json.

    python3 scripts/zoo.py [--check]

`checkpoint` is the run's `best` policy or its `last`. `return` is that of the evaluation in which the `best` policy was found, with mean actions
and the commit that trained it; a `last` policy has none. `sha256` is that of the network's weights, `checkpoints/CHECKPOINT/actor.safetensors`
in the file. `--check` only says whether the index is true.
"""

import argparse
import hashlib
import json
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
RESULTS = ROOT / "results"


def entry(path):
    with zipfile.ZipFile(path) as kept:
        [checkpoint] = {name.split("/")[1] for name in kept.namelist() if name.startswith("checkpoints/")}
        names = f"checkpoints/{checkpoint}/actor.safetensors", f"checkpoints/{checkpoint}/state.json", "manifest.json"
        weights, state, manifest = map(kept.read, names)
    made_for = json.loads(state)["caller"]
    file = path.relative_to(RESULTS)
    return {
        "run": str(file.with_suffix("")),
        "task": made_for["task"],
        "space": made_for["space"],
        "checkpoint": checkpoint,
        "step": made_for["step"],
        "return": round(made_for["evaluation_return"], 1) if checkpoint == "best" else None,
        "file": str(file),
        "sha256": hashlib.sha256(weights).hexdigest(),
        "commit": json.loads(manifest)["commit"],
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--check", action="store_true")
    index = RESULTS / "zoo.json"
    entries = [entry(path) for path in sorted(RESULTS.rglob("seed_*.zip"))]
    text = json.dumps(entries, indent=1) + "\n"
    if not parser.parse_args().check:
        index.write_text(text)
    elif not index.exists() or index.read_text() != text:
        sys.exit("results/zoo.json is not what is there: make it again with scripts/zoo.py")


if __name__ == "__main__":
    main()
