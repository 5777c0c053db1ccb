#!/usr/bin/env python3
"""Regenerate crates/output/reference/statistics.csv: what NumPy, SciPy and rliable say about small samples.

    python3 -m venv VENV && VENV/bin/pip install rliable==1.2.0 scipy==1.17.1 "pandas<3"
    VENV/bin/python scripts/statistics_reference.py

Columns: two samples (a and b), then of a: mean, deviation (n - 1), median, interquartile mean (scipy.stats.trim_mean); the probability
that a exceeds b; 95 % percentile-bootstrap intervals of the interquartile mean and of that probability (rliable, 50 000 resamples);
Welch's 95 % interval of the difference of means (scipy.stats.ttest_ind), Student's of the mean of a (scipy.stats.ttest_1samp).
Read by crates/output/src/statistics.rs.
"""

import csv
from pathlib import Path

import numpy as np
from rliable import library, metrics
from scipy.stats import trim_mean, ttest_1samp, ttest_ind
from whole_file import whole_file

OUT = Path(__file__).resolve().parent.parent / "crates" / "output" / "reference" / "statistics.csv"
REPS = 50_000


def interval(scores, statistic):
    _, intervals = library.get_interval_estimates({"x": scores}, lambda *x: np.array([statistic(*x)]), reps=REPS, random_state=np.random.RandomState(1))
    return intervals["x"].ravel()


def main():
    rng = np.random.default_rng(2)
    samples = []
    for count_a, count_b in [(3, 3), (4, 5), (5, 5), (8, 8), (10, 7)]:
        a, b = np.round(rng.normal(440, 30, count_a), 3), np.round(rng.normal(420, 40, count_b), 3)
        samples.append((a, b))
    # Ties count half.
    samples.append((np.array([1.0, 2.0, 2.0, 3.0]), np.array([2.0, 2.0, 4.0])))
    OUT.parent.mkdir(exist_ok=True)
    with whole_file(OUT) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow("a b mean deviation median iqm poi iqm_low iqm_high poi_low poi_high welch_low welch_high student_low student_high".split())
        for a, b in samples:
            column_a, column_b = a[:, None], b[:, None]  # runs x tasks
            iqm = interval(column_a, lambda x: trim_mean(x.ravel(), 0.25))
            poi = interval((column_a, column_b), lambda x, y: metrics.probability_of_improvement(x, y))
            welch = ttest_ind(a, b, equal_var=False).confidence_interval()
            student = ttest_1samp(a, 0).confidence_interval()
            numbers = [a.mean(), a.std(ddof=1), np.median(a), trim_mean(a, 0.25), metrics.probability_of_improvement(column_a, column_b), *iqm, *poi, *welch, *student]
            writer.writerow([" ".join(map(repr, map(float, a))), " ".join(map(repr, map(float, b)))] + [repr(float(x)) for x in numbers])


if __name__ == "__main__":
    main()
