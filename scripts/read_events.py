#!/usr/bin/env python3
"""Prints what TensorBoard reads in a folder: JSON, a list of [step, value] for every tag.

    python3 scripts/read_events.py RUN_FOLDER

Needs tensorboard (pip). `experiments/tests/tensorboard.rs` calls it, with the Python in PYTHON if that is set.
"""

import json
import sys

from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

if len(sys.argv) != 2:
    sys.exit(__doc__)
events = EventAccumulator(sys.argv[1], size_guidance={"tensors": 0, "scalars": 0})
events.Reload()
tags = events.Tags()["scalars"]
print(json.dumps({tag: [[event.step, event.value] for event in events.Scalars(tag)] for tag in tags}))
