use super::*;
use crate::report::comparison::comparison;
use crate::report::groups::groups;

/// A run of 8 evaluations with returns from 10 to 80, each after 10 000 actions in two episodes, and a minute of work.
pub(crate) fn run(root: &Path, folder: &str, energy: f64, offset: f64) -> RunSummary {
    let path = root.join(folder);
    fs_err::create_dir_all(&path).unwrap();
    let write = |name: &str, header: &str, rows: Vec<String>| {
        fs_err::write(path.join(name), format!("{header}\n{}\n", rows.join("\n"))).unwrap();
    };
    let space = folder.rsplit('/').nth(1).unwrap();
    let text = format!("preset = \"desktop\"\nsteps = 80000\nevaluation_episodes = 2\n[env]\nspace = \"{space}\"\n");
    fs_err::write(path.join("config.toml"), text).unwrap();
    let folder = RunFolder::open(&path).unwrap();
    let config = RunConfig::resolve(Some(&folder.config()), &[]).unwrap();
    folder.begin_manifest(&config, 0).unwrap();
    let columns = "return,success,success_any,energy_j,energy_per_action_j";
    let eval = (1..=8).flat_map(|k| {
        // Two episodes, one better than the other.
        [-5.0, 5.0].map(|d| {
            format!("2,{},mean,{},{},true,1,{}", 10_000 * k, 10.0 * f64::from(k) + d + offset, k % 2 == 0, energy)
        })
    });
    write("eval.csv", &format!("schema,step,policy,{columns}"), eval.collect());
    let training = (1..=16).map(|k| {
        let long = if k == 1 { 1 } else { 5000 };
        let total = energy * f64::from(long);
        let energies = [0.7, -0.1, 30.0, 0.2].map(|share| (share * total).to_string()).join(",");
        let (penalised, impulse, diverged) = (k % 4 / 3, 2 * k, k > 14);
        format!(
            "2,{},{k},true,true,{total},{energy},{long},{penalised},{k},{impulse},{diverged},{},{energies}",
            5000 * k,
            10 * k
        )
    });
    let header = format!(
        "schema,step,{columns},length,penalised_steps,penalty,excess_impulse_ns,diverged,mean_stiffness,\
         energy_positive_j,energy_net_j,squared_torque_nm2s,copper_loss_j"
    );
    write("episodes.csv", &header, training.collect());
    write("progress.csv", "step,wall_s", (1..=40).map(|k| format!("{},{}", 2000 * k, 12 * k)).collect());
    RunSummary::of(&folder, root).unwrap()
}

#[test]
fn a_run_is_summed_up() {
    let root = tempfile::tempdir().unwrap();
    let row = run(root.path(), "steps/large/lift/osc/seed_1", 2.0, 0.0);
    assert_eq!((row.schema, row.experiment.as_str(), row.space.as_str()), (2, "steps/large", "osc"));
    assert_eq!((row.env_steps, row.final_return, row.best_return), (80_000, 60.0, 80.0), "the last five of eight");
    assert_eq!(row.curve_return, 45.0, "all eight");
    assert_eq!((row.final_success, row.final_success_any), (0.6, 1.0), "evaluations 4, 6, 8 of 4 to 8");
    // Episodes after the third evaluation: 7 to 16.
    assert_eq!((row.sampled_return, row.sampled_success, row.sampled_energy_per_action_j), (11.5, 1.0, 2.0));
    assert_eq!((row.steps_to_450, row.wall_min_to_450), (None, None));
    // Per action, not per episode: the first episode is one action long.
    let energies = [
        row.energy_per_action_j,
        row.energy_positive_per_action_j,
        row.energy_net_per_action_j,
        row.squared_torque_per_action_nm2s,
        row.copper_loss_per_action_j,
    ];
    for (energy, expected) in energies.into_iter().zip([2.0, 1.4, -0.2, 60.0, 0.4]) {
        assert!((energy - expected).abs() < 1e-9, "{energies:?}");
    }
    assert_eq!((row.penalised_episode_share, row.mean_penalty_per_episode), (0.25, 8.5));
    assert_eq!((row.penalised_action_share, row.mean_stiffness), (4.0 / 75_001.0, 85.0));
    assert_eq!((row.excess_impulse_per_episode_ns, row.diverged_episodes, row.done), (17.0, Some(2), false));
    let solved = run(root.path(), "lift/osc/seed_1", 2.0, 400.0);
    assert_eq!((solved.steps_to_450, solved.wall_min_to_450), (Some(50_000), Some(5.0)));
    assert_eq!(solved.experiment, "");
}

/// Sixteen training episodes with penalties of 1 to 16, every fourth of which a real arm would have stopped in.
#[test]
fn forces_are_told_by_quantiles_and_success_by_what_an_arm_allows() {
    let root = tempfile::tempdir().unwrap();
    let path = "lift/osc/seed_1";
    let old = run(root.path(), path, 2.0, 0.0);
    assert_eq!((old.median_penalty_per_episode, old.q90_penalty_per_episode), (8.5, 14.5));
    assert_eq!((old.stopped_episode_share, old.final_success_before_stop), (None, None), "a table without the columns");
    let folder = RunFolder::at(&root.path().join(path));
    for table in [folder.episodes(), folder.eval()] {
        let text = fs_err::read_to_string(&table).unwrap();
        let with = |(row, line): (usize, &str)| match row {
            0 => format!(
                "{line},stop_time_s,success_before_stop,arm_max_contact_force_n,max_force_to_success_n
"
            ),
            row if row % 4 == 0 => format!(
                "{line},1.5,false,{row}000,
"
            ),
            row => format!(
                "{line},,true,{row},{row}
"
            ),
        };
        fs_err::write(&table, text.lines().enumerate().map(with).collect::<String>()).unwrap();
    }
    let row = RunSummary::of(&folder, root.path()).unwrap();
    assert_eq!((row.stopped_episode_share, row.median_arm_max_contact_force_n), (Some(0.25), Some(10.5)));
    assert_eq!(row.q90_arm_max_contact_force_n, Some(10_000.0));
    assert_eq!(row.final_success_before_stop, Some(0.7), "three of the last ten evaluation episodes");
}

/// What a run's tables are too old to tell is empty, not zero, and the rest stays.
#[test]
fn a_table_that_lacks_a_column_is_read_without_it() {
    let root = tempfile::tempdir().unwrap();
    let path = "lift/osc/seed_1";
    let whole = run(root.path(), path, 2.0, 0.0);
    let folder = RunFolder::at(&root.path().join(path));
    let absent = [(folder.episodes(), "diverged"), (folder.episodes(), "penalty"), (folder.eval(), "success_any")];
    for (table, column) in absent {
        let text = fs_err::read_to_string(&table).unwrap();
        let at = text.lines().next().unwrap().split(',').position(|name| name == column).unwrap();
        let without = |line: &str| {
            let cells = line.split(',').enumerate().filter(|(index, _)| *index != at);
            cells.map(|(_, cell)| cell).collect::<Vec<_>>().join(",") + "\n"
        };
        fs_err::write(&table, text.lines().map(without).collect::<String>()).unwrap();
    }
    let row = RunSummary::of(&folder, root.path()).unwrap();
    assert_eq!(row.diverged_episodes, None);
    assert!(row.mean_penalty_per_episode.is_nan() && row.final_success_any.is_nan());
    assert_eq!((row.final_return, row.penalised_action_share), (whole.final_return, whole.penalised_action_share));
    let out = root.path().join("runs.csv");
    output::file::write_table(&out, &[row]).unwrap();
    let text = fs_err::read_to_string(&out).unwrap();
    assert!(!text.contains("NaN") && text.contains(",,"), "{text}");
    crate::report::curves::draw(&folder).unwrap();
    assert!(Columns::read(&folder.eval()).unwrap().values("sucess_any").is_err(), "a misspelt column is no old one");
}

/// A run that lost its skill has no time to success, however fast it once was.
#[test]
fn the_end_of_a_run_is_its_last_five_evaluations_for_every_column() {
    let root = tempfile::tempdir().unwrap();
    run(root.path(), "door/osc/seed_1", 2.0, 0.0);
    let folder = RunFolder::at(&root.path().join("door/osc/seed_1"));
    let evaluations = |last: Option<f64>| {
        let mut table = String::from(
            "schema,step,policy,return,success,time_to_success_s,fulfilled_time_s,fulfilled_max_force_n\n",
        );
        for (k, policy) in (1..=8).flat_map(|k| ["mean", "sampled"].map(|policy| (k, policy))) {
            for episode in 0..2 {
                let time = if k == 3 { Some(7.0) } else { last.filter(|_| k == 8 && episode == 1) };
                let cell = time.map_or(String::new(), |time| time.to_string());
                let (stood, force) = time.map_or((0.0, 0.0), |time| (1.0, 10.0 * time));
                table += &format!("5,{},{policy},1,{},{cell},{stood},{force}\n", 10_000 * k, time.is_some());
            }
        }
        fs_err::write(folder.eval(), table).unwrap();
        let training = fs_err::read_to_string(folder.episodes()).unwrap().replace("\n2,", "\n5,");
        fs_err::write(folder.episodes(), training).unwrap();
        let row = RunSummary::of(&folder, root.path()).unwrap();
        (
            row.sampled_success,
            row.sampled_time_to_success_s,
            row.final_time_to_success_s,
            row.sampled_fulfilled_max_force_n,
        )
    };
    assert_eq!(evaluations(None), (0.0, None, None, None));
    assert_eq!(evaluations(Some(9.0)), (0.1, Some(9.0), Some(9.0), Some(90.0)), "of the one episode that has it");
}

#[test]
fn an_evaluation_under_way_does_not_count() {
    let root = tempfile::tempdir().unwrap();
    let path = "lift/osc/seed_1";
    let before = run(root.path(), path, 2.0, 0.0);
    let folder = RunFolder::at(&root.path().join(path));
    let one_of_two = "2,90000,mean,460,true,true,1,2\n";
    let table = fs_err::read_to_string(folder.eval()).unwrap();
    fs_err::write(folder.eval(), table.clone() + one_of_two).unwrap();
    assert_eq!(RunSummary::of(&folder, root.path()).unwrap(), before);
    fs_err::write(folder.eval(), table + one_of_two + one_of_two).unwrap();
    assert_eq!(RunSummary::of(&folder, root.path()).unwrap().best_return, 460.0);
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
