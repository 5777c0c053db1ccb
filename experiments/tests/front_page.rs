//! The README's front page and the page of first steps say what the committed tables say.

use std::fs;
use std::path::Path;

use experiments::run::csv_table::CsvTable;

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// The cells of the row that begins with `label`, without it.
fn cells(page: &str, label: &str) -> Vec<String> {
    let line = page.lines().find(|line| line.starts_with(&format!("| {label}"))).expect(label);
    line.trim_matches('|').split('|').skip(1).map(|cell| cell.trim().to_string()).collect()
}

/// The numbers of `column` in the rows whose cells are `wanted`, at least one.
fn numbers(table: &str, wanted: &[(&str, &str)], column: &str) -> Vec<f64> {
    let table = CsvTable::read(&root().join("results").join(table)).unwrap();
    let at = |name: &str| table.position(name).expect("a column of the table");
    let rows = table.rows.iter().filter(|row| wanted.iter().all(|(name, text)| &row[at(name)] == *text));
    let numbers: Vec<f64> = rows.map(|row| row[at(column)].parse().expect("a number")).collect();
    assert!(!numbers.is_empty(), "{table}: no row with {wanted:?}", table = table.path().display());
    numbers
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn the_readme_tells_the_ratios_of_energy() {
    let page = fs::read_to_string(root().join("README.md")).unwrap();
    for (label, stage) in [("default settings", "untuned"), ("both tuned", "tuned")] {
        let expected = ["lift", "door", "wipe"].map(|task| {
            format!("{:.1}", numbers("study/energy_ratio.csv", &[("task", task), ("stage", stage)], "ratio")[0])
        });
        assert_eq!(cells(&page, &format!("Energy in training, variable ÷ AFORCE, {label}")), expected, "{label}");
    }
}

#[test]
fn the_readme_tells_what_a_real_arm_would_have_allowed() {
    let page = fs::read_to_string(root().join("README.md")).unwrap();
    let untuned = [
        ("table-1", "lift", ["aforce", "variable"]),
        ("prior", "door", ["aforce", "variable"]),
        ("table-1", "wipe", ["aforce-force", "variable-force"]),
    ];
    let tuned = [
        ("tuned", "lift", ["aforce,draw-1", "variable,draw-2"]),
        ("tuned", "door", ["aforce,draw-3", "variable,draw-6"]),
        ("tuned", "wipe", ["aforce-force,draw-1", "variable-force,draw-1"]),
    ];
    let finished = "Episodes that finish the task before a real Panda would have stopped itself, AFORCE and variable, default settings";
    for (label, stages) in [(finished, untuned), ("The same, both tuned", tuned)] {
        let expected = stages.map(|(experiment, task, groups)| {
            groups.map(|group| {
                let of_group = [("experiment", experiment), ("task", task), ("group", group)];
                format!("{:.0} %", 100.0 * mean(&numbers("study/allowed.csv", &of_group, "allowed")))
            })
        });
        assert_eq!(cells(&page, label), expected.map(|pair| pair.join(", ")), "{label}");
    }
}

#[test]
fn the_readme_tells_what_a_tuned_constant_does_and_who_opens_doors() {
    let page = fs::read_to_string(root().join("README.md")).unwrap();
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    let groups = [("lift", "osc,draw-1"), ("wipe", "osc-force,draw-4"), ("door", "osc,draw-0")];
    let [lift, wipe, door] = groups.map(|(task, group)| {
        let of_group = [("experiment", "tuned"), ("task", task), ("group", group)];
        percent(mean(&numbers("study/allowed.csv", &of_group, "allowed")))
    });
    let [aforce, variable] = ["aforce", "variable"].map(|space| {
        let of_group = [("experiment", "prior"), ("space", space), ("metric", "sampled_success_by_hand")];
        percent(numbers("study/summary.csv", &of_group, "mean")[0])
    });
    let stiff = [("experiment", "prior"), ("task", "door"), ("group", "stiff")];
    let stiff = percent(mean(&numbers("study/allowed.csv", &stiff, "allowed")));
    for sentence in [
        format!(
            "finishes before a stop in {lift} (Lift), {wipe} (Wipe) and {door} (Door) of the episodes. \
             In Door tuning changed nothing; a softer one does in {stiff}."
        ),
        format!("AFORCE opens {aforce} of the doors in the last five evaluations,\n  variable {variable}"),
    ] {
        assert!(page.contains(&sentence), "{sentence}");
    }
}

#[test]
fn the_readme_tells_how_often_the_peg_is_in() {
    let page = fs::read_to_string(root().join("README.md")).unwrap();
    let groups = [
        ("aforce-scaled-force", "1-mm"),
        ("variable", "1-mm"),
        ("fixed-565", "1-mm"),
        ("aforce-scaled-force", "unfelt"),
        ("fixed-565", "unfelt"),
    ];
    let [aforce, variable, constant, unfelt, constant_unfelt] = groups.map(|(space, variant)| {
        let of_group = [("experiment", "again"), ("space", space), ("variant", variant), ("metric", "end_success")];
        format!("{:.0}", 100.0 * numbers("insert/summary.csv", &of_group, "mean")[0])
    });
    let sentence = format!(
        "inserts {aforce} % of the pegs, *variable* {variable} %, a constant {constant} %.\n  \
         In narrower holes success falls. If the policy observes no force, AFORCE inserts {unfelt} %, the constant {constant_unfelt} %."
    );
    assert!(page.contains(&sentence), "{sentence}");
}

#[test]
fn the_first_steps_tell_what_a_run_returns() {
    let page = fs::read_to_string(root().join("docs/start.md")).unwrap();
    let of_group = [("experiment", "learners"), ("space", "aforce"), ("variant", "swift")];
    let mut returns = numbers("second-study/runs.csv", &of_group, "end_return");
    returns.sort_by(f64::total_cmp);
    assert_eq!(returns.len(), 10);
    let sentence = format!("ended with {:.0} to {:.0}, one with {:.0}.", returns[1], returns[9], returns[0]);
    assert!(page.contains(&sentence), "{sentence}");
}
