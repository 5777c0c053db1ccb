#!/usr/bin/env python3
"""Regenerate crates/output/reference/survival.csv: what lifelines says about times that some runs never come to.

    python3 -m venv VENV && VENV/bin/pip install lifelines==0.30.0
    VENV/bin/python scripts/survival_reference.py

Columns: times, with a + behind those of runs that were watched so long and had not come there; the median of Kaplan and Meier's estimate (`inf`
where fewer than half came there); an end; the restricted mean up to it. Read by crates/output/src/survival.rs.
"""

import csv
from pathlib import Path

import numpy as np
from lifelines import KaplanMeierFitter
from lifelines.utils import restricted_mean_survival_time
from whole_file import whole_file

OUT = Path(__file__).resolve().parent.parent / "crates" / "output" / "reference" / "survival.csv"


def main():
    rng = np.random.default_rng(4)
    samples = []
    for count, horizon in [(5, 90), (10, 60), (10, 30), (7, 1000), (4, 5)]:
        times = np.round(rng.exponential(50, count) / 5 + 1) * 5
        samples.append((np.minimum(times, horizon), times <= horizon))
    # Runs that were stopped at several times, one when another came there.
    samples.append((np.array([10.0, 20.0, 20.0, 30.0, 40.0, 50.0]), np.array([True, True, False, False, True, False])))
    with whole_file(OUT) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["times", "median", "until", "restricted_mean"])
        for times, came in samples:
            fitted = KaplanMeierFitter().fit(times, came)
            until = float(times.max()) * 0.9
            mean = restricted_mean_survival_time(fitted, until)
            text = " ".join(f"{time}{'' if there else '+'}" for time, there in zip(times, came))
            writer.writerow([text, repr(float(fitted.median_survival_time_)), repr(until), repr(float(mean))])


if __name__ == "__main__":
    main()
