//! What a hidden disturbance costs trained policies: a row per group and disturbance.

use anyhow::{Context, Result, ensure};
use output::statistics::{mean, mean_of, student_interval, with_width};
use serde::Serialize;
use show::plot::{HeatMap, HeatRow};

use crate::config;
use crate::report::columns::Columns;
use crate::report::groups::Group;
use crate::report::record::Record;
use crate::report::summary::{RunSummary, label};
use crate::report::table::Table;
use crate::run::disturbances::UNDISTURBED;
use crate::run::which::Which;

/// A row of `robustness.csv`.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "documented once, in docs/columns.md")]
pub struct DisturbedRow {
    pub experiment: String,
    pub task: String,
    pub space: String,
    pub variant: String,
    pub preset: String,
    pub checkpoint: &'static str,
    pub disturbance: String,
    pub n_seeds: usize,
    pub episodes: usize,
    pub success: f64,
    pub success_undisturbed: f64,
    pub success_change_low: Option<f64>,
    pub success_change_high: Option<f64>,
    pub return_mean: f64,
    pub return_undisturbed: f64,
    pub relative_loss: Option<f64>,
    pub ci_low: Option<f64>,
    pub ci_high: Option<f64>,
    pub energy_ratio: Option<f64>,
    pub largest_force_ratio: Option<f64>,
}

/// A policy's means over the episodes of a case.
#[derive(Clone, Copy)]
struct Means {
    episodes: usize,
    success: f64,
    total: f64,
    energy: f64,
    force: f64,
}

impl Means {
    fn of(table: &Columns) -> Result<Self> {
        let column = |name| table.values(name);
        let totals = column("return")?;
        Ok(Means {
            episodes: totals.len(),
            success: mean(&column("success")?),
            total: mean(&totals),
            energy: mean(&column("energy_per_action_j")?),
            force: mean(&column("arm_max_contact_force_n")?),
        })
    }
}

/// The rows of a group, over those of its runs for which `evaluate --disturb` left a table; `rows` are the summaries of `runs`.
///
/// # Errors
/// If a table cannot be read, has no undisturbed episodes or is of a policy that is neither the run's best nor its last,
/// or if some runs of the group played their best policy and others their last.
pub fn disturbed(group: &Group, runs: &[Record], rows: &[RunSummary]) -> Result<Vec<DisturbedRow>> {
    // By disturbance, in the order of the first table: undisturbed and disturbed means of every run.
    let mut cases: Vec<(String, Vec<[Means; 2]>)> = vec![];
    // Whether each run so far was played with its best policy, and with its last.
    let mut all = [true; 2];
    for (run, _) in runs.iter().zip(rows).filter(|(_, row)| group.has(row)) {
        let Some(played) = run.csv(Table::Disturbed)?.map(Columns::of).transpose()? else { continue };
        let (tables, path) = (played.by_text("disturbance")?, run.place(Table::Disturbed));
        let of = run.policies_of(Table::Disturbed, &played)?;
        all = [all[0] && of[0], all[1] && of[1]];
        ensure!(all.contains(&true), "{path}: of its group some runs played their best policy, others their last");
        let of = |name: &str| tables.iter().find(|(case, _)| case == name).map(|(_, table)| Means::of(table));
        let undisturbed = of(UNDISTURBED).with_context(|| format!("{path}: no undisturbed episodes"))??;
        for (name, table) in tables.iter().filter(|(name, _)| name != UNDISTURBED) {
            let pair = [undisturbed, Means::of(table)?];
            match cases.iter_mut().find(|(case, _)| case == name) {
                Some((_, pairs)) => pairs.push(pair),
                None => cases.push((name.clone(), vec![pair])),
            }
        }
    }
    let row = |(disturbance, pairs): (String, Vec<[Means; 2]>)| {
        let over_runs = |of: fn(&Means) -> f64| [0, 1].map(|at| mean_of(&pairs, |pair| of(&pair[at])));
        let [success_undisturbed, success] = over_runs(|m| m.success);
        let changes: Vec<f64> = pairs.iter().map(|[without, with]| with.success - without.success).collect();
        let change = student_interval(&changes).and_then(with_width);
        let totals = over_runs(|m| m.total);
        // Both means are over the same runs and starts. The share is computed from the means over runs, because a single
        // run may have a return of 0.
        let loss = |[without, with]: [f64; 2]| (without > 0.0).then_some(1.0 - with / without);
        let ratio = |[without, with]: [f64; 2]| (without > 0.0).then_some(with / without);
        let [without, with] = [0, 1].map(|at| pairs.iter().map(|pair| pair[at].total).collect::<Vec<f64>>());
        let relative_loss = loss(totals);
        // The interval of a ratio of two means, from the residuals: what each run lost less that share of its
        // undisturbed return (Cochran, Sampling Techniques, 1977, eq. 6.13).
        let interval = |share: f64| {
            let beyond = |(without, with): (&f64, &f64)| without - with - share * without;
            let ends = student_interval(&without.iter().zip(&with).map(beyond).collect::<Vec<f64>>())?;
            Some(ends.map(|end| share + end / totals[0]))
        };
        let ci = relative_loss.and_then(interval).and_then(with_width);
        DisturbedRow {
            experiment: group.section.experiment.into(),
            task: group.section.task.into(),
            space: group.space.into(),
            variant: group.variant.into(),
            preset: group.preset.into(),
            checkpoint: if all[0] { Which::Best } else { Which::Last }.name(),
            disturbance,
            n_seeds: pairs.len(),
            episodes: pairs.iter().map(|[_, with]| with.episodes).sum(),
            success,
            success_undisturbed,
            success_change_low: change.map(|ends| ends[0]),
            success_change_high: change.map(|ends| ends[1]),
            return_mean: totals[1],
            return_undisturbed: totals[0],
            relative_loss,
            ci_low: ci.map(|ci| ci[0]),
            ci_high: ci.map(|ci| ci[1]),
            energy_ratio: ratio(over_runs(|m| m.energy)),
            largest_force_ratio: ratio(over_runs(|m| m.force)),
        }
    };
    Ok(cases.into_iter().map(row).collect())
}

/// The share of its return that every group loses under every disturbance.
pub fn heat_map(rows: &[DisturbedRow]) -> HeatMap {
    let mut columns: Vec<String> = vec![];
    for row in rows {
        if !columns.contains(&row.disturbance) {
            columns.push(row.disturbance.clone());
        }
    }
    let section = |row: &DisturbedRow| (row.experiment.clone(), row.task.clone());
    let key = |row: &DisturbedRow| (section(row), label(&row.space, &row.variant, &row.preset));
    let of_group = |of_group: &[DisturbedRow]| {
        let ((experiment, task), label) = key(&of_group[0]);
        // Labels leave the preset out if all rows of a heading have the same.
        let one_preset =
            rows.iter().filter(|row| section(row) == section(&of_group[0])).all(|row| row.preset == of_group[0].preset);
        let label = if one_preset { config::label(&of_group[0].space, &of_group[0].variant) } else { label };
        let heading = if experiment.is_empty() { task } else { format!("{task}, stage {experiment}") };
        let rows = of_group;
        let share = |column: &String| rows.iter().find(|row| row.disturbance == *column)?.relative_loss;
        HeatRow { heading, label, shares: columns.iter().map(share).collect() }
    };
    let rows = rows.chunk_by(|one, next| key(one) == key(next)).map(of_group).collect();
    HeatMap { title: "Return lost, in per cent of the undisturbed return".into(), columns, rows }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::groups::groups;
    use crate::report::summary::tests::{rewrite, run};
    use crate::run::folder::RunFolder;

    #[test]
    fn a_disturbed_episode_is_held_against_the_undisturbed_ones_of_its_run() {
        let root = tempfile::tempdir().unwrap();
        let folders = [1, 2, 3].map(|seed| root.path().join(format!("lift/osc/seed_{seed}")));
        let rows = folders.each_ref().map(|folder| {
            let name = folder.strip_prefix(root.path()).unwrap().to_str().unwrap();
            run(root.path(), name, 2.0, 0.0)
        });
        let runs = folders.each_ref().map(|folder| Record::of_folder(&RunFolder::at(folder)).unwrap());
        let folders = folders.each_ref().map(|folder| RunFolder::at(folder));
        // In the first run's episodes nothing is touched; the third run was not disturbed.
        let header = "disturbance,policy,schema,step,success,return,energy_per_action_j,arm_max_contact_force_n";
        for (folder, with) in folders.iter().zip([
            "push,mean,6,80000,false,40,3,0\npush,mean,6,80000,true,60,3,0\n",
            "push,mean,6,80000,true,300,3,30\n",
        ]) {
            let without = if with.contains("300") {
                "none,mean,6,80000,true,400,2,10\n"
            } else {
                "none,mean,6,80000,true,100,2,0\n"
            };
            fs_err::write(folder.disturbed(), format!("{header}\n{without}{with}")).unwrap();
        }
        let groups = groups(&rows);
        let found = disturbed(&groups[0], &runs, &rows).unwrap();
        let [row] = found.as_slice() else { panic!("one disturbance: {found:?}") };
        assert_eq!((row.disturbance.as_str(), row.n_seeds, row.episodes), ("push", 2, 3));
        assert_eq!((row.success, row.success_undisturbed), (0.75, 1.0));
        // One run fails in half of its episodes, the other in none: a mean of -0.25, a standard error of 0.25, one degree of freedom.
        let change = [row.success_change_low, row.success_change_high].map(Option::unwrap);
        assert!(change.iter().zip([-1.0, 1.0]).all(|(end, side)| (end + 0.25 - side * 12.7062 * 0.25).abs() < 1e-4));
        // Returns sum to 500 undisturbed and 350 disturbed. Forces are 0 and 10 undisturbed, 0 and 30 disturbed.
        assert!((row.relative_loss.unwrap() - 0.3).abs() < 1e-12);
        // The runs lose 50 and 100; 0.3 of their returns would be 30 and 120. Residuals are 20 and -20, their standard
        // error 20, with one degree of freedom.
        let ends = [row.ci_low, row.ci_high].map(Option::unwrap);
        assert!(
            ends.iter().zip([-1.0, 1.0]).all(|(end, side)| (end - 0.3 - side * 12.7062 * 20.0 / 250.0).abs() < 1e-4)
        );
        assert_eq!((row.energy_ratio, row.largest_force_ratio), (Some(1.5), Some(3.0)));
        let map =
            heat_map(&[row.clone(), DisturbedRow { disturbance: "late".into(), space: "low".into(), ..row.clone() }]);
        let shares: Vec<_> = map.rows.iter().map(|row| (row.label.as_str(), row.shares.clone())).collect();
        assert_eq!(map.columns, ["push", "late"]);
        assert_eq!(shares, [("osc", vec![row.relative_loss, None]), ("low", vec![None, row.relative_loss])]);
        assert_eq!(row.checkpoint, "best");
        for (row, problem) in [
            ("push,mean,6,80000", "disturbed.csv: no undisturbed episodes"),
            ("none,mean,6,70000", "neither of the best policy, which is of action 80000"),
            ("none,sampled,6,80000", "are to be of mean actions"),
        ] {
            fs_err::write(folders[0].disturbed(), format!("{header}\n{row},true,1,1,1\n")).unwrap();
            let told = format!("{:#}", disturbed(&groups[0], &runs, &rows).unwrap_err());
            assert!(told.contains(problem), "{told}");
        }
        // The first run's best policy is now earlier than its last. The second run's best policy is its last, so that it
        // counts as either.
        rewrite(&folders[0].eval(), "return", |row, old| if row < 3 { "1e3".into() } else { old.into() });
        let of_step = |folder: &RunFolder, step: u32| {
            let row = |what: &str| format!("{what},mean,6,{step},true,1,1,1\n");
            fs_err::write(folder.disturbed(), format!("{header}\n{}{}", row("none"), row("push"))).unwrap();
            disturbed(&groups[0], &runs, &rows).map(|found| found[0].checkpoint)
        };
        assert_eq!(of_step(&folders[0], 80_000).unwrap(), "last");
        assert_eq!(of_step(&folders[0], 10_000).unwrap(), "best");
        rewrite(&folders[1].eval(), "return", |row, old| if row < 3 { "1e3".into() } else { old.into() });
        let told = of_step(&folders[1], 80_000).unwrap_err().to_string();
        assert!(told.contains("some runs played their best policy, others their last"), "{told}");
        // If episodes may end early, the last one ends later than the last evaluation.
        rewrite(&folders[0].episodes(), "step", |_, _| "80461".into());
        assert_eq!(of_step(&folders[0], 80_461).unwrap(), "last");
    }
}
