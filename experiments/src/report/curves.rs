//! Learning curves, drawn from the tables of runs: of one run, and of a sweep.

use anyhow::Result;
use output::statistics::{FEWEST_FOR_INTERVAL, iqm, iqm_interval, range};
use show::plot::{self, Panel, Series};

use crate::config::{self, RunConfig, RunId};
use crate::report::record::{Record, Table};
use crate::report::summary::{self, RunSummary};
use crate::run::folder::RunFolder;

/// Training episodes in the running mean.
const WINDOW: usize = 20;

/// What is drawn: title, unit, column.
const PANELS: [[&str; 3]; 3] = [
    ["Return", "return", "return"],
    ["Success at the end of an episode", "share of episodes", "success"],
    ["Mechanical energy", "J per action", "energy_per_action_j"],
];
/// Of one run only.
const STIFFNESS: [&str; 3] = ["Stiffness along the axes, mean", "N/m", "stiffness_translation_n_per_m"];
/// Of several runs.
const FORCE: [&str; 3] = ["Contact force that 99 % of the actions stay below", "N", "p99_contact_force_n"];

/// Draws `curves.svg` of a run.
///
/// # Errors
/// If a table cannot be read or a picture not written.
pub fn draw(folder: &RunFolder) -> Result<()> {
    let run = Record::of_folder(folder)?;
    let training = run.columns(Table::Episodes)?;
    let policies = ["mean", "sampled"];
    let evaluations = policies.iter().map(|policy| run.evaluations(policy)).collect::<Result<Vec<_>>>()?;
    let panels = PANELS.iter().chain([&STIFFNESS]).map(|&[title, unit, column]| {
        let training = in_thousands(training.running_mean(column, WINDOW)?);
        let mut series = vec![Series::new(format!("training, mean of {WINDOW} episodes"), training)];
        for (policy, table) in policies.iter().zip(&evaluations) {
            series.push(Series::new(format!("evaluation, {policy} action"), in_thousands(table.mean_by_step(column)?)));
        }
        Ok(panel(title, unit, series))
    });
    plot::write(&title(&run.config), &panels.collect::<Result<Vec<_>>>()?, &folder.curves())
}

/// Which run it is, in words.
fn title(config: &RunConfig) -> String {
    let RunId { task, seed, .. } = RunId::of(config);
    format!("{task}, {}, seed {seed}", summary::label(&config.env.space.name, &config.variant, config.preset.name))
}

/// The evaluations of runs that are compared. For each action space, variant and preset: every seed, their interquartile mean as
/// far as all of them have come, and its 95 % interval, or the range of too few seeds.
///
/// # Errors
/// If a table cannot be read.
pub fn of_runs(runs: &[(&Record, &RunSummary)]) -> Result<Vec<Panel>> {
    // The preset is told where there are two.
    let one_preset = runs.iter().all(|(_, run)| run.preset == runs[0].1.preset);
    let label = |run: &RunSummary| if one_preset { config::label(&run.space, &run.variant) } else { run.label() };
    let mut labels: Vec<String> = vec![];
    for (_, run) in runs {
        if !labels.contains(&label(run)) {
            labels.push(label(run));
        }
    }
    let tables = runs.iter().map(|(run, _)| run.evaluations("mean")).collect::<Result<Vec<_>>>()?;
    let drawn = |&[title, unit, column]: &[&str; 3]| {
        let of_group = |group: &String| {
            let seeds = runs.iter().zip(&tables).filter(|((_, run), _)| label(run) == *group);
            let seeds = seeds.map(|(_, table)| Ok(in_thousands(table.mean_by_step(column)?)));
            Ok(over_seeds(group, seeds.collect::<Result<_>>()?))
        };
        Ok(panel(title, unit, labels.iter().map(of_group).collect::<Result<_>>()?))
    };
    PANELS.iter().chain([&FORCE]).map(drawn).collect()
}

fn in_thousands(mut points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    points.iter_mut().for_each(|(step, _)| *step /= 1000.0);
    points
}

/// One curve for the curves of several seeds.
fn over_seeds(label: &str, mut seeds: Vec<Vec<(f64, f64)>>) -> Series {
    if seeds.len() == 1 {
        return Series::new(label, seeds.remove(0));
    }
    let common = seeds.iter().map(Vec::len).min().unwrap_or(0);
    let at = |i: usize| (seeds[0][i].0, seeds.iter().map(|seed| seed[i].1).collect::<Vec<_>>());
    let points = (0..common).map(at).map(|(x, values)| (x, iqm(&values))).collect();
    let band = (0..common).map(at).map(|(x, values)| {
        let enough = values.len() >= FEWEST_FOR_INTERVAL;
        let [low, high] = if enough { iqm_interval(&values) } else { range(&values) };
        (x, low, high)
    });
    Series { band: band.collect(), points, members: seeds, label: label.into() }
}

fn panel(title: &str, unit: &str, series: Vec<Series>) -> Panel {
    Panel {
        title: title.into(),
        x_label: "actions (thousands)".into(),
        y_label: unit.into(),
        series,
        from_zero: true,
        ..Panel::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_group_is_summed_up_as_far_as_all_its_seeds_have_come() {
        let seeds = vec![vec![(10.0, 1.0), (20.0, 5.0), (30.0, 6.0)], vec![(10.0, 3.0), (20.0, 5.0)]];
        let series = over_seeds("aforce", seeds.clone());
        assert_eq!(series.members, seeds);
        assert_eq!(series.points, [(10.0, 2.0), (20.0, 5.0)]);
        assert_eq!(series.band, [(10.0, 1.0, 3.0), (20.0, 5.0, 5.0)]);
        assert_eq!(over_seeds("aforce", seeds[1..].to_vec()), Series::new("aforce", seeds[1].clone()));
    }
}
