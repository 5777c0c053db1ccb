#!/usr/bin/env python3
"""Regenerate crates/output/reference/rank_test.csv and stratified.csv: what SciPy says about small samples.

    python3 -m venv VENV && VENV/bin/pip install scipy==1.17.1
    VENV/bin/python scripts/rank_test_reference.py

Columns: two samples; the exact two-sided p of the rank-sum test (every way to split the ranks, tied values sharing theirs:
scipy.stats.permutation_test; without ties that of scipy.stats.mannwhitneyu). In stratified.csv: strata, `;` between them, each two samples
with `|` between; p of the sum of the ranks that the first samples have within their strata, every way to split every stratum counted one by
one. Read by crates/output/src/rank_test.rs.
"""

import csv
import itertools
from pathlib import Path

import numpy as np
from scipy.stats import mannwhitneyu, permutation_test, rankdata
from whole_file import whole_file

REFERENCE = Path(__file__).resolve().parent.parent / "crates" / "output" / "reference"
OUT, STRATIFIED = REFERENCE / "rank_test.csv", REFERENCE / "stratified.csv"


def p_of(a, b):
    ranks = rankdata(np.concatenate([a, b]))

    def rank_sum(x, y, axis):
        return x.sum(axis=axis)

    first, second = ranks[: len(a)], ranks[len(a) :]
    p = permutation_test((first, second), rank_sum, n_resamples=np.inf, alternative="two-sided", vectorized=True).pvalue
    if len(set(ranks)) == len(ranks):
        exact = mannwhitneyu(a, b, method="exact").pvalue
        assert abs(p - exact) < 1e-9, (p, exact)
    return min(p, 1.0)


def stratified_p_of(strata):
    """Each stratum is a pair of samples."""
    of_first, sums = 0.0, []
    for a, b in strata:
        ranks = rankdata(np.concatenate([a, b]))
        of_first += ranks[: len(a)].sum()
        sums.append([sum(split) for split in itertools.combinations(ranks, len(a))])
    totals = np.array([sum(one_of_each) for one_of_each in itertools.product(*sums)])
    return min(1.0, 2 * min(np.mean(totals <= of_first + 1e-9), np.mean(totals >= of_first - 1e-9)))


def main():
    rng = np.random.default_rng(3)
    samples = []
    for count_a, count_b, shift in [(3, 3, 50), (4, 5, 0), (5, 5, 40), (8, 8, 20), (10, 7, 30), (10, 10, 25)]:
        samples.append((np.round(rng.normal(440 + shift, 30, count_a), 3), np.round(rng.normal(440, 30, count_b), 3)))
    # Shares of ten episodes: many ties. And a run that never succeeded.
    samples.append((np.array([1.0, 1.0, 0.9, 1.0, 1.0]), np.array([0.0, 1.0, 0.4, 0.0, 0.9])))
    samples.append((np.array([1.0, 1.0, 1.0]), np.array([1.0, 1.0, 1.0, 1.0])))
    samples.append((np.array([30.0, 40.0, np.inf]), np.array([50.0, np.inf, np.inf, 60.0])))
    with whole_file(OUT) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["a", "b", "p"])
        for a, b in samples:
            writer.writerow([" ".join(map(str, a.tolist())), " ".join(map(str, b.tolist())), repr(float(p_of(a, b)))])

    # Strata at levels of their own, unequal sizes, ties.
    stages = []
    for sizes, shift in [([(5, 5), (5, 5)], 25), ([(3, 4), (4, 3), (3, 3)], 20), ([(2, 5), (5, 2)], 0)]:
        levels = rng.normal(300, 100, len(sizes))
        stages.append([(np.round(rng.normal(x + shift, 20, n), 3), np.round(rng.normal(x, 20, m), 3)) for x, (n, m) in zip(levels, sizes)])
    stages.append([(np.array([1.0, 0.9, 1.0, 0.8]), np.array([0.9, 0.9, 0.4, 1.0])), (np.array([0.2, 0.0, 0.2]), np.array([0.0, 0.0, 0.2]))])
    with whole_file(STRATIFIED) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["strata", "p"])
        for strata in stages:
            text = ";".join("|".join(" ".join(map(str, sample.tolist())) for sample in pair) for pair in strata)
            writer.writerow([text, repr(float(stratified_p_of(strata)))])


if __name__ == "__main__":
    main()
