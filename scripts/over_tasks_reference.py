#!/usr/bin/env python3
"""Regenerate experiments/reference/over_tasks.csv: what rliable says about the returns of a space over three tasks.

    python3 -m venv VENV && VENV/bin/pip install rliable==1.2.0 scipy==1.17.1 "pandas<3"
    VENV/bin/python scripts/over_tasks_reference.py

Columns: the returns of every run, `;` between the tasks; interquartile mean over all of them, its 95 % interval with every task redrawn by
itself (50 000 resamples), mean, median of the tasks' means; the shares of runs above 0, 50, ... 450. Read by experiments/src/report/over_tasks.rs.
"""

import csv
from pathlib import Path

import numpy as np
from rliable import library, metrics
from whole_file import whole_file

OUT = Path(__file__).resolve().parent.parent / "experiments" / "reference" / "over_tasks.csv"
HEIGHTS = np.arange(0, 500, 50)


def main():
    rng = np.random.default_rng(5)
    OUT.parent.mkdir(exist_ok=True)
    with whole_file(OUT) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow("returns iqm iqm_low iqm_high mean median shares".split())
        for runs in [5, 8, 10]:
            # Runs x tasks, each task at a level of its own.
            returns = np.round(rng.normal([430, 250, 380], [30, 120, 40], (runs, 3)), 2)
            several = lambda x: np.array([metrics.aggregate_iqm(x), metrics.aggregate_mean(x), metrics.aggregate_median(x)])
            points, intervals = library.get_interval_estimates({"x": returns}, several, reps=50_000, random_state=np.random.RandomState(1))
            shares = library.create_performance_profile({"x": returns}, HEIGHTS, reps=200)[0]["x"]
            iqm, mean, median = points["x"]
            numbers = [iqm, *intervals["x"][:, 0], mean, median]
            text = ";".join(" ".join(map(str, task)) for task in returns.T.tolist())
            writer.writerow([text] + [repr(float(x)) for x in numbers] + [" ".join(repr(float(x)) for x in shares)])


if __name__ == "__main__":
    main()
