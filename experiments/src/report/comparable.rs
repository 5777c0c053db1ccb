//! Which runs may stand in one table.

use std::collections::HashMap;

use anyhow::{Result, bail, ensure};

use crate::config::RunConfig;
use crate::report::groups::Section;
use crate::report::record::Record;
use crate::report::summary::RunSummary;

/// Checks that the runs can be compared. Runs of one group may differ in their seed alone. Runs of different groups may
/// also differ in the action space, in the learner and its number of steps if their presets differ, and in anything if
/// their variants differ, since a variant's name says what.
///
/// # Errors
/// Names two runs that do not fit together, and in what they differ.
pub fn comparable(runs: &[Record], rows: &[RunSummary]) -> Result<()> {
    // By group and seed.
    let mut seen: HashMap<(&str, &str, String, u64), &Record> = HashMap::new();
    // The first run of each space with a variant and a preset stands for the others, which are like it but for their seed.
    let mut first: Vec<(&Record, &RunSummary)> = vec![];
    for (run, row) in runs.iter().zip(rows) {
        let key = (row.experiment.as_str(), row.task.as_str(), row.label(), run.config.seed);
        if let Some(other) = seen.insert(key, run) {
            let (there, here) = (other.path.display(), run.path.display());
            bail!("{there} and {here} have the same seed: keep them in different folders");
        }
        for (other, their_row) in first.iter().filter(|(_, other)| Section::of(other) == Section::of(row)) {
            fit(other, their_row, run, row)?;
        }
        let kind =
            |row: &RunSummary| (row.experiment.clone(), row.task.clone(), row.space.clone(), row.variant.clone());
        let is_known = |(_, other): &(&Record, &RunSummary)| kind(other) == kind(row) && other.preset == row.preset;
        if !first.iter().any(is_known) {
            first.push((run, row));
        }
    }
    Ok(())
}

/// Checks that two runs of a section can be compared.
fn fit(other: &Record, their_row: &RunSummary, run: &Record, row: &RunSummary) -> Result<()> {
    let (theirs, config) = (&other.config, &run.config);
    let (there, here) = (other.path.display(), run.path.display());
    ensure!(
        row.label() != their_row.label() || row.preset == their_row.preset,
        "{there} has the preset {}, {here} {}: keep them in different folders",
        their_row.preset,
        row.preset
    );
    if theirs.variant != config.variant {
        return Ok(());
    }
    let mut alike = config.clone();
    alike.seed = theirs.seed;
    if theirs.env.space.name != config.env.space.name {
        alike.env.space = theirs.env.space.clone();
    }
    if theirs.preset != config.preset {
        let RunConfig { preset, learner, steps, evaluate_every, .. } = theirs.clone();
        alike = RunConfig { preset, learner, steps, evaluate_every, ..alike };
    }
    if let Some(difference) = theirs.difference(&alike) {
        bail!(
            "{there} and {here} differ in more than their seed and space ({difference}): keep them in different folders"
        );
    }
    ensure!(
        theirs.steps == alike.steps,
        "{there} is a run of {} actions, {here} one of {}: take the shorter one on",
        theirs.steps,
        config.steps
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::summary::tests::run;

    /// A run with `osc` beside one with `space`, in whose configuration some words are replaced.
    fn compared(space: &str, changes: &[(&str, &str)]) -> Result<()> {
        let root = tempfile::tempdir().unwrap();
        let paths = ["lift/osc/seed_1".to_string(), format!("lift/{space}/seed_2")];
        paths.iter().for_each(|path| drop(run(root.path(), path, 2.0, 0.0)));
        let folders = paths.map(|path| crate::run::folder::RunFolder::at(&root.path().join(path)));
        let config = format!("seed = 2\n{}", fs_err::read_to_string(folders[1].config()).unwrap());
        let changed = changes.iter().fold(config, |text, (from, to)| text.replace(from, to));
        fs_err::write(folders[1].config(), changed).unwrap();
        let runs = folders.map(|folder| Record::of_folder(&folder).unwrap());
        let rows: Vec<_> = runs.iter().map(|run| RunSummary::of(run, root.path()).unwrap()).collect();
        comparable(&runs, &rows)
    }

    #[test]
    fn runs_of_a_table_differ_in_what_it_is_about() {
        let steps = ("steps = 80000", "steps = 90000");
        let learner = ("[env]", "learner.gamma = 0.5\n[env]");
        let reward = ("[env]", "[env]\nmotion_price = 0.1");
        let preset = ("desktop", "swift");
        let variant = ("[env]", "variant = \"cheap\"\n[env]");
        for fits in [
            compared("osc", &[]),
            compared("aforce", &[]),
            compared("aforce", &[preset]),
            compared("osc", &[variant, reward, learner, steps]),
        ] {
            fits.unwrap();
        }
        for (differs, words) in [
            (compared("osc", &[("seed = 2", "seed = 1")]), "have the same seed"),
            (compared("osc", &[preset]), "has the preset desktop"),
            (compared("aforce", &[learner]), "learner.gamma: there 0.97, here 0.5"),
            (compared("osc", &[reward]), "env.motion_price: there 0.0, here 0.1"),
            (compared("aforce", &[steps]), "is a run of 80000 actions"),
        ] {
            let error = differs.unwrap_err().to_string();
            assert!(error.contains(words) && error.contains("seed_1") && error.contains("seed_2"), "{error}");
        }
    }
}
