//! Markdown tables of groups: the paper's Table I and its other claims, beside published numbers.

use std::collections::BTreeSet;
use std::fmt::{self, Display, Formatter};

use crate::report::comparison::{ComparisonRow, ENERGIES, ORDERS, QUANTITIES};
use crate::report::groups::{Group, Section};
use crate::report::published::{self, Published};
use crate::report::run_tables::SOLVED;
use crate::report::summary::RunSummary;
use output::statistics::{FEWEST_FOR_INTERVAL, deviation, iqm, iqm_interval, mean, range};
use show::plot;
use tasks::{CountedForce, ForcePenalty};

/// The runs of a section in Markdown: notes, the pictures with its `curves`, return, energy, the comparison with `aforce`, safety.
pub fn tables(section: Section, groups: &[Group], comparison: &[ComparisonRow], curves: &[&str]) -> String {
    let Section { experiment, task } = section;
    let groups: Vec<&Group> = groups.iter().filter(|group| group.section == section).collect();
    let comparison: Vec<_> = comparison.iter().filter(|row| row.experiment == experiment && row.task == task).collect();
    let of = if experiment.is_empty() { String::new() } else { format!("{experiment}: ") };
    let title = of + &section.title();
    let steps: BTreeSet<String> = groups
        .iter()
        .flat_map(|group| &group.runs)
        .filter_map(|run| Some(format!("{} m and {} rad", run.position_step_m?, run.rotation_step_rad?)))
        .collect();
    let steps = steps.into_iter().collect::<Vec<_>>().join(" or ");
    // The action steps of other libraries' runs are not known.
    let mut parts = vec![format!("# {title}\n")];
    if !steps.is_empty() {
        parts.push(format!("An action moves the goal by at most {steps} along an axis.\n"));
    }
    parts.extend(notes(&groups));
    parts.extend(curves.iter().map(|picture| format!("![Learning curves]({picture})\n")));
    let mut tables = vec![returns(section, &groups), energies(&groups)];
    tables.extend(orders_and_ratios(&groups, &comparison));
    tables.push(safety(&groups));
    parts.extend(tables.into_iter().filter_map(MarkdownTable::told).map(|table| table.to_string()));
    parts.join("\n")
}

/// What a reader has to know before comparing the rows of a section.
fn notes(groups: &[&Group]) -> Vec<String> {
    let runs = || groups.iter().flat_map(|group| &group.runs);
    let mut notes = vec![];
    if groups.iter().any(|group| group.runs.len() < FEWEST_FOR_INTERVAL) {
        notes.push("Groups of fewer than five seeds show a range instead of an interval.\n".to_string());
    }
    let unfinished: Vec<_> =
        runs().filter(|run| !run.done).map(|run| format!("{} {} ({})", run.label(), run.seed, run.env_steps)).collect();
    if !unfinished.is_empty() {
        notes.push(format!("Not finished, seed and actions so far: {}.\n", unfinished.join(", ")));
    }
    let mut limits: Vec<(ForcePenalty, Vec<String>)> = vec![];
    for group in groups {
        let Some(of_group) = group.runs[0].force_penalty else { continue };
        match limits.iter_mut().find(|(known, _)| *known == of_group) {
            Some((_, labels)) => labels.push(label(group)),
            None => limits.push((of_group, vec![label(group)])),
        }
    }
    if limits.len() > 1 {
        let told = limits.iter().map(|(ForcePenalty { of, limit, weight }, labels)| {
            let whose = match of {
                CountedForce::Arm => "of the whole arm",
                CountedForce::Hand => "beyond the wrist",
            };
            format!("{limit} N {whose}, {weight} a newton ({})", labels.join(", "))
        });
        let told: Vec<_> = told.collect();
        notes.push(format!(
            "The force limit differs, so penalties and what is above the limit do not compare: {}.\n",
            told.join("; ")
        ));
    }
    let keys: BTreeSet<&String> = runs().flat_map(|run| run.options.keys()).collect();
    let unlike = |key: &&String| runs().any(|run| run.options.get(*key) != groups[0].runs[0].options.get(*key));
    let unlike: Vec<_> = keys.into_iter().filter(unlike).map(|key| format!("`env.options.{key}`")).collect();
    if !unlike.is_empty() {
        notes.push(format!(
            "Groups differ in {}: returns compare only where the reward is the same.\n",
            unlike.join(", ")
        ));
    }
    notes
}

fn returns(section: Section, groups: &[&Group]) -> MarkdownTable {
    // The threshold is for robosuite's tasks: returns of other tasks have other scales.
    let solved = section.is_robosuites().then(|| format!("{SOLVED} after, thousand actions"));
    let mut table = MarkdownTable::new(&[
        "space",
        "seeds",
        "final return",
        "IQM, 95 % interval or range",
        "every seed",
        "published",
        "best evaluation",
        "mean of the whole curve",
    ]);
    table.header.extend(solved.clone());
    table.header.extend(["success at the end", "sampled actions: return; success"].map(String::from));
    for group in groups {
        let theirs = published(group).map_or(String::new(), |(who, row)| {
            format!("{:.0} +- {:.0} ({who})", row.final_return[0], row.final_return[1])
        });
        let when = |run: &&RunSummary| match run.number("steps_to_450") {
            step if step.is_nan() => "never".into(),
            step => format!("{:.0}", (step / 1000.0).floor()),
        };
        let mut row = vec![
            label(group),
            group.runs.len().to_string(),
            spread(group, "final_return", 1),
            centre(&group.values("final_return")),
            every(group, "final_return", 0),
            theirs,
            spread(group, "best_return", 1),
            spread(group, "curve_return", 1),
        ];
        row.extend(solved.as_ref().map(|_| group.runs.iter().map(when).collect::<Vec<_>>().join(", ")));
        row.push(spread(group, "final_success", 2));
        row.push(format!("{}; {}", spread(group, "sampled_return", 1), spread(group, "sampled_success", 2)));
        table.rows.push(row);
    }
    table
}

fn energies(groups: &[&Group]) -> MarkdownTable {
    let mut table = MarkdownTable::new(&["space", "J per action, training", "every seed", "published", "at the end"]);
    for group in groups {
        let theirs = published_energy(group);
        // Energies get four decimals if all of a group's are below 0.1 J.
        let digits = if group.values("energy_per_action_j").iter().all(|energy| *energy < 0.1) { 4 } else { 2 };
        table.rows.push(vec![
            label(group),
            spread(group, "energy_per_action_j", digits),
            every(group, "energy_per_action_j", digits),
            theirs.map_or(String::new(), |energy| energy.to_string()),
            spread(group, "final_energy_per_action_j", digits),
        ]);
    }
    table
}

/// A table for each group that others are compared with, mostly for `aforce` alone.
fn orders_and_ratios(groups: &[&Group], comparison: &[&ComparisonRow]) -> Vec<MarkdownTable> {
    let mut references: Vec<&str> = vec![];
    for row in comparison {
        if !references.contains(&row.reference.as_str()) {
            references.push(&row.reference);
        }
    }
    references.into_iter().map(|reference| compared_with(reference, groups, comparison)).collect()
}

/// A row per group that is compared with `reference`: the probabilities that the reference is ahead, and the group's
/// energies divided by the reference's.
fn compared_with(reference: &str, groups: &[&Group], comparison: &[&ComparisonRow]) -> MarkdownTable {
    let mut table = MarkdownTable::new(&["space"]);
    table.header.extend(ORDERS.map(|(order, _)| format!("`{reference}` {order}, probability")));
    table.header.extend(ENERGIES.map(|energy| format!("`{energy}` over that of `{reference}`")));
    table.header.push("energy, published".into());
    for group in groups {
        let of_group = |row: &&&ComparisonRow| {
            let key = (row.space.as_str(), row.variant.as_str(), row.preset.as_str(), row.reference.as_str());
            key == (group.space, group.variant, group.preset, reference)
        };
        let of_group: Vec<_> = comparison.iter().filter(of_group).collect();
        if of_group.is_empty() {
            continue;
        }
        let theirs = published_energy(group).zip(published::of(group.section.task, reference).and_then(energy));
        let mut cells = vec![label(group)];
        cells.extend(QUANTITIES.iter().map(|quantity| {
            let row = of_group.iter().find(|row| row.quantity == *quantity);
            row.map_or(String::new(), |row| match (row.ci_low, row.ci_high) {
                (Some(low), Some(high)) => format!("{:.2}, {low:.2} to {high:.2}", row.value),
                _ => format!("{:.2}", row.value),
            })
        }));
        cells.push(theirs.map_or(String::new(), |(space, reference)| plot::two_digits(space / reference)));
        table.rows.push(cells);
    }
    table
}

fn safety(groups: &[&Group]) -> MarkdownTable {
    let mut table = MarkdownTable::new(&[
        "space",
        "training episodes above the force limit",
        "published",
        "penalty per episode",
        "median; 90 %",
        "published",
        "largest force of an episode, N: median; 90 %",
        "excess impulse per episode, N s",
        "episodes in which a real arm would have stopped",
        "success before that: mean actions; sampled",
        "diverged",
    ]);
    for group in groups {
        let theirs = published(group).map(|(_, row)| row);
        let diverged: f64 = group.values("diverged_episodes").iter().sum();
        let text = |of: fn(&Published) -> Option<&'static str>| theirs.and_then(of).unwrap_or_default().to_string();
        table.rows.push(vec![
            label(group),
            spread(group, "penalised_episode_share", 2),
            text(|row| row.penalised_episode_share),
            spread(group, "mean_penalty_per_episode", 1),
            format!(
                "{}; {}",
                known(group, "median_penalty_per_episode", 1),
                known(group, "q90_penalty_per_episode", 1)
            ),
            text(|row| row.penalty_per_episode),
            format!(
                "{}; {}",
                known(group, "median_arm_max_contact_force_n", 0),
                known(group, "q90_arm_max_contact_force_n", 0)
            ),
            spread(group, "excess_impulse_per_episode_ns", 1),
            known(group, "stopped_episode_share", 2),
            format!(
                "{}; {}",
                known(group, "final_success_before_stop", 2),
                known(group, "sampled_success_before_stop", 2)
            ),
            if diverged.is_nan() { String::new() } else { diverged.to_string() },
        ]);
    }
    table
}

/// Published results with the same space; there are none of a variant.
fn published(group: &Group) -> Option<(&'static str, &'static Published)> {
    published::of(group.section.task, group.space).filter(|_| group.variant.is_empty())
}

fn published_energy(group: &Group) -> Option<f64> {
    published(group).and_then(energy)
}

fn energy((_, row): (&str, &Published)) -> Option<f64> {
    row.energy_per_action_j
}

fn label(group: &Group) -> String {
    format!("`{}`", group.runs[0].label())
}

/// Mean and deviation over the seeds that have the number.
fn spread(group: &Group, number: &str, digits: usize) -> String {
    let mut values = group.values(number);
    values.retain(|value| !value.is_nan());
    match values[..] {
        [] => "-".into(),
        [one] => format!("{one:.digits$}"),
        ref values => format!("{:.digits$} +- {:.digits$}", mean(values), deviation(values)),
    }
}

/// Mean over the seeds that have the number.
fn known(group: &Group, number: &str, digits: usize) -> String {
    let mut values = group.values(number);
    values.retain(|value| !value.is_nan());
    if values.is_empty() { "-".into() } else { format!("{:.digits$}", mean(&values)) }
}

/// One value per run, in order of seeds.
fn every(group: &Group, number: &str, digits: usize) -> String {
    let text = |value: &f64| if value.is_nan() { "-".into() } else { format!("{value:.digits$}") };
    group.values(number).iter().map(text).collect::<Vec<_>>().join(", ")
}

/// Interquartile mean over seeds with its interval, or with the range of few seeds; empty for one seed.
fn centre(values: &[f64]) -> String {
    match values.len() {
        1 => String::new(),
        few if few < FEWEST_FOR_INTERVAL => {
            let [low, high] = range(values);
            format!("{:.0}, range {low:.0} to {high:.0}", iqm(values))
        }
        _ => {
            let [low, high] = iqm_interval(values);
            format!("{:.0}, {low:.0} to {high:.0}", iqm(values))
        }
    }
}

/// A table in Markdown.
struct MarkdownTable {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl MarkdownTable {
    fn new(header: &[&str]) -> Self {
        MarkdownTable { header: header.iter().map(ToString::to_string).collect(), rows: vec![] }
    }

    /// The table without columns that are empty in every row; `None` if only the first column is left. Runs of other
    /// libraries have neither energy nor force, and for most tasks nothing is published.
    fn told(mut self) -> Option<Self> {
        let tells = |cell: &String| cell.contains(|c: char| !"-;, ".contains(c));
        let keeps: Vec<bool> = (0..self.header.len())
            .map(|column| column == 0 || self.rows.iter().any(|row| tells(&row[column])))
            .collect();
        for row in self.rows.iter_mut().chain([&mut self.header]) {
            let mut keeps = keeps.iter();
            row.retain(|_| keeps.next() == Some(&true));
        }
        (self.header.len() > 1).then_some(self)
    }
}

impl Display for MarkdownTable {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let line = |cells: &[String]| format!("| {} |", cells.join(" | "));
        writeln!(f, "{}\n|{}", line(&self.header), "---|".repeat(self.header.len()))?;
        self.rows.iter().try_for_each(|row| writeln!(f, "{}", line(row)))
    }
}

#[cfg(test)]
mod tests {
    use tasks::columns::Cell;

    use super::*;
    use crate::report::comparison::comparison;
    use crate::report::groups::{
        groups, sections,
        tests::{runs, set},
    };

    fn text(runs: &[RunSummary]) -> String {
        let groups = groups(runs);
        tables(sections(&groups)[0], &groups, &comparison(&groups), &["curves_lift.svg"])
    }

    #[test]
    fn five_seeds_have_an_interval_and_fewer_a_range() {
        let (five, four) = (runs("aforce", 5), runs("aforce", 4));
        let (enough, few) = (text(&five), text(&four));
        assert!(enough.contains("| `aforce` | 5 | 62.0 +- 1.6 | 62, 6"), "{enough}");
        assert!(enough.contains("| 60, 61, 62, 63, 64 |"), "{enough}");
        assert!(
            few.contains("range 60 to 63") && few.contains("fewer than five") && !enough.contains("fewer than five")
        );
    }

    #[test]
    fn a_space_is_compared_with_aforce_in_one_row_beside_what_is_published() {
        let mut all = [runs("aforce", 5), runs("variable", 5)].concat();
        for run in &mut all {
            run.task = "door".into();
            let [energy, curve] = if run.space == "aforce" { [2.0, 20.0] } else { [5.0, 10.0] };
            set(run, "energy_per_action_j", Cell::Real(energy));
            set(run, "curve_return", Cell::Real(curve));
            set(run, "penalised_episode_share", Cell::Real(0.25));
            set(run, "mean_penalty_per_episode", Cell::Real(148.0));
            ENERGIES[1..].iter().for_each(|energy| set(run, energy, Cell::Real(1.0)));
            if run.seed > 0 {
                set(run, "steps_to_450", Cell::Count(70_000));
            }
        }
        let text = text(&all);
        let rows: Vec<&str> = text.lines().filter(|line| line.starts_with("| `variable`")).collect();
        let [returns, energies, against, safety] = rows[..] else { panic!("{text}") };
        assert!(
            returns.contains("| 242 +- 227 (paper) |") && returns.contains("| never, 70, 70, 70, 70 |"),
            "{returns}"
        );
        assert!(energies.contains("| 5.00 +- 0.00 | 5.00, 5.00, 5.00, 5.00, 5.00 | 131 |"), "{energies}");
        assert!(against.starts_with("| `variable` | 0.50, "), "{against}");
        assert!(
            against.contains("| 0.50, 0.50 to 0.50 | 1.00, 1.00 to 1.00 | 2.50, 2.50 to 2.50 |")
                && against.ends_with("| 19 |"),
            "{against}"
        );
        assert!(safety.starts_with("| `variable` | 0.25 +- 0.00 | 148.0 +- 0.0 | 149 |"), "{safety}");
    }

    #[test]
    fn what_no_run_tells_is_left_out() {
        let mut all = runs("soft", 3);
        all.iter_mut().for_each(|run| set(run, "energy_per_action_j", Cell::Real(5.0)));
        let whole = text(&all);
        all.iter_mut().for_each(|run| set(run, "energy_per_action_j", Cell::Real(f64::NAN)));
        let told = text(&all);
        assert!(whole.contains("J per action, training") && !whole.contains("published"), "{whole}");
        assert!(!told.contains("J per action") && !told.contains("| - |"), "{told}");
        assert!(told.contains("final return") && told.lines().all(|line| !line.contains("|  |")), "{told}");
    }

    #[test]
    fn what_may_mislead_stands_above_the_table() {
        let mut all = runs("aforce", 5);
        all.extend(runs("osc", 5));
        assert!(notes(&groups(&all).iter().collect::<Vec<_>>()).is_empty());
        (all[7].done, all[7].env_steps) = (false, 1234);
        let notes = notes(&groups(&all).iter().collect::<Vec<_>>()).join("\n");
        assert!(notes.contains("osc 2 (1234)"), "{notes}");
        assert!(!notes.contains("force limit"), "{notes}");
    }

    #[test]
    fn groups_with_other_force_limits_or_options_are_told() {
        let mut all = [runs("aforce", 5), runs("osc", 5)].concat();
        for run in &mut all {
            let limit = if run.space == "osc" { 10.0 } else { 60.0 };
            run.force_penalty = Some(ForcePenalty { limit, ..ForcePenalty::default() });
        }
        let told = notes(&groups(&all).iter().collect::<Vec<_>>()).join("");
        let limits = "60 N of the whole arm, 0.05 a newton (`aforce`); 10 N of the whole arm, 0.05 a newton (`osc`)";
        assert!(told.contains(limits) && !told.contains("env.options"), "{told}");
        all[0].options.insert("penalty".into(), true.into());
        assert!(notes(&groups(&all).iter().collect::<Vec<_>>()).join("").contains("differ in `env.options.penalty`"));
    }

    #[test]
    fn a_return_of_450_is_told_of_robosuites_tasks_alone() {
        let mut all = runs("aforce", 5);
        assert!(text(&all).contains("450 after, thousand actions"));
        all.iter_mut().for_each(|run| run.task = "insert".into());
        let told = text(&all);
        assert!(!told.contains("450 after") && told.contains("mean of the whole curve"), "{told}");
    }
}
