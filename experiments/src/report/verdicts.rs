//! Hypotheses written before the runs, compared with the runs: a verdict per hypothesis, all by one rule.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::{Path, PathBuf};

use anyhow::Result;
use output::program::bad;
use output::rank_test::{holm, p_value, smallest_detectable};
use output::statistics::{FEWEST_FOR_INTERVAL, mean, probability_of_improvement, welch_interval};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use settings::parse;
use tasks::TaskName;

use crate::config::label;
use crate::report::summary::RunSummary;

/// Significance level: the probability of at least one false positive in a family.
const LEVEL: f64 = 0.05;

/// Whose episodes a column of `runs.csv` is about: what its name begins with.
const POLICIES: [&str; 4] = ["last_sampled_", "sampled_", "final_", "end_"];

/// The verdict on a hypothesis if one of its sides has no finished run.
pub const NO_RUNS: &str = "no runs";

/// A file of hypotheses, committed before the first run that it is about.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    hypothesis: Vec<Hypothesis>,
}

/// One action space is expected to have more, or less, of something than another.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Hypothesis {
    /// What is expected, in words.
    name: String,
    /// The hypotheses of one family are corrected together by Holm's method. Without a family those of a task in the file are.
    family: Option<String>,
    /// Whether the question may be pooled with the same question about other experiments; by default it may.
    pooled: Option<bool>,
    /// Its tasks; the hypothesis is tested on each task separately.
    tasks: Vec<TaskName>,
    /// Folder of the experiment whose runs are meant, if several have these groups.
    experiment: Option<String>,
    /// A column of `runs.csv`. A run that has no value there because it never succeeded counts with the worst possible value.
    metric: String,
    /// Whether the space is expected above or below the other.
    expected: Expected,
    /// Space, or space and variant, and what it is compared with.
    space: String,
    against: String,
    /// Differences of means below this do not matter.
    margin: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Expected {
    Above,
    Below,
}

/// A row of `verdicts.csv`.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[allow(missing_docs, reason = "documented once, in docs/columns.md")]
pub struct VerdictRow {
    pub experiment: String,
    pub task: String,
    pub hypothesis: String,
    pub metric: String,
    pub space: String,
    pub against: String,
    pub n_space: usize,
    pub n_against: usize,
    pub mean_space: Option<f64>,
    pub mean_against: Option<f64>,
    pub difference: Option<f64>,
    pub ci_low: Option<f64>,
    pub ci_high: Option<f64>,
    pub ratio: Option<f64>,
    pub above: Option<f64>,
    pub p: Option<f64>,
    pub p_holm: Option<f64>,
    pub family: String,
    pub p_holm_all: Option<f64>,
    pub smallest_detectable: Option<f64>,
    pub margin: Option<f64>,
    pub verdict: &'static str,
    /// The values of both sides, and the groups' names with their variants.
    #[serde(skip)]
    pub sides: [Side; 2],
    /// The hypothesis says `pooled = false`.
    #[serde(skip)]
    pub stands_alone: bool,
}

/// One side of a hypothesis: space and variant, and a value per run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Side {
    /// Space and variant.
    pub label: String,
    /// In the order of the runs.
    pub values: Vec<f64>,
}

/// Judges the hypotheses of several files, each file by itself ([`judge`]); `p_holm_all` corrects for the hypotheses of
/// all files together.
///
/// # Errors
/// As [`judge`], or if two files have a family of the same name.
pub fn judge_all(files: &[PathBuf], runs: &[RunSummary]) -> Result<Vec<VerdictRow>> {
    let (mut rows, mut families) = (vec![], HashMap::new());
    for file in files {
        for row in judge(file, runs)? {
            let first = *families.entry(row.family.clone()).or_insert(file);
            if first != file {
                let (first, file, family) = (first.display(), file.display(), &row.family);
                return Err(bad(format!("{file}: {first} has a family {family:?} too: call one of the two otherwise")));
            }
            rows.push(row);
        }
    }
    let known: Vec<&mut VerdictRow> = rows.iter_mut().filter(|row| row.p.is_some()).collect();
    let corrected = holm(&known.iter().filter_map(|row| row.p).collect::<Vec<_>>());
    known.into_iter().zip(corrected).for_each(|(row, p)| row.p_holm_all = Some(p));
    Ok(rows)
}

/// Judges the hypotheses of `file` by those of `runs` that are done.
///
/// The exact two-sided rank test over seeds, corrected by Holm's method within the file's families for those that have runs: below 0.05 a
/// hypothesis is `as expected` or `the other way round`. Else the two are `equal` if Welch's 95 % interval of the difference of
/// their means lies within the margin and each has five runs, and `not decided` if not.
///
/// # Errors
/// If the file is not one of hypotheses, names a metric that runs do not have, or names a side that matches runs of several groups.
pub fn judge(file: &Path, runs: &[RunSummary]) -> Result<Vec<VerdictRow>> {
    let wrong = |problem: String| bad(format!("{}: {problem}", file.display()));
    let File { hypothesis: hypotheses } = parse(&settings::text(file)?).map_err(wrong)?;
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    let numbers: Vec<Value> = runs.iter().map(|run| serde_json::to_value(run).expect("a row")).collect();
    let done: Vec<(&RunSummary, &Value)> = runs.iter().zip(&numbers).filter(|(run, _)| run.done).collect();
    let mut rows: Vec<VerdictRow> = vec![];
    for hypothesis in &hypotheses {
        let metric = hypothesis.metric.as_str();
        if numbers.iter().any(|run| run.get(metric).is_none_or(|value| !value.is_number() && !value.is_null())) {
            return Err(wrong(format!("{:?}: metric {metric:?} is no column of numbers in runs.csv", hypothesis.name)));
        }
        let name = &hypothesis.name;
        if hypothesis.space == hypothesis.against {
            return Err(wrong(format!("{name:?}: space and against are the same")));
        }
        if hypothesis.margin.is_some_and(|margin| margin.is_nan() || margin <= 0.0) {
            return Err(wrong(format!(
                "{name:?}: margin = {:?}: must be above 0",
                hypothesis.margin.unwrap_or_default()
            )));
        }
        let tasks = &hypothesis.tasks;
        if let Some((_, task)) = tasks.iter().enumerate().find(|(at, task)| tasks[..*at].contains(task)) {
            return Err(wrong(format!("{name:?}: names the task {} twice", task.as_str())));
        }
        for task in tasks {
            let of_hypothesis = |problem: String| wrong(format!("{name:?}: {problem}"));
            let (experiment, sides) = sides(hypothesis, task.as_str(), runs, &done).map_err(of_hypothesis)?;
            rows.push(VerdictRow {
                family: hypothesis.family.clone().unwrap_or_else(|| format!("{stem}, {}", task.as_str())),
                stands_alone: hypothesis.pooled == Some(false),
                ..row(hypothesis, task.as_str(), experiment, sides)
            });
        }
    }
    let families: BTreeSet<String> = rows.iter().map(|row| row.family.clone()).collect();
    families.iter().for_each(|family| correct(rows.iter_mut().filter(|row| row.family == *family)));
    let expected = hypotheses.iter().flat_map(|hypothesis| hypothesis.tasks.iter().map(|_| hypothesis.expected));
    rows.iter_mut().zip(expected).for_each(|(row, expected)| row.verdict = verdict(row, expected));
    Ok(rows)
}

/// The experiment and the values of both sides of a hypothesis on a task, from the runs that are `done`; or the reason
/// why the runs do not form two groups.
fn sides(
    hypothesis: &Hypothesis,
    task: &str,
    runs: &[RunSummary],
    done: &[(&RunSummary, &Value)],
) -> Result<(String, [Side; 2]), String> {
    let metric = hypothesis.metric.as_str();
    let is_meant = |run: &&RunSummary| {
        let named = hypothesis.experiment.as_ref().is_none_or(|named| *named == run.experiment);
        named && run.task == task
    };
    let meant: Vec<&RunSummary> = runs.iter().filter(is_meant).collect();
    let labels = [label_of(&hypothesis.space, &meant)?, label_of(&hypothesis.against, &meant)?];
    if labels[0] == labels[1] {
        return Err(format!("space and against are the same runs, {}", labels[0]));
    }
    let (mut seeds, mut presets, mut experiments) = (HashSet::new(), BTreeSet::new(), BTreeSet::new());
    // Results depend on the number of actions, so all runs need the same.
    let mut lengths = BTreeSet::new();
    let mut sides = labels.map(|label| Side { label, values: vec![] });
    for (run, numbers) in done.iter().filter(|(run, _)| is_meant(run)) {
        let label = label(&run.space, &run.variant);
        let Some(side) = sides.iter().position(|side| side.label == label) else { continue };
        experiments.insert(run.experiment.as_str());
        presets.insert(if run.preset.is_empty() { "another learner" } else { run.preset.as_str() });
        lengths.extend(run.steps);
        let id = format!("{} {label} {}", run.task, run.seed);
        let value = numbers[metric].as_f64().or(worst(metric, numbers));
        sides[side].values.push(value.ok_or_else(|| format!("{id} has no {metric}: its tables do not tell it"))?);
        if !seeds.insert((side, run.seed)) {
            return Err(format!("two runs of {id}: name the experiment"));
        }
    }
    for (several, problem) in [(&presets, "trained with"), (&experiments, "of experiments")] {
        if several.len() > 1 {
            return Err(format!("runs {problem} {}", several.iter().copied().collect::<Vec<_>>().join(" and ")));
        }
    }
    if let [shortest, .., longest] = lengths.into_iter().collect::<Vec<_>>()[..] {
        return Err(format!("runs of {shortest} and {longest} actions: take the shorter ones on"));
    }
    let found = experiments.first().map(ToString::to_string);
    Ok((hypothesis.experiment.clone().or(found).unwrap_or_default(), sides))
}

/// Corrects the p of one family.
fn correct<'a>(family: impl Iterator<Item = &'a mut VerdictRow>) {
    let mut family: Vec<_> = family.filter_map(|row| Some((row.p?, row))).collect();
    let corrected = holm(&family.iter().map(|(p, _)| *p).collect::<Vec<_>>());
    // The level with which Holm's method compares the smallest p of the family.
    let level = LEVEL / family.len() as f64;
    for ((_, row), p) in family.iter_mut().zip(corrected) {
        row.p_holm = Some(p);
        let [a, b] = row.sides.each_ref().map(|side| side.values.as_slice());
        row.smallest_detectable = smallest_detectable(a, b, level).filter(|&d| d <= largest_difference(&row.metric));
    }
}

/// The label of the group that a hypothesis names. A space whose runs all have the same variant may be named without
/// it.
pub(crate) fn label_of(space: &str, meant: &[&RunSummary]) -> Result<String, String> {
    let labels = |of: &dyn Fn(&RunSummary) -> bool| -> BTreeSet<String> {
        meant.iter().filter(|run| of(run)).map(|run| label(&run.space, &run.variant)).collect()
    };
    if labels(&|_| true).contains(space) {
        return Ok(space.into());
    }
    let variants: Vec<String> = labels(&|run| run.space == space).into_iter().collect();
    match variants.as_slice() {
        [] => Ok(space.into()),
        [only] => Ok(only.clone()),
        several => Err(format!("{space} has variants: name one of {}", several.join(" and "))),
    }
}

/// The value that counts for the run of these `numbers`, which lacks one in `metric` because its task was never
/// fulfilled: infinite time, energy or force, or the lowest of all shares. `None` if the run may have fulfilled its task
/// but its tables lack the column.
fn worst(metric: &str, numbers: &Value) -> Option<f64> {
    if metric.ends_with("_to_450") {
        return numbers["steps_to_450"].is_null().then_some(f64::INFINITY);
    }
    let policy = POLICIES.into_iter().find(|policy| metric.starts_with(policy))?;
    let is_share = metric.ends_with("_to_success");
    let waits = is_share || ["_to_success_", "_fulfilled_"].iter().any(|part| metric.contains(part));
    let failed = numbers[format!("{policy}success")].as_f64() == Some(0.0);
    (waits && failed).then_some(if is_share { f64::NEG_INFINITY } else { f64::INFINITY })
}

/// The largest possible difference of two means of this metric: a share lies between 0 and 1.
fn largest_difference(metric: &str) -> f64 {
    let of_episode = POLICIES.iter().find_map(|policy| metric.strip_prefix(policy));
    let is_success = of_episode.is_some_and(|name| {
        let ways = ["", "_any", "_held", "_by_hand", "_without_hand", "_before_stop"];
        name.strip_prefix("success").is_some_and(|way| ways.contains(&way) || way.starts_with("_within_"))
    });
    let is_part = metric.starts_with("at_k_") || metric.ends_with("_share") || metric.contains("_share_");
    if is_success || is_part { 1.0 } else { f64::MAX }
}

/// A row without the numbers that depend on other hypotheses.
fn row(hypothesis: &Hypothesis, task: &str, experiment: String, sides: [Side; 2]) -> VerdictRow {
    let [a, b] = sides.each_ref().map(|side| side.values.as_slice());
    let finite = |sample: &[f64]| Some(mean(sample)).filter(|mean| mean.is_finite());
    let (mean_a, mean_b) = (finite(a), finite(b));
    let ci = welch_interval(a, b);
    let both = !a.is_empty() && !b.is_empty();
    VerdictRow {
        experiment,
        task: task.into(),
        hypothesis: hypothesis.name.clone(),
        metric: hypothesis.metric.clone(),
        space: hypothesis.space.clone(),
        against: hypothesis.against.clone(),
        n_space: a.len(),
        n_against: b.len(),
        mean_space: mean_a,
        mean_against: mean_b,
        difference: mean_a.zip(mean_b).map(|(a, b)| a - b),
        ci_low: ci.map(|ci| ci[0]),
        ci_high: ci.map(|ci| ci[1]),
        // Above 1 where `space` has less.
        ratio: mean_a.zip(mean_b).map(|(a, b)| b / a).filter(|ratio| ratio.is_finite()),
        above: both.then(|| probability_of_improvement(a, b)),
        p: both.then(|| p_value(a, b)),
        p_holm: None,
        family: String::new(),
        p_holm_all: None,
        smallest_detectable: None,
        margin: hypothesis.margin,
        verdict: "",
        sides,
        stands_alone: false,
    }
}

fn verdict(row: &VerdictRow, expected: Expected) -> &'static str {
    let Some(p) = row.p_holm else { return NO_RUNS };
    if p < LEVEL {
        // The direction is that of the ranks, as in p, because a mean may be infinite.
        let above = row.above.is_some_and(|share| share > 0.5);
        return if above == (expected == Expected::Above) { "as expected" } else { "the other way round" };
    }
    let within = |margin: f64| row.ci_low.zip(row.ci_high).is_some_and(|(low, high)| -margin < low && high < margin);
    // With few runs both sides may agree by chance.
    let enough = row.n_space.min(row.n_against) >= FEWEST_FOR_INTERVAL;
    if enough && row.margin.is_some_and(within) { "equal" } else { "not decided" }
}

#[cfg(test)]
mod tests;
