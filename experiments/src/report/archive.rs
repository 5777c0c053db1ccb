//! The archive of an experiment: what its runs left, in one compressed file per kind of table.
//!
//! `runs.jsonl.zst` has a line per run: task, space, variant, seed, whether it is done, its `config.toml` and its `manifest.json`.
//! `episodes.csv.zst` and the others have the rows of all runs, each with task, space, variant and seed. `zstdcat`, pandas and
//! polars read them. Fractions have three digits in `episodes.csv.zst`, `eval.csv.zst` and `progress.csv.zst`, and else five; the return of
//! `eval.csv.zst` has seven, the times of `progress.csv.zst` have five.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use output::file;
use serde::{Deserialize, Serialize};

use crate::config::RunId;
use crate::report::record::Record;
use crate::report::table::Table;
use crate::run::csv_table::CsvTable;
use crate::run::csv_writer::rounded;
use crate::run::kept;
use crate::run::manifest::Manifest;
use crate::run::packed;
use crate::run::which::Which;

/// The list of runs; a folder with this file is an archive.
const RUNS: &str = "runs.jsonl.zst";
/// What tells the runs apart in every table.
const KEY: [&str; 4] = ["task", "space", "variant", "seed"];

/// A line of the list.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    task: String,
    space: String,
    variant: String,
    seed: u64,
    done: bool,
    manifest: Manifest,
    config: String,
}

type Key = [String; 4];

/// Whether a folder is an archive.
pub fn is_archive(folder: &Path) -> bool {
    folder.join(RUNS).is_file()
}

/// The runs of the archive `folder`, in its order.
///
/// # Errors
/// If it is damaged, or has rows of a run that it does not list.
pub fn read(folder: &Path) -> Result<Vec<Record>> {
    read_rows(folder, false)
}

/// The runs that an archive lists, so that others can be added. Rows of runs that it does not list are ignored. They are of
/// an `archive` that was interrupted before it wrote the list; the next one writes them again.
///
/// # Errors
/// If it is damaged.
pub fn read_listed(folder: &Path) -> Result<Vec<Record>> {
    read_rows(folder, true)
}

fn read_rows(folder: &Path, listed_alone: bool) -> Result<Vec<Record>> {
    let path = folder.join(RUNS);
    let lines = packed::text(&path)?;
    let lines = lines.lines().map(serde_json::from_str).collect::<Result<Vec<Line>, _>>();
    let lines = lines.with_context(|| path.display().to_string())?;
    let mut tables: HashMap<Key, Vec<(Table, CsvTable)>> = HashMap::new();
    let key = |line: &Line| [line.task.clone(), line.space.clone(), line.variant.clone(), line.seed.to_string()];
    for line in &lines {
        ensure!(tables.insert(key(line), vec![]).is_none(), "{}: lists a run twice: {:?}", path.display(), key(line));
    }
    for table in Table::ALL {
        let path = folder.join(format!("{}.zst", table.file()));
        if !path.exists() {
            continue;
        }
        let all = CsvTable::read_finished(&path)?;
        let places = KEY.map(|column| all.position(column));
        let Some(places) = places.into_iter().collect::<Option<Vec<usize>>>() else {
            bail!("{}: needs the columns {}", path.display(), KEY.join(", "))
        };
        let headers = all.headers;
        for row in all.rows {
            let key: Key = [0, 1, 2, 3].map(|at| row[places[at]].to_string());
            let Some(of_run) = tables.get_mut(&key) else {
                if listed_alone {
                    continue;
                }
                bail!(
                    "{}: has rows of a run that {RUNS} does not list: {key:?}: an `archive` was cut short, give its command again",
                    path.display()
                )
            };
            match of_run.last_mut() {
                Some((kind, part)) if *kind == table => part.rows.push(row),
                _ => of_run.push((table, CsvTable::new(&path, headers.clone(), vec![row]))),
            }
        }
    }
    lines
        .into_iter()
        .map(|line| {
            let mut tables = tables.remove(&key(&line)).expect("one per line");
            // A run that ended before its first row of progress has a table of progress without rows.
            if tables.iter().all(|(table, _)| *table != Table::Progress) {
                let path = folder.join(format!("{}.zst", Table::Progress.file()));
                tables.push((Table::Progress, CsvTable::new(&path, <_>::default(), vec![])));
            }
            let label = crate::config::label(&line.space, &line.variant);
            let place = folder.join(&line.task).join(label).join(format!("seed_{}", line.seed));
            Record::archived(place, line.config, line.manifest, line.done, tables)
        })
        .collect()
}

/// Writes the archive `folder` of `records`.
///
/// # Errors
/// If a table cannot be read, or the archive not be written.
pub fn write(records: &[Record], folder: &Path) -> Result<()> {
    fs_err::create_dir_all(folder)?;
    for table in Table::ALL {
        let mut parts = vec![];
        for record in records {
            if let Some(csv) = record.csv(table)? {
                parts.push(with_key(&csv, &RunId::of(&record.config), table));
            }
        }
        let path = folder.join(format!("{}.zst", table.file()));
        match parts.as_slice() {
            [] if path.exists() => fs_err::remove_file(&path)?,
            [] => {}
            parts => file::replace(&path, &packed::packed(&path, joined(parts)?)?)?,
        }
    }
    // The list comes last: a folder without it is no archive.
    let mut list = vec![];
    for record in records {
        let RunId { task, space, variant, seed } = RunId::of(&record.config);
        let (manifest, config) = (record.manifest.clone(), record.config_text.clone());
        serde_json::to_writer(&mut list, &Line { task, space, variant, seed, done: record.done, manifest, config })?;
        list.push(b'\n');
    }
    let path = folder.join(RUNS);
    file::replace(&path, &packed::packed(&path, list)?)
}

/// Writes the policy of a run to the file `place`: the best one, unless `which` is given. For a run of another archive
/// the policy that the other archive kept is copied.
///
/// # Errors
/// If the run has no such policy, or the file cannot be written.
pub fn keep_policy(record: &Record, which: Option<Which>, place: &Path) -> Result<()> {
    fs_err::create_dir_all(place.parent().unwrap_or(Path::new("")))?;
    let wanted = which.unwrap_or(Which::Best);
    if kept::can_pack(&record.path, wanted) {
        return kept::pack(&record.path, wanted, place);
    }
    file::replace(place, &fs_err::read(kept_with(record))?)
}

/// Whether a policy of the run can be kept: its folder has one, or it comes from another archive that kept the one that is asked for.
pub fn has_policy(record: &Record, which: Option<Which>) -> bool {
    let there = kept_with(record);
    let is_kept = || kept::is_whole(&there) && which.is_none_or(|which| kept::holds(&there, which));
    kept::can_pack(&record.path, which.unwrap_or(Which::Best)) || is_kept()
}

/// Where the archive that a run was read from keeps its policy, if it does.
fn kept_with(record: &Record) -> PathBuf {
    file::with_suffix(&record.path, ".zip")
}

/// The table with the columns that the archive keeps and its number of digits. The columns [`KEY`] follow after `schema`.
fn with_key(csv: &CsvTable, run: &RunId, table: Table) -> CsvTable {
    let values = [run.task.clone(), run.space.clone(), run.variant.clone(), run.seed.to_string()];
    let at = csv.position("schema").map_or(0, |at| at + 1);
    let kept = |column: &str| !KEY.contains(&column) && table.keeps(column);
    let others: Vec<usize> = (0..csv.headers.len()).filter(|&place| kept(&csv.headers[place])).collect();
    let with = |cells: &csv::StringRecord, key: &[&str]| {
        let (before, after): (Vec<usize>, Vec<usize>) = others.iter().partition(|place| **place < at);
        let cell = |place: usize| &cells[place];
        before.into_iter().map(cell).chain(key.iter().copied()).chain(after.into_iter().map(cell)).collect()
    };
    let values = values.each_ref().map(String::as_str);
    let digits: Vec<usize> = csv.headers.iter().map(|column| table.digits(column)).collect();
    let short =
        |row: &csv::StringRecord| row.iter().zip(&digits).map(|(cell, &digits)| rounded(cell, digits)).collect();
    let rows = csv.rows.iter().map(|row| with(&short(row), &values)).collect();
    let headers = with(&csv.headers, &KEY);
    CsvTable::new(csv.path(), headers, rows)
}

/// All rows below each other. A column that a table does not have yet is empty in its rows.
fn joined(parts: &[CsvTable]) -> Result<Vec<u8>> {
    let mut columns: Vec<&str> = vec![];
    for column in parts.iter().flat_map(|part| &part.headers) {
        if !columns.contains(&column) {
            columns.push(column);
        }
    }
    let mut writer = csv::Writer::from_writer(vec![]);
    writer.write_record(&columns)?;
    for part in parts {
        let places: Vec<Option<usize>> = columns.iter().map(|column| part.position(column)).collect();
        for row in &part.rows {
            writer.write_record(places.iter().map(|place| place.map_or("", |at| &row[at])))?;
        }
    }
    Ok(writer.into_inner()?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::summary::RunSummary;
    use crate::report::summary::tests::run;
    use crate::run::folder::RunFolder;

    #[test]
    fn an_archive_says_what_the_folders_said() {
        let root = tempfile::tempdir().unwrap();
        let paths = ["lift/osc/seed_1", "lift/aforce/seed_2"];
        let rows = paths.map(|path| run(root.path(), path, 2.0, 0.0));
        let records = paths.map(|path| Record::of_folder(&RunFolder::at(&root.path().join(path))).unwrap());
        let folder = root.path().join("archive");
        write(&records, &folder).unwrap();
        assert!(is_archive(&folder) && !is_archive(root.path()));
        let again = read(&folder).unwrap();
        for (record, row) in again.iter().zip(&rows) {
            assert_eq!(RunSummary::of(record, &folder).unwrap(), *row);
        }
        let columns = |table: Table| again[0].csv(table).unwrap().unwrap().headers.clone();
        let has = |table: Table, column: &str| columns(table).iter().any(|known| known == column);
        assert!(has(Table::Episodes, "time_to_success_s") && !has(Table::Episodes, "fulfilled_time_s"));
        assert!(has(Table::Eval, "energy_to_success_j") && !has(Table::Episodes, "energy_to_success_j"));
        // Archiving the archive again gives the same bytes.
        let bytes = |folder: &Path| fs_err::read(folder.join("eval.csv.zst")).unwrap();
        let second = root.path().join("second");
        write(&again, &second).unwrap();
        assert_eq!(bytes(&folder), bytes(&second));
        // In the rows of a run that lacks a newer column its cells are empty, and those of the other run stay.
        let table = again[1].csv(Table::Eval).unwrap().unwrap();
        let last = table.headers.len() - 1;
        let cut = |row: &csv::StringRecord| row.iter().take(last).collect::<csv::StringRecord>();
        let earlier = CsvTable::new(table.path(), cut(&table.headers), table.rows.iter().map(cut).collect());
        let text = joined(&[table.clone(), earlier]).unwrap();
        let both = CsvTable::parse(table.path(), std::str::from_utf8(&text).unwrap()).unwrap();
        assert_eq!((&both.headers, both.rows.len()), (&table.headers, 2 * table.rows.len()));
        assert!(
            both.rows[..table.rows.len()] == table.rows
                && both.rows[table.rows.len()..].iter().all(|row| row[last].is_empty())
        );
        // A run that ended before its first row of progress.csv can be summarised from the archive too.
        let progress = RunFolder::at(&root.path().join(paths[0])).progress();
        let header = fs_err::read_to_string(&progress).unwrap().lines().next().unwrap().to_string() + "\n";
        fs_err::write(&progress, header).unwrap();
        write(&records, &second).unwrap();
        assert!(read(&second).unwrap().iter().all(|record| RunSummary::of(record, &second).is_ok()));
        let path = folder.join(RUNS);
        let first = packed::text(&path).unwrap().lines().next().unwrap().as_bytes().to_vec();
        file::replace(&path, &packed::packed(&path, first).unwrap()).unwrap();
        let told = read(&folder).unwrap_err().to_string();
        assert!(told.contains("does not list") && told.contains("aforce"), "{told}");
    }
}
