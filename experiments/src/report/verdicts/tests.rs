//! Every verdict, and every error.

use super::*;
use crate::report::groups::tests::set;
use tasks::columns::Cell;

fn runs(space: &str, returns: &[f64], steps_to_450: &[Option<u64>]) -> Vec<RunSummary> {
    let run = |(seed, (&sampled_return, &steps_to_450)): (u64, (&f64, &Option<u64>))| RunSummary {
        task: "lift".into(),
        space: space.into(),
        seed,
        numbers: vec![
            ("sampled_return", Cell::Real(sampled_return)),
            ("steps_to_450", steps_to_450.map_or(Cell::Empty, Cell::Count)),
        ],
        done: true,
        preset: "swift".into(),
        ..RunSummary::default()
    };
    (11..).zip(returns.iter().zip(steps_to_450)).map(run).collect()
}

fn judged(text: &str, runs: &[RunSummary]) -> Result<Vec<VerdictRow>> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("hypotheses.toml");
    fs_err::write(&file, text).unwrap();
    judge(&file, runs)
}

fn hypothesis(metric: &str, expected: &str, against: &str, more: &str) -> String {
    format!(
        "[[hypothesis]]\nname = '{metric} {against}'\ntasks = ['lift']\nmetric = '{metric}'\nexpected = '{expected}'\n\
         space = 'aforce'\nagainst = '{against}'\n{more}\n"
    )
}

#[test]
fn every_verdict_has_its_case() {
    let seeds = [0.0, 1.0, 2.0, 3.0, 4.0];
    let returns = |at: f64| seeds.map(|seed| at + seed);
    let early = [Some(100), Some(110), Some(90), Some(120), Some(80)];
    let late = [Some(200), None, None, Some(300), None];
    let all = [
        runs("aforce", &returns(440.0), &early),
        runs("variable", &returns(400.0), &late),
        runs("osc", &returns(440.5), &early),
    ]
    .concat();
    let text = [
        hypothesis("sampled_return", "above", "variable", "margin = 5"),
        hypothesis("sampled_return", "below", "variable", ""),
        hypothesis("steps_to_450", "below", "variable", ""),
        hypothesis("sampled_return", "above", "osc", "margin = 5"),
        hypothesis("sampled_return", "above", "osc", "margin = 1"),
        hypothesis("sampled_return", "above", "low", ""),
        hypothesis("steps_to_450", "above", "variable", ""),
    ]
    .concat();
    let rows = judged(&text, &all).unwrap();
    let verdicts: Vec<&str> = rows.iter().map(|row| row.verdict).collect();
    assert_eq!(
        verdicts,
        ["as expected", "the other way round", "as expected", "equal", "not decided", "no runs", "the other way round"],
        "{rows:#?}"
    );
    // 2 of the 252 ways to split ten runs into halves are this extreme, and six hypotheses have runs.
    let p = 2.0 / 252.0;
    assert!((rows[0].p.unwrap() - p).abs() < 1e-12 && (rows[0].p_holm.unwrap() - 6.0 * p).abs() < 1e-12);
    assert_eq!((rows[0].difference, rows[0].above, rows[2].above), (Some(40.0), Some(1.0), Some(0.0)));
    assert_eq!((rows[2].mean_against, rows[2].difference), (None, None), "three of them never came there");
    // With five seeds p is below 0.05 / 6 only if all pairs agree, so the detectable difference exceeds the spread of the returns, 4.
    assert!(rows[4].smallest_detectable.is_some_and(|d| (4.0..8.0).contains(&d)), "{:?}", rows[4]);
}

#[test]
fn a_family_in_two_files_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let files = ["one.toml", "two.toml"].map(|name| folder.path().join(name));
    for file in &files {
        fs_err::write(file, hypothesis("sampled_return", "above", "osc", "family = 'mine'")).unwrap();
    }
    let error = judge_all(&files, &[]).unwrap_err().to_string();
    assert!(error.contains("two.toml: ") && error.contains("one.toml has a family \"mine\" too"), "{error}");
    fs_err::write(&files[1], hypothesis("sampled_return", "above", "osc", "")).unwrap();
    let families: Vec<String> = judge_all(&files, &[]).unwrap().into_iter().map(|row| row.family).collect();
    assert_eq!(families, ["mine", "two, lift"], "without a name it is called after file and task");
}

#[test]
fn a_run_counts_once_it_is_done() {
    let mut all = [runs("aforce", &[1.0, 2.0, 3.0], &[None; 3]), runs("osc", &[1.0, 2.0], &[None; 2])].concat();
    all[2].done = false;
    let row = judged(&hypothesis("sampled_return", "above", "osc", "margin = 50"), &all).unwrap().remove(0);
    assert_eq!((row.n_space, row.n_against, row.mean_space), (2, 2, Some(1.5)));
    assert_eq!(row.verdict, "not decided", "two runs of each side may agree by chance");
    all[4].preset = "paper".into();
    let error = judged(&hypothesis("sampled_return", "above", "osc", ""), &all).unwrap_err().to_string();
    assert!(error.contains("runs trained with paper and swift"), "{error}");
    all[4].preset = String::new();
    let error = judged(&hypothesis("sampled_return", "above", "osc", ""), &all).unwrap_err().to_string();
    assert!(error.contains("runs trained with another learner and swift"), "{error}");
    all[4].preset = "swift".into();
    all.iter_mut().zip([200, 200, 200, 200, 80]).for_each(|(run, steps)| run.steps = Some(steps));
    let error = judged(&hypothesis("sampled_return", "above", "osc", ""), &all).unwrap_err().to_string();
    assert!(error.contains("runs of 80 and 200 actions: take the shorter ones on"), "{error}");
    all[4].steps = Some(200);
    all[4].experiment = "parts".into();
    let error = judged(&hypothesis("sampled_return", "above", "osc", ""), &all).unwrap_err().to_string();
    assert!(error.contains("runs of experiments  and parts"), "{error}");
    all.iter_mut().for_each(|run| run.experiment = "parts".into());
    let row = judged(&hypothesis("sampled_return", "above", "osc", ""), &all).unwrap().remove(0);
    assert_eq!(row.experiment, "parts", "that of its runs, where none is named");
}

#[test]
fn a_variant_may_go_without_its_name_where_it_is_the_only_one() {
    let of = |space: &str, variant: &str, at: f64| {
        let mut runs = runs(space, &[at, at + 1.0], &[None; 2]);
        runs.iter_mut().for_each(|run| run.variant = variant.into());
        runs
    };
    let judged = |against: &str, all: &[RunSummary]| judged(&hypothesis("sampled_return", "above", against, ""), all);
    let mut all = [of("aforce", "", 3.0), of("osc", "draw-1", 1.0)].concat();
    assert_eq!(judged("osc", &all).unwrap()[0].mean_against, Some(1.5));
    all.extend(of("osc", "draw-4", 5.0));
    let error = judged("osc", &all).unwrap_err().to_string();
    assert!(error.contains("osc has variants: name one of osc,draw-1 and osc,draw-4"), "{error}");
    assert_eq!(judged("osc,draw-4", &all).unwrap()[0].mean_against, Some(5.5));
    let only = of("aforce", "draw-1", 1.0);
    let error = judged("aforce,draw-1", &only).unwrap_err().to_string();
    assert!(error.contains("the same runs, aforce,draw-1"), "{error}");
}

#[test]
fn who_never_came_there_has_the_worst_of_it() {
    let judged = |metric: &str, all: &[RunSummary]| judged(&hypothesis(metric, "below", "osc", ""), all);
    let mut all = [runs("aforce", &[0.0; 5], &[None; 5]), runs("osc", &[0.0; 5], &[None; 5])].concat();
    all.iter_mut().for_each(|run| set(run, "sampled_fulfilled_power_w", Cell::Empty));
    all.iter_mut().for_each(|run| set(run, "sampled_success", Cell::Real(0.0)));
    all[5..].iter_mut().for_each(|run| set(run, "sampled_fulfilled_power_w", Cell::Real(9.0)));
    let row = judged("sampled_fulfilled_power_w", &all).unwrap().remove(0);
    assert_eq!((row.verdict, row.above), ("the other way round", Some(1.0)), "it never stood fulfilled");
    let error = judged("cpu_s", &all).unwrap_err().to_string();
    assert!(error.contains("lift aforce 11 has no cpu_s"), "{error}");

    // A run that reached 450 or succeeded does not count as failed if its tables lack a clock or a column, as those of
    // another library do.
    all.iter_mut().for_each(|run| set(run, "steps_to_450", Cell::Count(100)));
    all.iter_mut().for_each(|run| set(run, "cpu_min_to_450", Cell::Empty));
    all.iter_mut().for_each(|run| set(run, "sampled_success", Cell::Real(0.5)));
    all.iter_mut().for_each(|run| set(run, "sampled_energy_to_success_j", Cell::Empty));
    for metric in ["cpu_min_to_450", "sampled_energy_to_success_j"] {
        let error = judged(metric, &all).unwrap_err().to_string();
        assert!(error.contains(&format!("lift aforce 11 has no {metric}")), "{error}");
    }

    // A run whose last policy was not played has neither succeeded nor failed.
    let time = "end_time_to_success_s";
    all.iter_mut().for_each(|run| set(run, "end_success", Cell::Real(0.0)));
    all[5..].iter_mut().for_each(|run| set(run, time, Cell::Real(9.0)));
    all[..5].iter_mut().for_each(|run| set(run, time, Cell::Empty));
    assert_eq!(judged(time, &all).unwrap()[0].verdict, "the other way round");
    all[..5].iter_mut().for_each(|run| set(run, "end_success", Cell::Empty));
    let error = judged(time, &all).unwrap_err().to_string();
    assert!(error.contains("lift aforce 11 has no end_time_to_success_s"), "{error}");
}

#[test]
fn what_is_wrong_is_named() {
    let twice = [runs("aforce", &[1.0], &[None]), runs("aforce", &[1.0], &[None])].concat();
    for (text, word) in [
        (hypothesis("sampled_retrun", "above", "osc", ""), "sampled_retrun"),
        (hypothesis("commit", "above", "osc", ""), "no column of numbers"),
        (hypothesis("sampled_return", "more", "osc", ""), "above"),
        (hypothesis("sampled_return", "above", "osc", "marign = 1"), "marign"),
        (hypothesis("sampled_return", "above", "aforce", ""), "space and against are the same"),
        (hypothesis("sampled_return", "above", "osc", "margin = -3"), "margin = -3.0: must be above 0"),
        (
            hypothesis("sampled_return", "above", "osc", "").replace("['lift']", "['lift', 'lift']"),
            "names the task lift twice",
        ),
        (hypothesis("sampled_return", "above", "osc", ""), "two runs of lift aforce 11: name the experiment"),
    ] {
        let error = format!("{:#}", judged(&text, &twice).unwrap_err());
        assert!(error.contains("hypotheses.toml") && error.contains(word), "{error}");
    }
}

/// Two tasks with one hypothesis each are two families of one hypothesis, or one family of two if it has a name. Hypotheses
/// may also say that they are not pooled.
#[test]
fn hypotheses_of_several_tasks_may_be_one_family() {
    let mut all = vec![];
    for task in ["lift", "door"] {
        let mut of_task =
            [runs("aforce", &[3.0, 4.0, 5.0], &[None; 3]), runs("osc", &[0.0, 1.0, 2.0], &[None; 3])].concat();
        of_task.iter_mut().for_each(|run| run.task = task.into());
        all.extend(of_task);
    }
    let text = hypothesis("sampled_return", "above", "osc", "").replace("['lift']", "['lift', 'door']");
    let corrected = |text: &str| judged(text, &all).unwrap().iter().map(|row| row.p_holm.unwrap()).collect::<Vec<_>>();
    let apart = corrected(&text);
    assert!(apart.iter().all(|p| (p - 0.1).abs() < 1e-12), "{apart:?}");
    let alone = judged(&format!("{text}pooled = false"), &all).unwrap();
    assert!(alone.iter().all(|row| row.stands_alone) && !judged(&text, &all).unwrap()[0].stands_alone);
    let together = corrected(&format!("{text}family = 'both'"));
    assert!(together.iter().all(|p| (p - 0.2).abs() < 1e-12), "{together:?}");
}
