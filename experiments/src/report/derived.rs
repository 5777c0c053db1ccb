//! Tables computed from other tables, for pages: statistics of groups of rows, and their comparison with a reference group.

use std::collections::{BTreeMap, HashMap};
use std::path::{Component, Path, PathBuf};

use anyhow::{Context, Result};
use output::program::bad;
use output::statistics::{deviation, mean, median, range};
use serde::Deserialize;
use settings::parse;
use walkdir::WalkDir;

use crate::report::columns::number;
use crate::run::csv_table::CsvTable;

/// The name of a file that asks for such tables.
const FILE: &str = "derived.toml";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    table: Vec<Wanted>,
}

/// A table: a row per combination of `by` and column of `of`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Wanted {
    name: PathBuf,
    /// CSV files, their rows below each other; later tables may be made of earlier ones.
    from: Vec<PathBuf>,
    /// The rows that count, by column and cell. A text that ends in `*` stands for all cells that begin with it.
    #[serde(default)]
    only: BTreeMap<String, String>,
    by: Vec<String>,
    /// A column of numbers, none of them empty: each group is divided into its four quarters, which then have `quarter` after `by`, 1 the lowest.
    quarters: Option<String>,
    of: Vec<String>,
    /// The number of rows at the end of each group that count; all, unless said.
    last: Option<usize>,
    /// Values of some of the columns `by`: each group is compared with the group that has these, and else its own values.
    reference: Option<BTreeMap<String, String>>,
}

/// Tables, each by the path at which a page beside its `derived.toml` finds it. They are not written: a page shows what it takes from them.
pub type Derived = HashMap<PathBuf, CsvTable>;

/// The tables that every `derived.toml` in or below `root` asks for, as if they lay in `out`, which may have newer tables than `root`.
///
/// # Errors
/// If a folder cannot be read, a file is not understood, or a table lacks a column or holds no numbers there.
pub fn derived(root: &Path, out: &Path) -> Result<Derived> {
    let mut made = Derived::new();
    for entry in WalkDir::new(root).sort_by_file_name() {
        let path = entry?.into_path();
        if path.file_name().is_some_and(|name| name == FILE) {
            let beside = path.parent().context("a file lies in a folder")?;
            make(&path, &out.join(beside.strip_prefix(root)?), &mut made)?;
        }
    }
    Ok(made)
}

/// Adds the tables of the file `path` to `made`, for the pages in the folder `out`. Their source files are looked for in
/// `out`, and else beside `path`.
fn make(path: &Path, out: &Path, made: &mut Derived) -> Result<()> {
    let wrong = |problem: String| bad(format!("{}: {problem}", path.display()));
    let File { table: wanted } = parse(&settings::text(path)?).map_err(wrong)?;
    let beside = path.parent().context("a file lies in a folder")?;
    for table in &wanted {
        let find = |name: &PathBuf| match made.get(&out.join(name)) {
            Some(earlier) => Ok(earlier.clone()),
            None => CsvTable::read_finished(
                &Some(out.join(name)).filter(|there| there.exists()).unwrap_or(beside.join(name)),
            ),
        };
        if table.quarters.is_some() && table.reference.is_some() {
            return Err(wrong(format!("{}: quarters and a reference do not go together", table.name.display())));
        }
        if let Some(key) = table.reference.iter().flat_map(BTreeMap::keys).find(|key| !table.by.contains(key)) {
            return Err(wrong(format!(
                "{}: reference.{key} is no column of by: {}",
                table.name.display(),
                table.by.join(", ")
            )));
        }
        let stays = table.name.components().all(|part| matches!(part, Component::Normal(_)));
        if !stays || table.from.contains(&table.name) {
            return Err(wrong(format!(
                "{}: a table is made below its own folder, and not in the place of one that it is made of",
                table.name.display()
            )));
        }
        let rows = table.rows(find).with_context(|| format!("{}: {}", path.display(), table.name.display()))?;
        let target = out.join(&table.name);
        let summed_up = table.summed_up(&rows)?;
        made.insert(target.clone(), CsvTable::parse(&target, &summed_up)?);
    }
    Ok(())
}

/// The columns after those of `by`.
const STATISTICS: [&str; 7] = ["metric", "n", "mean", "std", "lowest", "highest", "median"];

/// A group's values of `by`, and its numbers in each of `of`.
type Summed = (Vec<String>, Vec<Vec<f64>>);

impl Wanted {
    /// The groups, in the order of their first rows.
    fn rows(&self, find: impl Fn(&PathBuf) -> Result<CsvTable>) -> Result<Vec<Summed>> {
        let mut groups: Vec<Summed> = vec![];
        for name in &self.from {
            let table = find(name)?;
            let column = |column: &String| table.column(column);
            let by = self.by.iter().map(column).collect::<Result<Vec<_>>>()?;
            let numbers: Vec<&String> = self.of.iter().chain(&self.quarters).collect();
            let of = numbers.iter().map(|name| column(name)).collect::<Result<Vec<_>>>()?;
            let only = self.only.keys().map(column).collect::<Result<Vec<_>>>()?;
            for row in 0..table.rows.len() {
                if only.iter().zip(self.only.values()).any(|(cells, wanted)| !is_wanted(cells[row], wanted)) {
                    continue;
                }
                let key: Vec<String> = by.iter().map(|cells| cells[row].to_string()).collect();
                let at = groups.iter().position(|(known, _)| *known == key).unwrap_or_else(|| {
                    groups.push((key, vec![vec![]; numbers.len()]));
                    groups.len() - 1
                });
                for (values, (cells, name)) in groups[at].1.iter_mut().zip(of.iter().zip(&numbers)) {
                    let told = number(cells[row]);
                    let line = || {
                        format!("{}, row {}: {name} is {:?}, not a number", table.path().display(), row + 1, cells[row])
                    };
                    values.push(told.with_context(line)?);
                }
            }
        }
        if let Some(column) = &self.quarters {
            let divided: Option<Vec<_>> = groups.into_iter().map(quarters).collect();
            groups = divided.with_context(|| format!("quarters: a {column} is empty"))?.concat();
        }
        for values in groups.iter_mut().flat_map(|(_, columns)| columns) {
            let first = self.last.map_or(0, |last| values.len().saturating_sub(last));
            values.drain(..first);
            values.retain(|value| !value.is_nan());
        }
        Ok(groups)
    }

    fn summed_up(&self, groups: &[Summed]) -> Result<String> {
        let mut writer = csv::Writer::from_writer(vec![]);
        let beside = ["over_reference", "minus_reference", "excess_share", "apart"];
        let beside = if self.reference.is_some() { &beside[..] } else { &[] };
        let quarter = self.quarters.as_ref().map(|_| "quarter");
        writer.write_record(
            self.by.iter().map(String::as_str).chain(quarter).chain(STATISTICS).chain(beside.iter().copied()),
        )?;
        let cell = |value: f64| if value.is_finite() { value.to_string() } else { String::new() };
        for (key, columns) in groups {
            let reference = self.reference_of(key, groups)?;
            for (at, (metric, values)) in self.of.iter().zip(columns).enumerate() {
                let [low, high] = range(values);
                let mut row = key.clone();
                row.extend([metric.clone(), values.len().to_string()]);
                row.extend([mean(values), deviation(values), low, high, median(values)].map(cell));
                if let Some(others) = reference.map(|(_, columns)| &columns[at]) {
                    let over = mean(values) / mean(others);
                    row.extend([over, mean(values) - mean(others), over - 1.0].map(cell));
                    let [other_low, other_high] = range(others);
                    let apart = (low > other_high || high < other_low).to_string();
                    row.push(if values.is_empty() || others.is_empty() { String::new() } else { apart });
                }
                writer.write_record(&row)?;
            }
        }
        Ok(String::from_utf8(writer.into_inner()?)?)
    }

    /// The group with which the group `key` is compared, if the file asks for a comparison.
    fn reference_of<'a>(&self, key: &[String], groups: &'a [Summed]) -> Result<Option<&'a Summed>> {
        let Some(reference) = &self.reference else { return Ok(None) };
        let named = |(name, own): (&String, &String)| reference.get(name).unwrap_or(own).clone();
        let wanted: Vec<String> = self.by.iter().zip(key).map(named).collect();
        let found = groups.iter().find(|(key, _)| *key == wanted);
        Ok(Some(found.with_context(|| format!("no row with {}", wanted.join(", ")))?))
    }
}

/// Whether a row with this cell counts.
fn is_wanted(cell: &str, wanted: &str) -> bool {
    wanted.strip_suffix('*').map_or(cell == wanted, |start| cell.starts_with(start))
}

/// A group divided into quarters of its last column, which is left out; rows with the same number stay together. `None`
/// if a row has no number there.
fn quarters((key, mut columns): Summed) -> Option<Vec<Summed>> {
    let by = columns.pop()?;
    let below = |value: &f64| by.iter().filter(|other| *other < value).count();
    let quarter: Vec<usize> = by.iter().map(|value| 4 * below(value) / by.len() + 1).collect();
    let of = |wanted: usize| {
        let key = key.iter().cloned().chain([wanted.to_string()]).collect();
        let rows = |values: &Vec<f64>| {
            let pairs = values.iter().zip(&quarter);
            pairs.filter(|(_, own)| **own == wanted).map(|(value, _)| *value).collect()
        };
        (key, columns.iter().map(rows).collect())
    };
    by.iter().all(|value| !value.is_nan()).then(|| (1..=4).map(of).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rows of the table that `wanted` asks for, cells divided by commas.
    fn made(wanted: &str, tables: &[(&str, &str)]) -> Result<Vec<String>> {
        let folder = tempfile::tempdir()?;
        for (name, text) in tables {
            fs_err::write(folder.path().join(name), text)?;
        }
        fs_err::write(folder.path().join(FILE), format!("[[table]]\nname = 'made.csv'\n{wanted}"))?;
        let out = folder.path().join("out");
        let all = derived(folder.path(), &out)?;
        assert!(!out.exists());
        Ok(all[&out.join("made.csv")].rows.iter().map(|row| row.iter().collect::<Vec<_>>().join(",")).collect())
    }

    const TABLE: &str =
        "task,space,energy_j,done\nlift,low,3,true\nlift,aforce,1,true\nlift,low,5,false\nlift,low,,true\n";

    #[test]
    fn groups_are_summed_up_and_held_against_their_reference() {
        let wanted = "from = ['a.csv']\nby = ['task', 'space']\nof = ['energy_j']\nreference = { space = 'aforce' }";
        let rows = made(wanted, &[("a.csv", TABLE)]).unwrap();
        assert_eq!(rows[0], "lift,low,energy_j,2,4,1.4142135623730951,3,5,4,4,3,3,true");
        assert_eq!(rows[1], "lift,aforce,energy_j,1,1,,1,1,1,1,0,0,false");
        let wanted = "from = ['a.csv']\nby = ['space']\nof = ['done']\nlast = 2\nonly = { space = 'low' }";
        assert_eq!(made(wanted, &[("a.csv", TABLE)]).unwrap()[0], "low,done,2,0.5,0.7071067811865476,0,1,0.5");
        // The differences of a group without numbers from its reference are empty.
        let wanted = "from = ['a.csv']\nby = ['space']\nof = ['energy_j']\nreference = { space = 'aforce' }";
        assert_eq!(
            made(wanted, &[("a.csv", "space,energy_j\nlow,\naforce,1\n")]).unwrap()[0],
            "low,energy_j,0,,,,,,,,,"
        );
    }

    #[test]
    fn a_group_is_divided_into_quarters_of_a_column() {
        let table = "variant,k,energy_j\na1,10,1\na2,10,2\nb,20,3\na3,30,5\na4,5,8\na5,40,6\na6,7,4\na7,8,9\na8,9,7\n";
        let wanted = "from = ['a.csv']\nby = []\nquarters = 'k'\nof = ['energy_j']\nonly = { variant = 'a*' }";
        // By k: 5 and 7, 8 and 9, twice 10, 30 and 40.
        let rows = made(wanted, &[("a.csv", table)]).unwrap();
        let means: Vec<String> = rows.iter().map(|row| row.split(',').take(4).collect::<Vec<_>>().join(",")).collect();
        assert_eq!(means, ["1,energy_j,2,6", "2,energy_j,2,8", "3,energy_j,2,1.5", "4,energy_j,2,5.5"]);
        let empty = table.replace("30", "");
        assert!(format!("{:#}", made(wanted, &[("a.csv", &empty)]).unwrap_err()).contains("a k is empty"));
    }

    #[test]
    fn a_table_is_made_of_an_earlier_one_and_of_newer_files() {
        let [root, out] = [(); 2].map(|()| tempfile::tempdir().unwrap());
        let wanted = "[[table]]\nname = 'first.csv'\nfrom = ['a.csv']\nby = ['task', 'space']\nof = ['energy_j']\n
            [[table]]\nname = 'second.csv'\nfrom = ['first.csv']\nby = ['task']\nof = ['mean']";
        fs_err::create_dir(root.path().join("below")).unwrap();
        fs_err::write(root.path().join("below").join(FILE), wanted).unwrap();
        fs_err::write(root.path().join("below/a.csv"), TABLE).unwrap();
        let second = || derived(root.path(), out.path()).unwrap()[&out.path().join("below/second.csv")].rows[0].clone();
        assert_eq!(second().iter().take(4).collect::<Vec<_>>(), ["lift", "mean", "2", "2.5"]);
        fs_err::create_dir(out.path().join("below")).unwrap();
        fs_err::write(out.path().join("below/a.csv"), "task,space,energy_j\nlift,low,7\n").unwrap();
        assert_eq!(second().iter().take(4).collect::<Vec<_>>(), ["lift", "mean", "1", "7"]);
    }

    #[test]
    fn what_is_missing_is_named() {
        for (wanted, reason) in [
            ("from = ['b.csv']\nby = []\nof = []", "b.csv"),
            ("from = ['a.csv']\nby = ['speed']\nof = []", "no column \"speed\""),
            ("from = ['a.csv']\nby = ['task']\nof = ['space']", "a.csv, row 1: space is \"low\", not a number"),
            ("from = ['a.csv']\nby = ['space']\nof = []\nreference = { space = 'osc' }", "no row with osc"),
            (
                "from = ['a.csv']\nby = ['task', 'space']\nof = []\nreference = { spcae = 'aforce' }",
                "made.csv: reference.spcae is no column of by: task, space",
            ),
            ("form = ['a.csv']", "form"),
            ("from = ['made.csv']\nby = []\nof = []", "made.csv: a table is made below its own folder"),
        ] {
            let told = format!("{:#}", made(wanted, &[("a.csv", TABLE)]).unwrap_err());
            assert!(told.contains(reason), "{told}");
        }
    }
}
