//! Learning curves, drawn from the tables of runs: of one run, and of a sweep.

use aforce::ActionSpace;
use anyhow::Result;
use output::statistics::{FEWEST_FOR_INTERVAL, iqm, iqm_interval, range};
use show::plot::{self, Panel, Reach, Series};

use crate::config::{self, RunConfig, RunId};
use crate::report::groups::Section;
use crate::report::record::Record;
use crate::report::summary::{self, RunSummary};
use crate::report::table::Table;
use crate::run::folder::RunFolder;

/// Training episodes in the running mean.
const WINDOW: usize = 20;

/// What is drawn: title, unit, column.
const PANELS: [[&str; 3]; 3] =
    [["Return", "return", "return"], SUCCESS, ["Mechanical energy", "J per action", "energy_per_action_j"]];
const SUCCESS: [&str; 3] = ["Success at the end of an episode", "% of episodes", "success"];
/// Drawn for a single run only.
const STIFFNESS: [&str; 3] = ["Stiffness along the axes, mean", "N/m", "stiffness_translation_n_per_m"];
/// Drawn for several runs only.
const FORCE: [&str; 3] = ["Contact force that 99 % of the actions stay below", "N", "p99_contact_force_n"];

/// A figure with the curves of at most `MOST` groups of runs in a panel, to be written as `curves_TASK` with the suffix.
pub struct Figure {
    /// What follows the task in its file's name, such as `_ablations`.
    pub suffix: String,
    /// Its heading, in words.
    pub title: String,
    /// Its panels.
    pub panels: Vec<Panel>,
}

/// Maximum number of groups of runs in a panel: with more, curves and bands cannot be told apart.
const MOST: usize = 4;

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
        if column == SUCCESS[2] {
            series.iter_mut().for_each(|series| in_percent(&mut series.points));
        }
        Ok(panel([title, unit, column], series))
    });
    plot::write(&title(&run.config), &panels.collect::<Result<Vec<_>>>()?, &folder.curves())
}

/// Which run it is, in words.
fn title(config: &RunConfig) -> String {
    let RunId { task, seed, .. } = RunId::of(config);
    format!("{task}, {}, seed {seed}", summary::label(&config.env.space.name, &config.variant, config.preset.name))
}

/// Learning curves of the runs of one task: for each action space, variant and preset the interquartile mean of its
/// seeds, as far as all of them have come, with its 95 % interval, or with the range of too few seeds. More than `MOST`
/// groups are spread over several figures, or over several rows of one, which show return and success alone.
///
/// # Errors
/// If a table cannot be read.
pub fn figures(runs: &[(&Record, &RunSummary)]) -> Result<Vec<Figure>> {
    // Labels name the preset if the runs have several.
    let one_preset = runs.iter().all(|(_, run)| run.preset == runs[0].1.preset);
    let label = |run: &RunSummary| if one_preset { config::label(&run.space, &run.variant) } else { run.label() };
    let mut labels: Vec<(String, &RunSummary)> = vec![];
    for (_, run) in runs {
        if labels.iter().all(|(known, _)| *known != label(run)) {
            labels.push((label(run), run));
        }
    }
    let tables = runs.iter().map(|(run, _)| run.evaluations("mean")).collect::<Result<Vec<_>>>()?;
    let of_rows = |(suffix, rows): (String, Vec<Vec<&str>>)| {
        let of_group = |group: &str, column: &str| {
            let seeds = runs.iter().zip(&tables).filter(|((_, run), _)| label(run) == group);
            let seeds = seeds.map(|(_, table)| {
                let mut points = in_thousands(table.mean_by_step(column)?);
                if column == SUCCESS[2] {
                    in_percent(&mut points);
                }
                Ok(points)
            });
            Ok(over_seeds(group, &seeds.collect::<Result<Vec<_>>>()?))
        };
        let drawn = |labels: &[&str], [title, unit, column]: [&str; 3]| {
            let series = labels.iter().map(|group| of_group(group, column)).collect::<Result<_>>()?;
            Ok(panel([title, unit, column], series))
        };
        let shown = if rows.len() == 1 { &[PANELS[0], PANELS[1], PANELS[2], FORCE][..] } else { &PANELS[..2] };
        let panels = rows.iter().flat_map(|labels| shown.iter().map(move |&what| drawn(labels, what)));
        let panels = panels.collect::<Result<_>>()?;
        let labels = rows.concat();
        let seeds = |group: &&str| runs.iter().filter(|(_, run)| label(run) == **group).count();
        let title = heading(&Section::of(runs[0].1).title(), labels.iter().map(seeds));
        // Runs of the candidate that a search chose keep the name that the search gave it.
        let drawn =
            if labels.iter().any(|label| label.contains(",draw-")) { "; draw-N: chosen by a search" } else { "" };
        Ok(Figure { suffix, title: title + drawn, panels })
    };
    spread(&labels).into_iter().map(of_rows).collect()
}

/// What a figure of a task shows, in words.
fn heading(task: &str, seeds: impl Iterator<Item = usize> + Clone) -> String {
    let (fewest, most) = (seeds.clone().min().unwrap_or(0), seeds.max().unwrap_or(0));
    let count = match (fewest, most) {
        (1, 1) => "one seed".into(),
        (fewest, most) if fewest == most => format!("{most} seeds"),
        _ => format!("{fewest} to {most} seeds"),
    };
    let of = if most == 1 {
        ""
    } else if fewest >= FEWEST_FOR_INTERVAL {
        ", interquartile mean and 95 % interval"
    } else if most < FEWEST_FOR_INTERVAL {
        ", interquartile mean and range"
    } else {
        ", interquartile mean and 95 % interval or range"
    };
    format!("{task} while learning: {count}{of}")
}

/// The labels in each row of each figure, with its suffix. Where every group has a variant, the spaces of one variant are in the same
/// figures.
fn spread<'a>(labels: &'a [(String, &RunSummary)]) -> Vec<(String, Vec<Vec<&'a str>>)> {
    if labels.len() <= MOST {
        return vec![(String::new(), vec![labels.iter().map(|(label, _)| label.as_str()).collect()])];
    }
    let mut variants: Vec<&str> = vec![];
    for (_, run) in labels {
        if !variants.contains(&run.variant.as_str()) {
            variants.push(&run.variant);
        }
    }
    if variants.contains(&"") {
        return of_kinds("", labels);
    }
    let of_variant = |variant: &&str| {
        let labels: Vec<_> = labels.iter().filter(|(_, run)| run.variant == **variant).collect();
        let name = format!("_{variant}");
        if labels.len() <= MOST {
            return vec![(name, vec![labels.iter().map(|(label, _)| label.as_str()).collect()])];
        }
        let figures = of_kinds(variant, labels).into_iter();
        figures.map(|(suffix, rows)| (name.clone() + &suffix, rows)).collect()
    };
    variants.iter().flat_map(of_variant).collect()
}

/// One figure with the built-in spaces of the variant `common`, then one with the ablations, each beside AFORCE.
fn of_kinds<'a>(
    common: &str,
    labels: impl IntoIterator<Item = &'a (String, &'a RunSummary)>,
) -> Vec<(String, Vec<Vec<&'a str>>)> {
    let is_aforce =
        |run: &RunSummary| ["aforce", "aforce-force"].contains(&run.space.as_str()) && run.variant == common;
    // Ablations are the other spaces whose name begins with `aforce`, spaces that are not built in, and all other variants.
    let is_rival = |run: &RunSummary| {
        run.variant == common && !run.space.starts_with("aforce") && run.space.parse::<ActionSpace>().is_ok()
    };
    let (mut aforce, mut rivals, mut ablations) = (vec![], vec![], vec![]);
    for (label, run) in labels {
        let kind = if is_aforce(run) && aforce.is_empty() {
            &mut aforce
        } else if is_rival(run) {
            &mut rivals
        } else {
            &mut ablations
        };
        kind.push(label.as_str());
    }
    let mut figures = vec![];
    for (name, of_kind) in [("", rivals), ("_ablations", ablations)] {
        let room = MOST - aforce.len();
        // The rows have nearly equal lengths.
        let size = of_kind.len().div_ceil(of_kind.len().div_ceil(room).max(1)).max(1);
        let rows: Vec<_> = of_kind.chunks(size).map(|chunk| [aforce.as_slice(), chunk].concat()).collect();
        if !rows.is_empty() {
            figures.push((name.into(), rows));
        }
    }
    figures
}

/// Shares to percent.
fn in_percent(points: &mut [(f64, f64)]) {
    points.iter_mut().for_each(|(_, share)| *share *= 100.0);
}

fn in_thousands(mut points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    points.iter_mut().for_each(|(step, _)| *step /= 1000.0);
    points
}

/// One curve for the curves of several seeds, at the steps of the first seed that lie within all curves. Runs of another
/// library may have been evaluated at other steps: their curves are interpolated linearly.
fn over_seeds(label: &str, seeds: &[Vec<(f64, f64)>]) -> Series {
    if let [seed] = seeds {
        return Series::new(label, seed.clone());
    }
    let steps = seeds.iter().take(1).flatten().map(|&(x, _)| x);
    let all_at = |x: f64| Some((x, seeds.iter().map(|seed| value_at(seed, x)).collect::<Option<Vec<f64>>>()?));
    let common: Vec<(f64, Vec<f64>)> = steps.filter_map(all_at).collect();
    let points = common.iter().map(|(x, values)| (*x, iqm(values))).collect();
    let band = common.iter().map(|(x, values)| {
        let enough = values.len() >= FEWEST_FOR_INTERVAL;
        let [low, high] = if enough { iqm_interval(values) } else { range(values) };
        (*x, low, high)
    });
    Series { band: band.collect(), ..Series::new(label, points) }
}

/// The value of a curve at `x`, interpolated linearly; `None` before its first point and after its last.
fn value_at(curve: &[(f64, f64)], x: f64) -> Option<f64> {
    let next = curve.partition_point(|&(at, _)| at < x);
    let &(right, b) = curve.get(next)?;
    if right == x {
        return Some(b);
    }
    let (left, a) = curve[next.checked_sub(1)?];
    Some(a + (b - a) * (x - left) / (right - left))
}

fn panel([title, unit, column]: [&str; 3], series: Vec<Series>) -> Panel {
    Panel {
        title: title.into(),
        x_label: "actions (thousands)".into(),
        y_label: unit.into(),
        series,
        from_zero: true,
        y_reach: if column == SUCCESS[2] { Reach::Between(0.0, 100.0) } else { Reach::Most },
        ..Panel::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::groups::tests::runs;

    #[test]
    fn a_group_is_summed_up_as_far_as_all_its_seeds_have_come() {
        let seeds = vec![vec![(10.0, 1.0), (20.0, 5.0), (30.0, 6.0)], vec![(10.0, 3.0), (20.0, 5.0)]];
        let series = over_seeds("aforce", &seeds);
        assert_eq!(series.points, [(10.0, 2.0), (20.0, 5.0)]);
        assert_eq!(series.band, [(10.0, 1.0, 3.0), (20.0, 5.0, 5.0)]);
        assert_eq!(over_seeds("aforce", &seeds[1..]), Series::new("aforce", seeds[1].clone()));
    }

    #[test]
    fn curves_with_other_steps_are_read_between_their_points() {
        let seeds =
            vec![vec![(1.0, 0.0), (10.0, 1.0), (20.0, 5.0), (30.0, 6.0)], vec![(5.0, 0.0), (15.0, 3.0), (25.0, 5.0)]];
        assert_eq!(over_seeds("aforce", &seeds).points, [(10.0, 1.25), (20.0, 4.5)]);
    }

    #[test]
    fn rivals_come_first_then_ablations_and_aforce_is_in_every_row() {
        let spread_over = |spaces: &[&str]| {
            let all: Vec<RunSummary> = spaces.iter().flat_map(|space| runs(space, 1)).collect();
            let labels: Vec<_> = all.iter().map(|run| (run.label(), run)).collect();
            let figures = spread(&labels).into_iter();
            let rows = |rows: Vec<Vec<&str>>| rows.iter().map(|labels| labels.join(" ")).collect::<Vec<_>>().join("; ");
            figures.map(|(suffix, labels)| format!("{suffix}: {}", rows(labels))).collect::<Vec<_>>()
        };
        assert_eq!(spread_over(&["aforce", "floor", "osc", "mean"]), [": aforce floor osc mean"]);
        let many = ["aforce", "floor", "floor-ff", "mean", "no-ff", "osc", "stiff", "variable"];
        let expected = [": aforce osc variable", "_ablations: aforce floor floor-ff mean; aforce no-ff stiff"];
        assert_eq!(spread_over(&many), expected);
    }

    /// Where variants are learners, spaces are compared with one learner, and another learner's curves are in another figure.
    #[test]
    fn where_all_have_a_variant_each_has_figures_of_its_own() {
        let mut all: Vec<RunSummary> = vec![];
        for (variant, spaces) in [
            ("plain", &["aforce", "osc"][..]),
            ("swift", &["aforce", "variable", "osc", "floor", "robosuite-variable"]),
        ] {
            let of_variant = spaces.iter().flat_map(|space| runs(space, 1));
            all.extend(of_variant.map(|run| RunSummary { variant: variant.into(), ..run }));
        }
        let labels: Vec<_> = all.iter().map(|run| (run.label(), run)).collect();
        let figures: Vec<_> =
            spread(&labels).into_iter().map(|(suffix, rows)| (suffix, rows.concat().join(" "))).collect();
        let expected = [
            ("_plain", "aforce,plain osc,plain"),
            ("_swift", "aforce,swift variable,swift osc,swift robosuite-variable,swift"),
            ("_swift_ablations", "aforce,swift floor,swift"),
        ];
        assert_eq!(figures, expected.map(|(suffix, labels)| (suffix.to_string(), labels.to_string())));
    }

    #[test]
    fn a_heading_says_how_many_seeds_and_what_the_band_is() {
        let of = |seeds: &[usize]| heading("Lift", seeds.iter().copied());
        assert_eq!(of(&[10, 10]), "Lift while learning: 10 seeds, interquartile mean and 95 % interval");
        assert_eq!(of(&[3, 10]), "Lift while learning: 3 to 10 seeds, interquartile mean and 95 % interval or range");
        assert_eq!(of(&[3]), "Lift while learning: 3 seeds, interquartile mean and range");
        assert_eq!(of(&[1]), "Lift while learning: one seed");
    }
}
