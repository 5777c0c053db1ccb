//! The book's tables are what the programs say, and its files those of the repository.
//!
//! Between `<!-- made: KIND ... -->` and `<!-- end -->` of a page in `docs` stands what this test makes. It fails if the page
//! says something else; with UPDATE_BOOK=1 it writes the page.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use aforce::ActionSpace;
use tasks::columns::{COLUMNS, Column, Over, RunNumber, Statistic};
use tasks::{Component, Env, EnvConfig, TaskName};

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

fn env(task: &str, space: &str) -> Env {
    let task = TaskName::BUILT_IN.into_iter().find(|known| known.as_str() == task).expect("a task");
    Env::new(EnvConfig { space: space.parse().unwrap(), ..EnvConfig::of(task) }, 0).unwrap()
}

fn table(head: &str, rows: impl IntoIterator<Item = String>) -> String {
    let rule = "|---".repeat(head.matches('|').count() - 1) + "|\n";
    format!("{head}\n{rule}") + &rows.into_iter().map(|row| row + "\n").collect::<String>()
}

fn action(task: &str, space: &str) -> String {
    let env = env(task, space);
    let entries = env.config().space.entries(&env.config().controller);
    let row =
        |e: &aforce::ActionEntry| format!("| `{}` | {:.3} to {:.3} {} | {} |", e.name, e.low, e.high, e.unit, e.frame);
    let gripper = env.task().has_gripper().then(|| "| `gripper` | open, close | its sign counts |".to_string());
    table("| entry | -1 to 1 means | |", entries.iter().map(row).chain(gripper))
}

/// Neighbours whose names differ in what follows the last `_` share a row.
fn observation(task: &str) -> String {
    let mut rows: Vec<(String, Vec<Component>)> = vec![];
    for component in env(task, "aforce").observation_components() {
        let stem = component.name.rsplit_once('_').map_or(component.name.as_str(), |(stem, _)| stem);
        match rows.last_mut() {
            Some((known, parts)) if known == stem && parts[0].unit == component.unit => parts.push(component.clone()),
            _ => rows.push((stem.into(), vec![component.clone()])),
        }
    }
    let row = |(_, parts): &(String, Vec<Component>)| {
        let (first, last) = (&parts[0], parts.last().unwrap());
        let name =
            if parts.len() == 1 { format!("`{}`", first.name) } else { format!("`{}` to `{}`", first.name, last.name) };
        let mut centres: Vec<String> = parts.iter().map(|part| part.centre.to_string()).collect();
        if centres.iter().all(|centre| *centre == centres[0]) {
            centres.truncate(1);
        }
        format!("| {name} | {} | {} | {} |", first.unit, centres.join(", "), first.scale)
    };
    table("| entry | unit | centre | scale |", rows.iter().map(row))
}

/// How Python makes the task, and the shapes that it has there.
fn gymnasium(task: &str, space: &str) -> String {
    let env = env(task, space);
    let config = env.config();
    let (seen, done) = (env.observation_components().len(), env.action_dim());
    let other = if *space == *EnvConfig::default().space.name { String::new() } else { format!(", space=\"{space}\"") };
    let id = format!("aforce/{}{}-v0", task[..1].to_uppercase(), &task[1..]);
    let seconds = config.horizon / config.controller.policy_hz;
    [
        format!("[From Python](python.md): `gym.make(\"{id}\"{other})`, {} actions in {seconds} s.\n", config.horizon),
        format!("- Action: `Box(-1.0, 1.0, ({done},), float32)`"),
        format!("- Observation: `Box(-inf, inf, ({seen},), float32)`; with `scaled=True` -10 to 10\n"),
    ]
    .join("\n")
}

fn reward(task: &str) -> String {
    let names = env(task, "aforce").reward_terms().map(|name| format!("`{name}`")).collect::<Vec<_>>();
    format!("Its terms: {}.\n", names.join(", "))
}

fn record(space: &str) -> String {
    let space: ActionSpace = space.parse().unwrap();
    format!("```toml\n{}\n```\n", space.to_toml().trim_end())
}

/// The columns of the tables of episodes.
fn columns() -> String {
    let row = |c: &Column| format!("| `{}` | {} | {} |", c.name, c.meaning, c.unit);
    table("| column | meaning | unit |", COLUMNS.iter().map(row))
}

/// The numbers that tables of runs make of single columns.
fn run_columns(over: &[Over]) -> String {
    let words = |over| match over {
        Over::Training => "all training episodes",
        Over::Final => "the last evaluations, mean actions",
        Over::Sampled => "the last evaluations, sampled actions",
        Over::End => "the last policy's episodes",
        Over::Baseline => "the episodes",
    };
    let how = |how| match how {
        Statistic::Mean => "mean",
        Statistic::Deviation => "deviation (n - 1)",
        Statistic::Median => "median",
        Statistic::Quantile90 => "90 % quantile",
        Statistic::PerAction => "sum per action",
        Statistic::ShareAbove0 => "share of episodes above 0",
        Statistic::CountAbove0 => "number of episodes above 0",
    };
    let rows = COLUMNS.iter().flat_map(|column| column.of_runs.iter().map(move |number| (column, number)));
    let rows = rows.filter(|(_, number)| over.contains(&number.over));
    let row = |(column, number): (&Column, &RunNumber)| {
        format!("| `{}` | `{}` | {} | {} |", number.name, column.name, how(number.how), words(number.over))
    };
    table("| number | of the column | what | over |", rows.map(row))
}

/// What `train --describe` prints last.
fn follows(space: &str) -> String {
    let text = tasks::Description::of(&env("lift", space)).in_words();
    let (_, derived) = text.rsplit_once("what follows from it").unwrap();
    format!("```text\n{}\n```\n", derived.split_once('\n').unwrap().1.trim_end())
}

/// Rows of a committed table by their columns.
fn rows(name: &str) -> Vec<BTreeMap<String, String>> {
    let mut reader = csv::Reader::from_path(root().join("results").join(name)).unwrap();
    reader.deserialize().map(|row| row.unwrap()).collect()
}

/// What random actions and the script came to in a space, with the paper's action steps.
fn measured(space: &str) -> String {
    let [random, expert] = ["random_paper_steps.csv", "experts_paper_steps.csv"].map(rows);
    let row = |task: TaskName| {
        let of = |rows: &[BTreeMap<String, String>]| {
            rows.iter()
                .find(|row| row["task"] == task.as_str() && row["space"] == space)
                .expect("a measured space")
                .clone()
        };
        let (random, expert) = (of(&random), of(&expert));
        let number = |row: &BTreeMap<String, String>, column: &str, factor: f64, digits: usize| {
            row[column].parse::<f64>().map_or(String::new(), |number| format!("{:.digits$}", factor * number))
        };
        let cells = [
            task.as_str().into(),
            number(&random, "energy_per_action_j", 1.0, 2),
            number(&random, "penalised_action_share", 100.0, 1) + " %",
            number(&random, "saturated_fraction", 100.0, 1) + " %",
            number(&expert, "success_held", 100.0, 0) + " %",
            number(&expert, "time_to_success_s", 1.0, 1),
            number(&expert, "energy_to_success_j", 1.0, 1),
            number(&expert, "max_force_to_success_n", 1.0, 0),
        ];
        format!("| {} |", cells.join(" | "))
    };
    let head = "| `SPACE` | random actions: J per action | above 60 N | torques at their limit | the script: success | after, s | J until then | largest force until then, N |";
    table(&head.replace("SPACE", space), TaskName::ROBOSUITE.map(row))
}

/// A doc comment for a cell of a table, without rustdoc's links.
fn plain(doc: &str) -> String {
    // What stands in brackets leads into the code alone.
    let mut doc = doc.replace('|', "\\|");
    while let Some((before, after)) = doc.split_once(" ([`") {
        let (_, rest) = after.split_once(if after.contains("`](") { "))" } else { "])" }).expect("a link in brackets");
        doc = before.to_string() + rest;
    }
    let mut parts = doc.split("[`");
    let first = parts.next().unwrap().to_string();
    parts.fold(first, |text, part| {
        let (code, rest) = part.split_once("`]").expect("a link to code");
        let rest = if rest.starts_with('(') { rest.split_once(')').unwrap().1 } else { rest };
        format!("{text}`{code}`{rest}")
    })
}

/// Each item of a struct or enum in a source file, below its doc comment: what stands before the last comma, and the comment.
fn items(path: &Path, kind: &str, name: &str) -> Option<Vec<(String, String)>> {
    let text = fs::read_to_string(path).unwrap();
    let (_, body) = text.split_once(&format!("\npub {kind} {name} {{\n"))?;
    let (body, _) = body.split_once("\n}\n").unwrap();
    let (mut items, mut doc) = (vec![], vec![]);
    for line in body.lines().map(str::trim) {
        if let Some(words) = line.strip_prefix("///") {
            doc.push(words.trim());
        } else if let Some(item) = line.strip_suffix(',') {
            items.push((item.to_string(), plain(&doc.join(" "))));
            doc.clear();
        }
    }
    Some(items)
}

/// What a field of this type may be, if the type is an enum of that folder with nothing but names.
fn choices(folder: &Path, kind: &str) -> String {
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_file());
    let Some(items) = files.into_iter().find_map(|path| items(&path, "enum", kind)) else { return String::new() };
    // Of one word, whose name in a file is the word in small letters.
    let word = |name: &str| name.chars().skip(1).all(char::is_lowercase);
    if !items.iter().all(|(name, _)| word(name)) {
        return String::new();
    }
    items.iter().map(|(name, doc)| format!(" `{}`: {doc}", name.to_lowercase())).collect()
}

/// The keys of a section of the configuration, as the struct that holds them describes them. Defaults are those of Lift.
fn settings(path: &str, name: &str, section: &str) -> String {
    let path = root().join(path);
    let defaults = toml::Table::from_iter([("env".to_string(), toml::Value::try_from(EnvConfig::default()).unwrap())]);
    let defaults = section.split('.').try_fold(&toml::Value::from(defaults), |at, key| at.get(key)).cloned();
    let row = |(field, doc): &(String, String)| {
        let (key, kind) = field.strip_prefix("pub ").unwrap().split_once(": ").unwrap();
        let kind = kind.trim_start_matches("Option<").trim_start_matches("Vec<").trim_end_matches('>');
        let meaning = format!("{doc}{}", choices(path.parent().unwrap(), kind));
        let default = match defaults.as_ref().map(|defaults| defaults.get(key)) {
            None => return format!("| `{key}` | {meaning} |"),
            Some(None) => String::new(),
            // Of a record its name, if it has one.
            Some(Some(toml::Value::Table(record))) => {
                record.get("name").map_or(String::new(), |name| format!("`{name}`"))
            }
            Some(Some(value)) => format!("`{value}`"),
        };
        format!("| `{key}` | {default} | {meaning} |")
    };
    let items = items(&path, "struct", name).unwrap_or_else(|| panic!("{}: no {name}", path.display()));
    assert!(items.iter().all(|(_, doc)| !doc.is_empty()), "{}: a setting without a comment", path.display());
    let head = if defaults.is_some() { "| key | default | meaning |" } else { "| key | meaning |" };
    table(head, items.iter().map(row))
}

/// The settings of every preset of the learner.
fn presets() -> String {
    let known = sac::Preset::ALL;
    let settings: Vec<toml::Table> =
        known.iter().map(|preset| toml::Table::try_from(preset.settings()).unwrap()).collect();
    let row = |key: &String| {
        let cells = settings.iter().map(|of_preset| of_preset[key].to_string());
        format!("| `{key}` | {} |", cells.collect::<Vec<_>>().join(" | "))
    };
    let names: Vec<String> = known.iter().map(|preset| format!("`{}`", preset.name)).collect();
    table(&format!("| key | {} |", names.join(" | ")), settings[0].keys().map(row))
}

fn made(kind: &str) -> String {
    match kind.split(' ').collect::<Vec<_>>()[..] {
        ["action", task, space] => action(task, space),
        ["observation", task] => observation(task),
        ["reward", task] => reward(task),
        ["gymnasium", task, space] => gymnasium(task, space),
        ["record", space] => record(space),
        ["follows", space] => follows(space),
        ["settings", path, name, section] => settings(path, name, section),
        ["measured", space] => measured(space),
        ["presets"] => presets(),
        ["columns"] => columns(),
        ["run-columns"] => run_columns(&[Over::Training, Over::Final, Over::Sampled, Over::End]),
        ["baseline-columns"] => run_columns(&[Over::Baseline]),
        ["file", path] => {
            let language = if path.ends_with(".py") { "python" } else { "rust" };
            format!("```{language}\n{}```\n", fs::read_to_string(root().join(path)).unwrap())
        }
        _ => panic!("no such kind: {kind}"),
    }
}

fn pages() -> Vec<PathBuf> {
    let files = fs::read_dir(root().join("docs")).unwrap().map(|entry| entry.unwrap().path());
    let mut pages: Vec<_> = files.filter(|path| path.extension().is_some_and(|e| e == "md")).collect();
    pages.sort();
    pages
}

#[test]
fn what_the_book_says_is_what_the_programs_say() {
    let mut places = 0;
    for page in pages() {
        let text = fs::read_to_string(&page).unwrap();
        let mut parts = text.split("<!-- made: ");
        let mut expected = parts.next().unwrap().to_string();
        for part in parts {
            let (kind, rest) = part.split_once(" -->\n").unwrap();
            let (_, after) = rest.split_once("<!-- end -->").unwrap_or_else(|| panic!("{}: no end", page.display()));
            expected += &format!("<!-- made: {kind} -->\n\n{}\n<!-- end -->{after}", made(kind));
            places += 1;
        }
        if std::env::var_os("UPDATE_BOOK").is_some() {
            fs::write(&page, &expected).unwrap();
        }
        assert!(
            fs::read_to_string(&page).unwrap() == expected,
            "{}: UPDATE_BOOK=1 cargo test --release -p experiments --test book_tables",
            page.display()
        );
    }
    assert!(places > 20, "{places}");
}

/// The page of settings has a table for every part of an environment's configuration that no other page tells.
#[test]
fn every_section_of_the_settings_has_a_table() {
    const ELSEWHERE: [&str; 4] = ["env.space", "env.options", "env.disturbance", "env.controller.interpolation"];
    fn sections(name: &str, value: &toml::Value, found: &mut Vec<String>) {
        let Some(table) = value.as_table().filter(|_| !ELSEWHERE.contains(&name)) else { return };
        found.push(name.into());
        table.iter().for_each(|(key, value)| sections(&format!("{name}.{key}"), value, found));
    }
    let page = fs::read_to_string(root().join("docs/settings.md")).unwrap();
    let mut found = vec!["run".to_string(), "learner".into()];
    sections("env", &toml::Value::try_from(EnvConfig::default()).unwrap(), &mut found);
    assert!(found.len() > 8, "{found:?}");
    for section in found {
        assert!(page.contains(&format!(" {section} -->\n")), "docs/settings.md has no table of {section}");
    }
}

/// Every page is a chapter, and every link to a file leads to one.
#[test]
fn every_page_is_in_the_book_and_every_link_leads_somewhere() {
    let summary = fs::read_to_string(root().join("docs/SUMMARY.md")).unwrap();
    let more = ["README.md", "CONTRIBUTING.md", "results/README.md", "results/gallery/README.md"];
    for page in pages().into_iter().chain(more.map(|name| root().join(name))) {
        let name = page.file_name().unwrap().to_str().unwrap();
        let chapter = page.parent().unwrap().ends_with("docs") && name != "SUMMARY.md";
        assert!(!chapter || summary.contains(&format!("({name})")), "{name} is no chapter");
        let text = fs::read_to_string(&page).unwrap();
        for link in text.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(link, _)| link) {
            let path = link.split('#').next().unwrap();
            // What has a space is code.
            let elsewhere = path.is_empty() || link.contains("://") || link.contains(' ');
            let there = elsewhere || page.parent().unwrap().join(path).exists();
            assert!(there, "{}: {link}", page.display());
        }
    }
}
