#!/usr/bin/env python3
"""What a policy that stays at the door's handle would find out if one entry of its action were held at an end of its range.

    scripts/held_entry.py RUN [RUN ...]

RUN: a run folder of Door, or the .zip of a kept policy. After five seconds of mean actions one entry is held, for four seconds at most.
Printed are the actions until the door was open, from four starts. `-`: the door stayed shut, `before`: it was open before. Entries that
open no door are left out. Needs the wheel (`make wheel`).
"""

import sys

import aforce
import numpy as np

BEFORE, HELD = 100, 80  # actions
STARTS = range(1, 5)


def until_open(policy, env, seed, entry, end):
    """Actions of the held entry until the door was open, "before" or None."""
    observation, _ = env.reset(seed=seed)
    for action in range(BEFORE + HELD):
        chosen = np.array(policy.predict(observation)[0])
        if action >= BEFORE:
            chosen[entry] = end
        observation, _, _, _, info = env.step(chosen)
        if info["is_success"]:
            return "before" if action < BEFORE else action - BEFORE + 1
    return None


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    for run in sys.argv[1:]:
        policy = aforce.Policy.load(run)
        env = policy.make()
        print(run)
        for entry, described in enumerate(env.unwrapped.describe()["action"]):
            for end in (-1, 1):
                found = [until_open(policy, env, seed, entry, end) for seed in STARTS]
                if any(actions not in (None, "before") for actions in found):
                    print(f"  {described['name']} {end:+}:", *(actions or "-" for actions in found))


if __name__ == "__main__":
    main()
