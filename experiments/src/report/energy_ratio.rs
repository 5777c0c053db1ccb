//! Energy in training of one action space as a multiple of another's, for the pairs that a file names: a table and a forest plot.

use std::collections::BTreeSet;
use std::path::Path;

use anyhow::Result;
use output::program::bad;
use output::statistics::{mean, ratio_interval};
use serde::{Deserialize, Serialize};
use settings::parse;
use show::plot::{Forest, Ratio};
use tasks::TaskName;

use crate::report::published;
use crate::report::summary::RunSummary;
use crate::report::verdicts::label_of;

/// The file: what is compared, and the words of the figure.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    title: String,
    /// Words for a ratio below one, and for one above.
    less: String,
    more: String,
    ratio: Vec<Wanted>,
}

/// A ratio.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Wanted {
    /// Heading of its lines in the figure.
    heading: String,
    /// How the spaces of its experiment were set up, in words.
    stage: String,
    experiment: String,
    task: TaskName,
    /// Space, or space and variant, and the one whose energy it is divided by.
    space: String,
    against: String,
}

/// A row of `energy_ratio.csv`.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "documented once, in docs/columns.md")]
pub struct EnergyRatioRow {
    pub task: String,
    pub stage: String,
    pub experiment: String,
    pub space: String,
    pub against: String,
    pub n_space: Option<usize>,
    pub n_against: Option<usize>,
    pub ratio: f64,
    pub ci_low: Option<f64>,
    pub ci_high: Option<f64>,
}

/// What stands for a stage in rows of the AFORCE paper.
const PAPER: &str = "paper";

/// The ratios that `file` asks for, from those of `runs` that are done, and the plot of them. A ratio is left out as
/// long as one side of it has no such run. After the ratios of a heading comes the one that the paper published for the
/// heading's task and spaces.
///
/// # Errors
/// If it is no such file, a space of it has several variants, or the runs of a ratio have several presets.
pub fn energy_ratios(file: &Path, runs: &[RunSummary]) -> Result<(Vec<EnergyRatioRow>, Forest)> {
    let wrong = |problem: String| bad(format!("{}: {problem}", file.display()));
    let File { title, less, more, ratio: wanted } = parse(&settings::text(file)?).map_err(wrong)?;
    let (mut rows, mut ratios) = (vec![], vec![]);
    for of_heading in wanted.chunk_by(|one, next| one.heading == next.heading) {
        let of_runs =
            of_heading.iter().map(|wanted| of_runs(wanted, runs).map_err(wrong)).collect::<Result<Vec<_>, _>>()?;
        let known: Vec<EnergyRatioRow> = of_runs.into_iter().flatten().collect();
        let paper = of_paper(&of_heading[0]).filter(|_| !known.is_empty());
        for row in known.into_iter().chain(paper) {
            ratios.push(Ratio {
                heading: of_heading[0].heading.clone(),
                label: row.label(),
                value: row.ratio,
                interval: row.ci_low.zip(row.ci_high).map(|(low, high)| [low, high]),
            });
            rows.push(row);
        }
    }
    Ok((rows, Forest { title, less, more, ratios }))
}

fn of_runs(wanted: &Wanted, runs: &[RunSummary]) -> Result<Option<EnergyRatioRow>, String> {
    let is_meant = |run: &&RunSummary| run.experiment == wanted.experiment && run.task == wanted.task.as_str();
    let meant: Vec<&RunSummary> = runs.iter().filter(is_meant).collect();
    let [space, against] = [&wanted.space, &wanted.against].map(|space| label_of(space, &meant));
    let (space, against) = (space?, against?);
    if space == against {
        return Err(format!("space and against are the same runs, {space}"));
    }
    let done = |label: &str| -> Vec<&RunSummary> {
        let is_it = |run: &&RunSummary| run.done && crate::config::label(&run.space, &run.variant) == label;
        meant.iter().copied().filter(is_it).collect()
    };
    let sides = [done(&space), done(&against)];
    let presets: BTreeSet<&str> = sides.iter().flatten().map(|run| run.preset.as_str()).collect();
    if presets.len() > 1 {
        let names = presets.into_iter().collect::<Vec<_>>().join(" and ");
        return Err(format!("{space} and {against}: runs trained with {names}"));
    }
    let [a, b] = sides.map(|side| side.iter().map(|run| run.number("energy_per_action_j")).collect::<Vec<f64>>());
    if a.is_empty() || b.is_empty() {
        return Ok(None);
    }
    if let Some((label, _)) = [(&space, &a), (&against, &b)].into_iter().find(|(_, side)| !mean(side).is_finite()) {
        return Err(format!("{label} has no energy_per_action_j"));
    }
    let ci = ratio_interval(&a, &b);
    Ok(Some(EnergyRatioRow {
        task: wanted.task.as_str().into(),
        stage: wanted.stage.clone(),
        experiment: wanted.experiment.clone(),
        space,
        against,
        n_space: Some(a.len()),
        n_against: Some(b.len()),
        ratio: mean(&a) / mean(&b),
        ci_low: ci.map(|ci| ci[0]),
        ci_high: ci.map(|ci| ci[1]),
    }))
}

/// The paper's ratio for the same task and spaces, if the paper has both energies.
fn of_paper(wanted: &Wanted) -> Option<EnergyRatioRow> {
    let task = wanted.task.as_str();
    let spent = |space: &str| {
        let row = published::PAPER.iter().find(|row| row.task == task && row.space == space)?;
        row.energy_per_action_j
    };
    Some(EnergyRatioRow {
        task: task.into(),
        stage: PAPER.into(),
        experiment: String::new(),
        space: wanted.space.clone(),
        against: wanted.against.clone(),
        n_space: None,
        n_against: None,
        ratio: spent(&wanted.space)? / spent(&wanted.against)?,
        ci_low: None,
        ci_high: None,
    })
}

impl EnergyRatioRow {
    /// Label in the figure.
    fn label(&self) -> String {
        match (self.n_space, self.n_against) {
            (Some(n), Some(other)) if n == other => format!("{}, {n} seeds", self.stage),
            (Some(n), Some(other)) => format!("{}, {n} and {other} seeds", self.stage),
            _ => self.stage.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use tasks::columns::Cell;

    use super::*;
    use crate::report::groups::tests::{runs, set};

    fn ratios(text: &str, runs: &[RunSummary]) -> Result<(Vec<EnergyRatioRow>, Forest)> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("energy_ratio.toml");
        fs_err::write(&path, format!("title = 't'\nless = 'l'\nmore = 'm'\n{text}"))?;
        energy_ratios(&path, runs)
    }

    fn wanted(stage: &str, experiment: &str, space: &str) -> String {
        let names = format!("heading = 'Lift'\nstage = '{stage}'\nexperiment = '{experiment}'\ntask = 'lift'\n");
        format!("[[ratio]]\n{names}space = '{space}'\nagainst = 'aforce'\n")
    }

    #[test]
    fn a_ratio_is_of_the_means_of_finished_runs_and_the_paper_stands_below() {
        let mut all = [runs("variable", 3), runs("aforce", 2)].concat();
        for (run, energy) in all.iter_mut().zip([2.0, 4.0, 900.0, 1.0, 2.0]) {
            set(run, "energy_per_action_j", Cell::Real(energy));
            run.experiment = "a".into();
        }
        all[..3].iter_mut().for_each(|run| run.variant = "draw-1".into());
        all[2].done = false;
        let text = [wanted("untuned", "a", "variable"), wanted("tuned", "nowhere", "variable")].concat();
        let (rows, forest) = ratios(&text, &all).unwrap();
        let told: Vec<_> = rows.iter().map(|row| (row.stage.as_str(), row.space.as_str(), row.n_space)).collect();
        assert_eq!(told, [("untuned", "variable,draw-1", Some(2)), ("paper", "variable", None)]);
        assert!((rows[0].ratio - 2.0).abs() < 1e-12 && rows[0].ci_low.unwrap() < 2.0 && 2.0 < rows[0].ci_high.unwrap());
        assert!((rows[1].ratio - 24.5 / 1.5).abs() < 1e-12);
        let labels: Vec<_> =
            forest.ratios.iter().map(|ratio| (ratio.label.as_str(), ratio.interval.is_some())).collect();
        assert_eq!(labels, [("untuned, 2 seeds", true), ("paper", false)]);
    }

    #[test]
    fn what_is_wrong_with_the_file_is_told() {
        let mut all = [runs("variable", 2), runs("aforce", 2)].concat();
        let error = |text: &str, all: &[RunSummary]| ratios(text, all).unwrap_err().to_string();
        let text = wanted("", "", "aforce");
        assert!(error(&text, &all).contains("space and against are the same runs, aforce"));
        let text = wanted("", "", "variable");
        all[1].preset = "paper".into();
        let told = error(&text, &all);
        assert!(told.contains("variable and aforce: runs trained with") && told.contains("and paper"), "{told}");
        (all[0].variant, all[1].variant) = ("a".into(), "b".into());
        assert!(error(&text, &all).contains("variable has variants: name one of variable,a and variable,b"));
        let told = error("[[ratios]]", &all);
        assert!(told.contains("energy_ratio.toml: ") && told.contains("ratios"), "{told}");
        assert_eq!(ratios(&wanted("", "", "osc"), &all).unwrap().0, []);
    }
}
