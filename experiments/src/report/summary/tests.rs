use super::*;
use tasks::Outcome;
use tasks::columns::Cell;

use crate::config::RunConfig;
use crate::report::columns::Columns;
use crate::report::comparison::comparison;
use crate::report::groups::groups;
use crate::report::table::Table;
use crate::run::csv_table::CsvTable;
use crate::run::csv_writer::CsvWriter;
use crate::run::rows::{EvaluationKey, ProgressRow, TrainingKey};

/// A run of 8 evaluations with returns from 10 to 80, each after 10 000 actions in two episodes, and a minute of work.
pub(crate) fn run(root: &Path, folder: &str, energy: f64, offset: f64) -> RunSummary {
    let path = root.join(folder);
    fs_err::create_dir_all(&path).unwrap();
    let space = folder.rsplit('/').nth(1).unwrap();
    let text = format!("preset = \"desktop\"\nsteps = 80000\nevaluation_episodes = 2\n[env]\nspace = \"{space}\"\n");
    fs_err::write(path.join("config.toml"), text).unwrap();
    let folder = RunFolder::open(&path).unwrap();
    let config = RunConfig::resolve(Some(&folder.config()), &[]).unwrap();
    folder.begin_manifest(&config, 0).unwrap();
    let outcome = |total: f64, success: bool, length: u32| {
        Outcome::default().with(&[
            ("return", Cell::Real(total)),
            ("success", Cell::Flag(success)),
            ("success_any", Cell::Flag(true)),
            ("length", Cell::Count(length.into())),
            ("energy_j", Cell::Real(energy * f64::from(length))),
            ("energy_per_action_j", Cell::Real(energy)),
        ])
    };
    let mut eval = CsvWriter::append(&folder.eval()).unwrap();
    for k in 1..=8u64 {
        // Two episodes of each policy, one better than the other; a sampled action earns 1 less.
        for (policy, less) in [("mean", 0.0), ("sampled", 1.0)] {
            for d in [-5.0, 5.0] {
                let key =
                    EvaluationKey { schema: SCHEMA, step: 10_000 * k, policy: policy.into(), ..Default::default() };
                eval.write((key, outcome(10.0 * k as f64 + d + offset - less, k % 2 == 0, 500))).unwrap();
            }
        }
    }
    let mut training = CsvWriter::append(&folder.episodes()).unwrap();
    for k in 1..=16u64 {
        let length = if k == 1 { 1 } else { 5000 };
        let share = |share: f64| Cell::Real(share * energy * f64::from(length));
        let row = outcome(k as f64, true, length).with(&[
            ("penalised_steps", Cell::Count(u64::from(k % 4 == 3))),
            ("penalty", Cell::Real(k as f64)),
            ("excess_impulse_ns", Cell::Real(2.0 * k as f64)),
            ("diverged", Cell::Flag(k > 14)),
            ("mean_stiffness", Cell::Real(10.0 * k as f64)),
            ("energy_positive_j", share(0.7)),
            ("energy_net_j", share(-0.1)),
            ("squared_torque_nm2s", share(30.0)),
            ("copper_loss_j", share(0.2)),
        ]);
        training
            .write((TrainingKey { schema: SCHEMA, step: 5000 * k, episode: k, ..Default::default() }, row))
            .unwrap();
    }
    let mut progress = CsvWriter::append(&folder.progress()).unwrap();
    for k in 1..=40u64 {
        let wall_s = 12.0 * k as f64;
        progress.write(ProgressRow { schema: SCHEMA, step: 2000 * k, wall_s, ..Default::default() }).unwrap();
    }
    RunSummary::of(&Record::of_folder(&folder).unwrap(), root).unwrap()
}

#[test]
fn a_run_is_summed_up() {
    let root = tempfile::tempdir().unwrap();
    let row = run(root.path(), "steps/large/lift/osc/seed_1", 2.0, 0.0);
    assert_eq!((row.experiment.as_str(), row.space.as_str(), row.env_steps), ("steps/large", "osc", 80_000));
    assert!(!row.done);
    for (name, expected) in [
        // The last five evaluations of eight; the best; all eight.
        ("final_return", 60.0),
        ("best_return", 80.0),
        ("curve_return", 45.0),
        // Evaluations 4, 6 and 8 succeed, of the last five.
        ("final_success", 0.6),
        ("final_success_any", 1.0),
        ("sampled_return", 59.0),
        ("sampled_success", 0.6),
        ("sampled_energy_per_action_j", 2.0),
        // Per action, not per episode: the first episode is one action long.
        ("energy_per_action_j", 2.0),
        ("energy_positive_per_action_j", 1.4),
        ("energy_net_per_action_j", -0.2),
        ("squared_torque_per_action_nm2s", 60.0),
        ("copper_loss_per_action_j", 0.4),
        ("penalised_episode_share", 0.25),
        ("penalised_action_share", 4.0 / 75_001.0),
        ("mean_penalty_per_episode", 8.5),
        ("mean_stiffness", 85.0),
        ("excess_impulse_per_episode_ns", 17.0),
        ("diverged_episodes", 2.0),
    ] {
        assert!((row.number(name) - expected).abs() < 1e-6, "{name}: {}, not {expected}", row.number(name));
    }
    assert!(["steps_to_450", "wall_min_to_450"].iter().all(|name| row.number(name).is_nan()));
    let solved = run(root.path(), "lift/osc/seed_1", 2.0, 400.0);
    assert_eq!((solved.number("steps_to_450"), solved.number("wall_min_to_450")), (50_000.0, 5.0));
    assert_eq!(solved.experiment, "");
    let mut names: Vec<&str> = row.numbers.iter().map(|(name, _)| *name).collect();
    names.sort_unstable();
    assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "a name is given once: {names:?}");
}

/// Rewrites the cells of a column: `cell` is given the row's number, from 1 on, and the old cell.
pub fn rewrite(table: &Path, column: &str, cell: impl Fn(usize, &str) -> String) {
    let CsvTable { headers, rows, .. } = CsvTable::read(table).unwrap();
    let at = headers.iter().position(|name| name == column).unwrap();
    let mut writer = csv::Writer::from_path(table).unwrap();
    writer.write_record(&headers).unwrap();
    for (row, cells) in rows.iter().enumerate() {
        let replaced = |(place, old): (usize, &str)| if place == at { cell(row + 1, old) } else { old.into() };
        writer.write_record(cells.iter().enumerate().map(replaced)).unwrap();
    }
    writer.flush().unwrap();
}

fn summary_of(folder: &RunFolder, root: &Path) -> RunSummary {
    RunSummary::of(&Record::of_folder(folder).unwrap(), root).unwrap()
}

/// Sixteen training episodes with penalties of 1 to 16, every fourth of which a real arm would have stopped in.
#[test]
fn forces_are_told_by_quantiles_and_success_by_what_an_arm_allows() {
    let root = tempfile::tempdir().unwrap();
    let path = "lift/osc/seed_1";
    let row = run(root.path(), path, 2.0, 0.0);
    let numbers = |row: &RunSummary, names: [&str; 2]| names.map(|name| row.number(name));
    assert_eq!(numbers(&row, ["median_penalty_per_episode", "q90_penalty_per_episode"]), [8.5, 14.5]);
    let folder = RunFolder::at(&root.path().join(path));
    for table in [folder.episodes(), folder.eval()] {
        let stopped = |row: usize| row.is_multiple_of(4);
        rewrite(&table, "stop_time_s", |row, _| if stopped(row) { "1.5".into() } else { String::new() });
        rewrite(&table, "success_before_stop", |row, _| (!stopped(row)).to_string());
        rewrite(&table, "arm_max_contact_force_n", |row, _| {
            if stopped(row) { format!("{row}000.0") } else { format!("{row}.0") }
        });
    }
    let row = summary_of(&folder, root.path());
    assert_eq!(numbers(&row, ["stopped_episode_share", "median_arm_max_contact_force_n"]), [0.25, 10.5]);
    assert_eq!(row.number("q90_arm_max_contact_force_n"), 10_000.0);
    assert_eq!(numbers(&row, ["final_success_before_stop", "sampled_success_before_stop"]), [1.0, 0.5]);
}

/// A run has numbers of its last policy once that policy was played.
#[test]
fn the_last_policy_is_summed_up_apart() {
    let root = tempfile::tempdir().unwrap();
    let path = "lift/osc/seed_1";
    assert!(run(root.path(), path, 2.0, 0.0).number("end_return").is_nan());
    let folder = RunFolder::at(&root.path().join(path));
    let mut end = CsvWriter::append(&folder.path().join(Table::End.file())).unwrap();
    for (total, success) in [(400.0, true), (100.0, false)] {
        let of = EvaluationKey { task: "lift".into(), space: "osc".into(), seed: 1, ..Default::default() };
        let key = EvaluationKey { schema: SCHEMA, step: 80_000, policy: "mean".into(), ..of };
        let cells = [("return", Cell::Real(total)), ("success_before_stop", Cell::Flag(success))];
        end.write((key, Outcome::default().with(&cells))).unwrap();
    }
    let row = summary_of(&folder, root.path());
    assert_eq!((row.number("end_return"), row.number("end_success_before_stop")), (250.0, 0.5));
    assert!(row.number("end_time_to_success_s").is_nan(), "no cell is filled");
    for (key, problem) in [
        ("70000,mean,1", "neither of the best policy"),
        ("80000,sampled,1", "are to be of mean actions"),
        ("80000,mean,2", "end.csv: has rows of another run, with seed 2, not 1"),
    ] {
        let text = format!("schema,step,policy,seed,return\n{SCHEMA},{key},400\n");
        fs_err::write(folder.path().join(Table::End.file()), text).unwrap();
        let told = RunSummary::of(&Record::of_folder(&folder).unwrap(), root.path()).unwrap_err();
        assert!(format!("{told:#}").contains(problem), "{told:#}");
    }
}

/// A number whose column is empty is empty, not zero, and the other numbers stay.
#[test]
fn an_empty_column_is_no_number() {
    let root = tempfile::tempdir().unwrap();
    let path = "lift/osc/seed_1";
    let whole = run(root.path(), path, 2.0, 0.0);
    let folder = RunFolder::at(&root.path().join(path));
    for column in ["diverged", "penalty", "success_before_stop"] {
        rewrite(&folder.episodes(), column, |_, _| String::new());
    }
    rewrite(&folder.eval(), "success_any", |_, _| String::new());
    let row = summary_of(&folder, root.path());
    let unknown = ["diverged_episodes", "stopped_episode_share", "mean_penalty_per_episode", "final_success_any"];
    assert!(unknown.iter().all(|name| row.number(name).is_nan()));
    assert!(["final_return", "penalised_action_share"].iter().all(|name| row.number(name) == whole.number(name)));
    let out = root.path().join("runs.csv");
    output::file::write_table(&out, &[row]).unwrap();
    let text = fs_err::read_to_string(&out).unwrap();
    assert!(!text.contains("NaN") && text.contains(",,"), "{text}");
    crate::report::curves::draw(&folder).unwrap();
    assert!(Columns::read(&folder.eval()).unwrap().values("sucess_any").is_err(), "a misspelt column");
}

/// How another program changes a table's text when it saves it.
type Change = fn(&str) -> String;

/// Tables of a finished run that an editor, pandas or a spreadsheet saved give the same numbers, or are refused with the
/// place of the problem.
#[test]
fn a_table_that_another_program_saved_says_the_same_or_is_refused() {
    let root = tempfile::tempdir().unwrap();
    let path = "lift/osc/seed_1";
    run(root.path(), path, 2.0, 0.0);
    let folder = RunFolder::at(&root.path().join(path));
    fs_err::write(folder.done(), "").unwrap();
    let whole = summary_of(&folder, root.path());
    let tables = [folder.episodes(), folder.eval(), folder.progress()];
    let before = tables.each_ref().map(|table| fs_err::read_to_string(table).unwrap());
    let saved = |change: Change| {
        tables.iter().zip(&before).for_each(|(table, text)| fs_err::write(table, change(text)).unwrap());
        RunSummary::of(&Record::of_folder(&folder).unwrap(), root.path())
    };
    assert!(before[0].contains("true"));
    let alike: [(&str, Change); 5] = [
        ("no last line end", |text| text.trim_end().into()),
        ("pandas", |text| text.replace("true", "True").replace("false", "False")),
        ("Excel", |text| {
            format!("\u{feff}{}", text.replace("true", "TRUE").replace("false", "FALSE").replace('\n', "\r\n"))
        }),
        ("quotes", |text| text.lines().map(|line| format!("\"{}\"\n", line.replace(',', "\",\""))).collect()),
        ("empty lines", |text| format!("{text}\n\n")),
    ];
    for (name, change) in alike {
        assert_eq!(saved(change).unwrap(), whole, "{name}");
    }
    let refused: [(Change, &str); 4] = [
        (|text| text.replace(',', ";").replace('.', ","), "line 1: the columns are divided by ';'"),
        (|text| text.split_once('\n').unwrap().1.into(), "the names of the columns is missing"),
        (|text| text.replace(",16.0,", ",1e999,"), "line 17: penalty is \"1e999\", not a number"),
        (|text| text.trim_end().rsplit_once(',').unwrap().0.into(), "line: 17"),
    ];
    for (change, reason) in refused {
        let told = format!("{:#}", saved(change).unwrap_err());
        assert!(told.contains("episodes.csv") && told.contains(reason), "{told}");
    }
}

/// Tables of an earlier program are refused with the commit that reads them.
#[test]
fn an_earlier_schema_is_refused() {
    let root = tempfile::tempdir().unwrap();
    let path = "lift/osc/seed_1";
    run(root.path(), path, 2.0, 0.0);
    let folder = RunFolder::at(&root.path().join(path));
    rewrite(&folder.episodes(), "schema", |_, _| "5".into());
    let told = RunSummary::of(&Record::of_folder(&folder).unwrap(), root.path()).unwrap_err().to_string();
    assert!(told.contains("episodes.csv, line 2: schema \"5\"") && told.contains("at commit d3b96bb"), "{told}");
}

/// A run that lost its skill has no time to success, however fast it once was.
#[test]
fn the_end_of_a_run_is_its_last_five_evaluations_for_every_column() {
    let root = tempfile::tempdir().unwrap();
    run(root.path(), "door/osc/seed_1", 2.0, 0.0);
    let folder = RunFolder::at(&root.path().join("door/osc/seed_1"));
    let evaluations = |last: Option<f64>| {
        fs_err::remove_file(folder.eval()).unwrap();
        let mut eval = CsvWriter::append(&folder.eval()).unwrap();
        for (k, policy) in (1..=8).flat_map(|k| ["mean", "sampled"].map(|policy| (k, policy))) {
            for episode in 0..2 {
                let time_to_success_s = if k == 3 { Some(7.0) } else { last.filter(|_| k == 8 && episode == 1) };
                let (fulfilled_time_s, fulfilled_max_force_n) =
                    time_to_success_s.map_or((0.0, 0.0), |time| (1.0, 10.0 * time));
                let key =
                    EvaluationKey { schema: SCHEMA, step: 10_000 * k, policy: policy.into(), ..Default::default() };
                let success = time_to_success_s.is_some();
                let outcome = Outcome::default().with(&[
                    ("success", Cell::Flag(success)),
                    ("time_to_success_s", time_to_success_s.into()),
                    ("fulfilled_time_s", Cell::Real(fulfilled_time_s)),
                    ("fulfilled_max_force_n", Cell::Real(fulfilled_max_force_n)),
                ]);
                eval.write((key, outcome)).unwrap();
            }
        }
        let row = summary_of(&folder, root.path());
        let numbers = [
            "sampled_success",
            "sampled_time_to_success_s",
            "final_time_to_success_s",
            "sampled_fulfilled_max_force_n",
        ];
        numbers.map(|name| Some(row.number(name)).filter(|number| !number.is_nan()))
    };
    assert_eq!(evaluations(None), [Some(0.0), None, None, None]);
    assert_eq!(evaluations(Some(9.0)), [0.1, 9.0, 9.0, 90.0].map(Some), "of the one episode that has it");
}

#[test]
fn an_evaluation_under_way_does_not_count() {
    let root = tempfile::tempdir().unwrap();
    let path = "lift/osc/seed_1";
    let before = run(root.path(), path, 2.0, 0.0);
    let folder = RunFolder::at(&root.path().join(path));
    let one_of_two = || {
        let key = EvaluationKey { schema: SCHEMA, step: 90_000, policy: "mean".into(), ..Default::default() };
        let outcome = Outcome::default().with(&[("return", Cell::Real(460.0))]);
        CsvWriter::append(&folder.eval()).unwrap().write((key, outcome)).unwrap();
    };
    one_of_two();
    assert_eq!(summary_of(&folder, root.path()), before);
    one_of_two();
    assert_eq!(summary_of(&folder, root.path()).number("best_return"), 460.0);
}

#[test]
fn spaces_are_compared_within_their_experiment() {
    let root = tempfile::tempdir().unwrap();
    let runs = [
        run(root.path(), "a/lift/aforce/seed_1", 2.0, 0.0),
        run(root.path(), "a/lift/osc/seed_1", 3.0, 5.0),
        run(root.path(), "b/lift/osc/seed_1", 9.0, -5.0),
        run(root.path(), "b/lift/aforce/seed_1", 3.0, 0.0),
    ];
    let rows = comparison(&groups(&runs));
    let value = |experiment: &str, quantity: &str| {
        let mut found = rows.iter().filter(|row| row.experiment == experiment && row.quantity == quantity);
        let row = found.next().unwrap();
        assert!(found.next().is_none() && (row.space.as_str(), row.n_space, row.n_reference) == ("osc", 1, 1));
        row.value
    };
    for (experiment, improvement, ratio) in [("a", 0.0, 1.5), ("b", 1.0, 3.0)] {
        for order in ["ends higher", "learns faster"] {
            assert_eq!(value(experiment, &format!("probability that reference {order}")), improvement);
        }
        assert!((value(experiment, "energy_per_action_j: space / reference") - ratio).abs() < 1e-12);
    }
}
