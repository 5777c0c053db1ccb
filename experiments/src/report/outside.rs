//! Runs of other libraries: what Stable-Baselines3's `EvalCallback` and `Monitor` write into a folder, read as the tables of a run.

use std::path::{Path, PathBuf};

use aforce::name;
use anyhow::{Context, Error, Result, bail, ensure};
use serde_json::Value;
use tasks::{TaskKind, TaskName, register_anew};

use crate::config::{RunConfig, RunId};
use crate::report::npz::{self, Array};
use crate::report::table::Table;
use crate::run::csv_table::CsvTable;
use crate::run::rows::SCHEMA;

/// What `EvalCallback` writes with `log_path`.
const EVALUATIONS: &str = "evaluations.npz";
/// What `Monitor` writes: `monitor.csv`, or `NAME.monitor.csv` for each of several environments.
const MONITOR: &str = "monitor.csv";

/// Whether a folder holds such curves: the evaluations at least.
pub fn is_outside(folder: &Path) -> bool {
    folder.join(EVALUATIONS).is_file()
}

/// The configuration that stands for an outside run, and its tables. Its folder says what it is: TASK/SPACE,LEARNER/seed_N. Evaluations
/// count as those of mean actions, which `EvalCallback` plays unless told otherwise; a `monitor.csv`, or several of them, are the training
/// episodes.
///
/// # Errors
/// If the folder is not called so, or a file of it is damaged.
pub fn read(folder: &Path) -> Result<(RunConfig, Vec<(Table, CsvTable)>)> {
    let evaluations = folder.join(EVALUATIONS);
    let (table, episodes) = evaluated(&evaluations).with_context(|| evaluations.display().to_string())?;
    let config = config_of(folder, episodes)?;
    let mut tables = vec![(Table::Eval, table)];
    let monitors = monitors(folder)?;
    if !monitors.is_empty() {
        let [training, progress] = trained(&folder.join(MONITOR), &monitors);
        tables.extend([(Table::Episodes, training), (Table::Progress, progress)]);
    }
    Ok((config, tables))
}

/// Every table of training episodes in a folder, sorted by name, which is the order of episodes that ended at the same moment.
fn monitors(folder: &Path) -> Result<Vec<Monitor>> {
    let mut paths: Vec<PathBuf> = fs_err::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<Result<_>>()?;
    paths.sort();
    let is_monitor = |path: &&PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        path.is_file() && (name == MONITOR || name.ends_with(&format!(".{MONITOR}")))
    };
    let read = |path: &PathBuf| Monitor::read(path).with_context(|| path.display().to_string());
    paths.iter().filter(is_monitor).map(read).collect()
}

/// The configuration that stands for the run in `folder`. Only the name of its action space is known, which need not be a built-in one.
fn config_of(folder: &Path, evaluation_episodes: u32) -> Result<RunConfig> {
    let RunId { task, space, variant, seed } = id_of(folder)?;
    let at = || folder.display().to_string();
    [&space, &variant].into_iter().try_for_each(|part| name::check_part(part)).map_err(Error::msg).with_context(at)?;
    let task = task_called(task).with_context(at)?;
    let mut config = RunConfig { variant, seed, evaluation_episodes, ..RunConfig::preset(sac::Preset::DESKTOP) };
    config.env.task = task;
    config.env.space.name = space;
    Ok(config)
}

/// The task of that name. A name that no task has is registered as that of a task made elsewhere, such as one in Python,
/// so that files of hypotheses may name it.
fn task_called(name: String) -> Result<TaskName> {
    let make = |_| register_anew(TaskKind::made_elsewhere(name.clone().leak(), "do what its owner asks for"));
    Ok(name.parse().or_else(make)?)
}

/// The identity of the run, from the names of its folders.
fn id_of(folder: &Path) -> Result<RunId> {
    let names: Vec<String> = folder.iter().rev().take(3).map(|name| name.to_string_lossy().into_owned()).collect();
    let id = || {
        let [seed, label, task] = names.as_slice() else { return None };
        let (space, variant) = label.split_once(',')?;
        let seed = seed.strip_prefix("seed_")?.parse().ok()?;
        Some(RunId { task: task.clone(), space: space.into(), variant: variant.into(), seed })
    };
    let wanted =
        "a folder with evaluations.npz is to be called TASK/SPACE,LEARNER/seed_N, such as lift/aforce,sb3/seed_1";
    id().with_context(|| format!("{}: {wanted}", folder.display()))
}

/// Evaluations as rows of `eval.csv`, and how many episodes each has.
fn evaluated(path: &Path) -> Result<(CsvTable, u32)> {
    let arrays = npz::read(path)?;
    let array = |name: &str| arrays.iter().find(|(known, _)| known == name).map(|(_, array)| array);
    let wanted = |name: &str| array(name).with_context(|| format!("no array {name:?}"));
    let (steps, returns, lengths) = (wanted("timesteps")?, wanted("results")?, wanted("ep_lengths")?);
    let successes = array("successes");
    let [evaluations, episodes] = returns.shape[..] else { bail!("results: rows of evaluations are needed") };
    for (name, shape) in [("timesteps", &steps.shape[..]), ("ep_lengths", &lengths.shape[..lengths.shape.len().min(1)])]
    {
        ensure!(*shape == [evaluations], "{name}: {shape:?} evaluations, but results has {evaluations}");
    }
    for other in [Some(lengths), successes].into_iter().flatten() {
        ensure!(other.shape == returns.shape, "ep_lengths and successes are to be as large as results");
    }
    ensure!(evaluations * episodes > 0, "no evaluation");
    let cell = |array: &Array, at: usize| array.values[at].to_string();
    let rows = (0..evaluations * episodes).map(|at| {
        let success = successes.map_or(String::new(), |all| (all.values[at] > 0.0).to_string());
        let step = steps.values[at / episodes].to_string();
        csv::StringRecord::from(vec![
            SCHEMA.to_string(),
            step,
            "mean".into(),
            cell(returns, at),
            cell(lengths, at),
            success,
        ])
    });
    Ok((table(path, &["schema", "step", "policy", "return", "length", "success"], rows.collect()), episodes as u32))
}

/// A `monitor.csv`: a line with a comment, then `r,l,t` and whatever else was asked for.
struct Monitor {
    /// When it began (s, by the clock of the machine).
    began: f64,
    episodes: Vec<Ended>,
}

/// A training episode.
struct Ended {
    /// Since the monitor began (s).
    time: f64,
    length: u64,
    total: String,
}

impl Monitor {
    fn read(path: &Path) -> Result<Self> {
        let text = fs_err::read_to_string(path)?;
        let (comment, rest) = text.split_once('\n').unwrap_or((&text, ""));
        let expected = "line 1: a comment with t_start is expected, as stable_baselines3.common.monitor writes it";
        let comment: Option<Value> = comment.strip_prefix('#').and_then(|json| serde_json::from_str(json).ok());
        let began = comment.and_then(|comment| comment["t_start"].as_f64()).context(expected)?;
        let table = CsvTable::parse(path, rest)?;
        let [totals, lengths, times] = ["r", "l", "t"].map(|name| table.column(name));
        let rows = totals?.into_iter().zip(lengths?).zip(times?).enumerate();
        let episodes = rows.map(|(row, ((total, length), time))| {
            let of_line = || format!("line {}: {total:?}, {length:?}, {time:?}", row + 3);
            let (length, time) = (length.parse().with_context(of_line)?, time.parse().with_context(of_line)?);
            Ok(Ended { time, length, total: total.into() })
        });
        Ok(Monitor { began, episodes: episodes.collect::<Result<_>>()? })
    }
}

/// Training episodes and the clock. Those of several environments follow each other in the order in which they ended.
fn trained(path: &Path, monitors: &[Monitor]) -> [CsvTable; 2] {
    let began = monitors.iter().map(|monitor| monitor.began).fold(f64::INFINITY, f64::min);
    let all = monitors.iter().flat_map(|monitor| monitor.episodes.iter().map(move |ended| (monitor, ended)));
    let mut episodes: Vec<(f64, &Ended)> =
        all.map(|(monitor, ended)| (monitor.began - began + ended.time, ended)).collect();
    episodes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut step, mut training, mut progress) = (0, vec![], vec![]);
    for (at, (time, Ended { length, total, .. })) in episodes.into_iter().enumerate() {
        step += length;
        let row = [SCHEMA.to_string(), step.to_string(), (at + 1).to_string(), total.clone(), length.to_string()];
        training.push(csv::StringRecord::from(row.to_vec()));
        progress.push(csv::StringRecord::from(vec![step.to_string(), time.to_string(), String::new()]));
    }
    [
        table(path, &["schema", "step", "episode", "return", "length"], training),
        table(path, &["step", "wall_s", "cpu_s"], progress),
    ]
}

fn table(path: &Path, columns: &[&str], rows: Vec<csv::StringRecord>) -> CsvTable {
    CsvTable::new(path, columns.to_vec().into(), rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::record::Record;
    use crate::report::summary::RunSummary;
    use crate::report::verdicts::judge;

    /// Files that `scripts/sb3_curves_reference.py` made.
    fn reference() -> &'static Path {
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/reference/sb3"))
    }

    #[test]
    fn curves_of_stable_baselines_become_a_run() {
        let record = Record::of_outside(&reference().join("lift/aforce,sb3/seed_3")).unwrap();
        let expected = CsvTable::read_finished(&reference().join("expected.csv")).unwrap();
        let eval = record.evaluations("mean").unwrap();
        for column in ["return", "success"] {
            let numbers = expected.column(column).unwrap().into_iter().map(|cell| cell.parse::<f64>().unwrap());
            let points: Vec<(f64, f64)> =
                expected.steps().unwrap().iter().map(|&step| step as f64).zip(numbers).collect();
            let found = eval.mean_by_step(column).unwrap();
            assert!(points.len() == 6 && found.len() == 6, "{found:?}");
            let differs = |(a, b): (&(f64, f64), &(f64, f64))| a.0 != b.0 || (a.1 - b.1).abs() > 1e-12;
            assert!(!found.iter().zip(&points).any(differs), "{column}: {found:?}, not {points:?}");
        }
        let row = RunSummary::of(&record, reference()).unwrap();
        assert_eq!((row.label().as_str(), row.seed, row.env_steps, row.done), ("aforce,sb3", 3, 300, true));
        assert!(row.number("final_return").is_finite() && row.wall_s > 0.0);
        let unknown = ["sampled_return", "energy_per_action_j", "final_energy_per_action_j"];
        assert!(unknown.iter().all(|name| row.number(name).is_nan()));
        assert_eq!(row.steps, Some(300), "a longer run is not held against a shorter one");
        assert_eq!((row.position_step_m, row.preset.as_str(), row.commit.as_str()), (None, "", ""));
    }

    #[test]
    fn a_space_of_ones_own_has_curves_too() {
        let folder = tempfile::tempdir().unwrap();
        let run = folder.path().join("door/soft,sb3/seed_1");
        fs_err::create_dir_all(&run).unwrap();
        fs_err::copy(reference().join("lift/aforce,sb3/seed_3").join(EVALUATIONS), run.join(EVALUATIONS)).unwrap();
        let record = Record::of_outside(&run).unwrap();
        let row = RunSummary::of(&record, folder.path()).unwrap();
        assert_eq!((row.task.as_str(), row.label().as_str(), row.seed), ("door", "soft,sb3", 1));
    }

    /// The programs do not know a task written in Python. Its curves can be compared all the same, and a hypothesis may name it.
    #[test]
    fn a_task_of_ones_own_has_curves_and_hypotheses() {
        let folder = tempfile::tempdir().unwrap();
        let mut runs = vec![];
        for (space, seed) in [("aforce", 1), ("aforce", 2), ("osc", 1), ("osc", 2)] {
            let run = folder.path().join(format!("peel/{space},sb3/seed_{seed}"));
            fs_err::create_dir_all(&run).unwrap();
            fs_err::copy(reference().join("lift/aforce,sb3/seed_3").join(EVALUATIONS), run.join(EVALUATIONS)).unwrap();
            runs.push(RunSummary::of(&Record::of_outside(&run).unwrap(), folder.path()).unwrap());
        }
        let hypotheses = folder.path().join("hypotheses.toml");
        let text = "[[hypothesis]]\nname = \"aforce ends higher\"\ntasks = [\"peel\"]\nmetric = \"final_return\"\n\
                    expected = \"above\"\nspace = \"aforce,sb3\"\nagainst = \"osc,sb3\"\n";
        fs_err::write(&hypotheses, text).unwrap();
        let rows = judge(&hypotheses, &runs).unwrap();
        assert_eq!((rows.len(), rows[0].task.as_str(), rows[0].n_space, rows[0].p), (1, "peel", 2, Some(1.0)));
        fs_err::write(&hypotheses, text.replace("peel", "pel")).unwrap();
        let told = judge(&hypotheses, &runs).unwrap_err().to_string();
        assert!(told.contains("no task is called \"pel\"; did you mean \"peel\"?"), "{told}");
    }

    #[test]
    fn episodes_of_several_environments_follow_each_other_by_their_ends() {
        let folder = tempfile::tempdir().unwrap();
        let monitor = |name: &str, began: f64, rows: &str| {
            let text = format!("#{{\"t_start\": {began}, \"env_id\": \"None\"}}\nr,l,t\n{rows}");
            fs_err::write(folder.path().join(name), text).unwrap();
        };
        monitor("0.monitor.csv", 100.0, "1.5,10,1.0\n2.5,10,4.0\n");
        monitor("1.monitor.csv", 101.0, "3.5,20,1.5\n");
        let [training, progress] = trained(folder.path(), &monitors(folder.path()).unwrap());
        assert_eq!(training.column("return").unwrap(), ["1.5", "3.5", "2.5"]);
        assert_eq!(training.steps().unwrap(), [10, 30, 40]);
        assert_eq!(progress.column("wall_s").unwrap(), ["1", "2.5", "4"]);
        // Episodes that ended at the same moment are sorted by the name of their file.
        for name in (0..9).rev() {
            monitor(&format!("{name}.monitor.csv"), 100.0, &format!("{name}.5,10,1.0\n"));
        }
        let [training, _] = trained(folder.path(), &monitors(folder.path()).unwrap());
        assert_eq!(training.column("return").unwrap(), ["0.5", "1.5", "2.5", "3.5", "4.5", "5.5", "6.5", "7.5", "8.5"]);
        monitor("0.monitor.csv", 100.0, "1.5,ten,1.0\n");
        let told = format!("{:#}", monitors(folder.path()).err().unwrap());
        assert!(told.contains("0.monitor.csv: line 3") && told.contains("ten"), "{told}");
    }

    #[test]
    fn a_folder_that_does_not_say_what_it_is_and_a_damaged_file_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let npz = fs_err::read(reference().join("lift/aforce,sb3/seed_3").join(EVALUATIONS)).unwrap();
        let told = |name: &str, bytes: &[u8]| {
            let run = folder.path().join(name);
            fs_err::create_dir_all(&run).unwrap();
            fs_err::write(run.join(EVALUATIONS), bytes).unwrap();
            format!("{:#}", read(&run).unwrap_err())
        };
        for name in ["lift/aforce/seed_1", "lift/aforce,sb3/first"] {
            assert!(told(name, &npz).contains("is to be called TASK/SPACE,LEARNER/seed_N"));
        }
        assert!(told("Lift It/aforce,sb3/seed_1", &npz).contains("a name has lower-case letters, digits and -"));
        assert!(told("lift/a force,sb3/seed_1", &npz).contains("\"a force\" is no name"));
        assert!(told("lift/aforce,sb3/seed_1", &npz[..npz.len() / 2]).contains("evaluations.npz"));
    }
}
