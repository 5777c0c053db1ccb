#!/usr/bin/env python3
"""Regenerate the reference tables of the workbench's statistics, with libraries that others wrote.

    python3 -m venv VENV && VENV/bin/pip install lifelines==0.30.0 rliable==1.2.0 scipy==1.17.1 "pandas<3"
    VENV/bin/python scripts/statistics_reference.py

crates/output/reference/statistics.csv (NumPy, SciPy, rliable), read by crates/output/src/statistics.rs: two samples (a and b), then of a: mean,
deviation (n - 1), median, interquartile mean (scipy.stats.trim_mean); the probability that a exceeds b; 95 % percentile-bootstrap intervals
of the interquartile mean and of that probability (rliable, 50 000 resamples); Welch's 95 % interval of the difference of means
(scipy.stats.ttest_ind), Student's of the mean of a (scipy.stats.ttest_1samp).

crates/output/reference/rank_test.csv (SciPy), read by crates/output/src/rank_test.rs: two samples; the exact two-sided p of the rank-sum test (every
way to split the ranks, tied values sharing theirs: scipy.stats.permutation_test; without ties that of scipy.stats.mannwhitneyu).

crates/output/reference/stratified.csv, read by the same file: strata, `;` between them, each two samples with `|` between; p of the sum of the ranks
that the first samples have within their strata, every way to split every stratum counted one by one.

crates/output/reference/survival.csv (lifelines), read by crates/output/src/survival.rs: times, with a + behind those of runs that were watched so long
and had not come there; the median of Kaplan and Meier's estimate (`inf` where fewer than half came there); an end; the restricted mean up
to it.

experiments/reference/over_tasks.csv (rliable), read by experiments/src/report/over_tasks.rs: the returns of every run, `;` between the tasks;
interquartile mean over all of them, its 95 % interval with every task redrawn by itself (50 000 resamples), mean, median of the tasks'
means; the shares of runs above 0, 50, ... 450.

Bootstrap intervals depend on the release of `arch`, which rliable installs: another release draws other resamples.
"""

import csv
import itertools
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from lifelines import KaplanMeierFitter
from lifelines.utils import restricted_mean_survival_time
from rliable import library, metrics
from scipy.stats import mannwhitneyu, permutation_test, rankdata, trim_mean, ttest_1samp, ttest_ind
from whole_file import whole_file

ROOT = Path(__file__).resolve().parent.parent
OF_SAMPLES = ROOT / "crates" / "output" / "reference"
OF_TASKS = ROOT / "experiments" / "reference"
RESAMPLES = 50_000
HEIGHTS = np.arange(0, 500, 50)


@contextmanager
def table(path, header):
    """A CSV file with these columns, given as words."""
    path.parent.mkdir(exist_ok=True)
    with whole_file(path) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header.split())
        yield writer


def joined(numbers):
    return " ".join(map(str, np.asarray(numbers).tolist()))


def exact(numbers):
    return [repr(float(x)) for x in numbers]


def interval(scores, statistic):
    _, intervals = library.get_interval_estimates({"x": scores}, lambda *x: np.array([statistic(*x)]), reps=RESAMPLES, random_state=np.random.RandomState(1))
    return intervals["x"].ravel()


def statistics():
    rng = np.random.default_rng(2)
    samples = []
    for count_a, count_b in [(3, 3), (4, 5), (5, 5), (8, 8), (10, 7)]:
        a, b = np.round(rng.normal(440, 30, count_a), 3), np.round(rng.normal(420, 40, count_b), 3)
        samples.append((a, b))
    # Ties count half.
    samples.append((np.array([1.0, 2.0, 2.0, 3.0]), np.array([2.0, 2.0, 4.0])))
    header = "a b mean deviation median iqm poi iqm_low iqm_high poi_low poi_high welch_low welch_high student_low student_high"
    with table(OF_SAMPLES / "statistics.csv", header) as writer:
        for a, b in samples:
            column_a, column_b = a[:, None], b[:, None]  # runs x tasks
            iqm = interval(column_a, lambda x: trim_mean(x.ravel(), 0.25))
            poi = interval((column_a, column_b), lambda x, y: metrics.probability_of_improvement(x, y))
            welch = ttest_ind(a, b, equal_var=False).confidence_interval()
            student = ttest_1samp(a, 0).confidence_interval()
            numbers = [a.mean(), a.std(ddof=1), np.median(a), trim_mean(a, 0.25), metrics.probability_of_improvement(column_a, column_b), *iqm, *poi, *welch, *student]
            writer.writerow([joined(a), joined(b), *exact(numbers)])


def p_of(a, b):
    ranks = rankdata(np.concatenate([a, b]))

    def rank_sum(x, y, axis):
        return x.sum(axis=axis)

    first, second = ranks[: len(a)], ranks[len(a) :]
    p = permutation_test((first, second), rank_sum, n_resamples=np.inf, alternative="two-sided", vectorized=True).pvalue
    if len(set(ranks)) == len(ranks):
        untied = mannwhitneyu(a, b, method="exact").pvalue
        assert abs(p - untied) < 1e-9, (p, untied)
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


def rank_tests():
    rng = np.random.default_rng(3)
    samples = []
    for count_a, count_b, shift in [(3, 3, 50), (4, 5, 0), (5, 5, 40), (8, 8, 20), (10, 7, 30), (10, 10, 25)]:
        samples.append((np.round(rng.normal(440 + shift, 30, count_a), 3), np.round(rng.normal(440, 30, count_b), 3)))
    # Shares of ten episodes: many ties. And a run that never succeeded.
    samples.append((np.array([1.0, 1.0, 0.9, 1.0, 1.0]), np.array([0.0, 1.0, 0.4, 0.0, 0.9])))
    samples.append((np.array([1.0, 1.0, 1.0]), np.array([1.0, 1.0, 1.0, 1.0])))
    samples.append((np.array([30.0, 40.0, np.inf]), np.array([50.0, np.inf, np.inf, 60.0])))
    with table(OF_SAMPLES / "rank_test.csv", "a b p") as writer:
        for a, b in samples:
            writer.writerow([joined(a), joined(b), *exact([p_of(a, b)])])

    # Strata at levels of their own, unequal sizes, ties.
    stages = []
    for sizes, shift in [([(5, 5), (5, 5)], 25), ([(3, 4), (4, 3), (3, 3)], 20), ([(2, 5), (5, 2)], 0)]:
        levels = rng.normal(300, 100, len(sizes))
        stages.append([(np.round(rng.normal(x + shift, 20, n), 3), np.round(rng.normal(x, 20, m), 3)) for x, (n, m) in zip(levels, sizes)])
    stages.append([(np.array([1.0, 0.9, 1.0, 0.8]), np.array([0.9, 0.9, 0.4, 1.0])), (np.array([0.2, 0.0, 0.2]), np.array([0.0, 0.0, 0.2]))])
    with table(OF_SAMPLES / "stratified.csv", "strata p") as writer:
        for strata in stages:
            text = ";".join("|".join(joined(sample) for sample in pair) for pair in strata)
            writer.writerow([text, *exact([stratified_p_of(strata)])])


def survival():
    rng = np.random.default_rng(4)
    samples = []
    for count, horizon in [(5, 90), (10, 60), (10, 30), (7, 1000), (4, 5)]:
        times = np.round(rng.exponential(50, count) / 5 + 1) * 5
        samples.append((np.minimum(times, horizon), times <= horizon))
    # Runs that were stopped at several times, one when another came there.
    samples.append((np.array([10.0, 20.0, 20.0, 30.0, 40.0, 50.0]), np.array([True, True, False, False, True, False])))
    with table(OF_SAMPLES / "survival.csv", "times median until restricted_mean") as writer:
        for times, came in samples:
            fitted = KaplanMeierFitter().fit(times, came)
            until = float(times.max()) * 0.9
            mean = restricted_mean_survival_time(fitted, until)
            text = " ".join(f"{time}{'' if there else '+'}" for time, there in zip(times, came))
            writer.writerow([text, *exact([fitted.median_survival_time_, until, mean])])


def over_tasks():
    rng = np.random.default_rng(5)
    with table(OF_TASKS / "over_tasks.csv", "returns iqm iqm_low iqm_high mean median shares") as writer:
        for runs in [5, 8, 10]:
            # Runs x tasks, each task at a level of its own.
            returns = np.round(rng.normal([430, 250, 380], [30, 120, 40], (runs, 3)), 2)
            several = lambda x: np.array([metrics.aggregate_iqm(x), metrics.aggregate_mean(x), metrics.aggregate_median(x)])
            points, intervals = library.get_interval_estimates({"x": returns}, several, reps=RESAMPLES, random_state=np.random.RandomState(1))
            shares = library.create_performance_profile({"x": returns}, HEIGHTS, reps=200)[0]["x"]
            iqm, mean, median = points["x"]
            text = ";".join(joined(task) for task in returns.T)
            writer.writerow([text, *exact([iqm, *intervals["x"][:, 0], mean, median]), " ".join(exact(shares))])


if __name__ == "__main__":
    for make in [statistics, rank_tests, survival, over_tasks]:
        make()
