//! Hand-written text, with figures that come from the runs.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex};

use anyhow::{Context, Result, anyhow, bail};
use minijinja::syntax::SyntaxConfig;
use minijinja::value::{Kwargs, Serde, Value, ValueKind};
use minijinja::{Environment, Error, ErrorKind, UndefinedBehavior};
use serde_json::{Value as Json, json};
use walkdir::WalkDir;

use crate::report::comparison::ComparisonRow;
use crate::report::derived::Derived;
use crate::report::summary::{RunSummary, label};
use crate::run::csv_table::CsvTable;

/// Every file NAME.j2 in or below a folder.
///
/// # Errors
/// If a folder cannot be read.
pub fn find_templates(root: &Path) -> Result<Vec<PathBuf>> {
    let files: Vec<_> = WalkDir::new(root)
        .sort_by_file_name()
        .into_iter()
        .map(|entry| Ok(entry?.into_path()))
        .collect::<Result<_>>()?;
    Ok(files
        .into_iter()
        .filter(|path| path.extension().is_some_and(|extension| extension == "j2") && path.is_file())
        .collect())
}

/// Fills in the template `path` as the text `filled`, in Jinja's language. It knows `runs[EXPERIMENT][TASK][GROUP][COLUMN]`, a column of
/// `runs.csv` as a list over the runs of a group, `comparison[EXPERIMENT][TASK][GROUP][QUANTITY]`, a row of
/// `comparison.csv`, `rows(FILE, COLUMN=VALUE, ...)`, the rows of a `derived` table or any other CSV file (its path counted from the
/// folder of the text, or else of the template) whose columns read so, `cell(FILE, NAME, COLUMN=VALUE, ...)`, a cell of the only such row, and
/// the filters `digits(n)` (of a number, of each in a list, or of a row of `comparison.csv` with its interval) and `percent(n)` (of a share).
/// A text computes nothing: numbers are cells of tables.
///
/// # Errors
/// If it is no template, or asks for files, runs, columns or quantities that do not exist.
pub fn fill(
    path: &Path,
    filled: &Path,
    runs: &[RunSummary],
    comparison: &[ComparisonRow],
    derived: &Derived,
) -> Result<String> {
    let template = fs_err::read_to_string(path)?;
    let folder = |file: &Path| file.parent().map(Path::to_path_buf).context("a file lies in a folder");
    let (here, there) = (folder(filled)?, folder(path)?);
    let mut environment = Environment::new();
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.set_syntax(SyntaxConfig::builder().trim_blocks(true).keep_trailing_newline(true).build()?);
    environment.add_filter("digits", digits);
    environment.add_filter("percent", percent);
    let tables = Arc::new(Mutex::new(derived.clone()));
    let found = move |file: &str, wanted: &Kwargs| {
        let wanted = wanted.args().map(|column| Ok((column, wanted.get::<Value>(column)?.to_string())));
        let wanted = wanted.collect::<Result<Vec<_>, Error>>()?;
        let mut tables = tables.lock().expect("no thread but this one");
        let made = without_parents(&here.join(file));
        let path = if tables.contains_key(&made) || made.exists() { made } else { there.join(file) };
        if !tables.contains_key(&path) {
            tables.insert(path.clone(), CsvTable::read_finished(&path).map_err(problem)?);
        }
        rows(&tables[&path], &wanted).map_err(problem)
    };
    let of_cell = found.clone();
    environment.add_function("rows", move |file: &str, wanted: Kwargs| Ok(Value::from(Serde(found(file, &wanted)?))));
    environment.add_function("cell", move |file: &str, column: &str, wanted: Kwargs| {
        let rows = of_cell(file, &wanted)?;
        let [row] = rows.as_slice() else {
            let wanted = wanted.args().map(|name| Ok(format!("{name} {}", wanted.get::<Value>(name)?)));
            let wanted = wanted.collect::<Result<Vec<_>, Error>>()?.join(", ");
            let with = if wanted.is_empty() { String::new() } else { format!(" with {wanted}") };
            return Err(problem(anyhow!("{file}: {} rows{with}; `cell` needs conditions that leave one", rows.len())));
        };
        let cell = row.get(column).ok_or_else(|| problem(anyhow!("{file}: no column {column}")))?;
        Ok(Value::from(Serde(cell.clone())))
    });
    let known = Serde(json!({ "runs": by_group(runs)?, "comparison": by_space(comparison)? }));
    Ok(environment.render_named_str(&path.display().to_string(), &template, known)?)
}

/// With `a/../b` as `b`: a derived table has no file whose path the system could resolve.
fn without_parents(path: &Path) -> PathBuf {
    let join = |mut so_far: PathBuf, part: Component| {
        if part == Component::ParentDir && so_far.file_name().is_some() {
            so_far.pop();
        } else {
            so_far.push(part);
        }
        so_far
    };
    path.components().fold(PathBuf::new(), join)
}

fn by_group(runs: &[RunSummary]) -> Result<Json> {
    let mut tree = Json::Null;
    for run in runs {
        let group = &mut tree[&run.experiment][&run.task][run.label()];
        for (column, value) in serde_json::to_value(run)?.as_object().context("a row has columns")? {
            match &mut group[column] {
                Json::Array(values) => values.push(value.clone()),
                new => *new = json!([value]),
            }
        }
    }
    Ok(tree)
}

fn by_space(comparison: &[ComparisonRow]) -> Result<Json> {
    let mut tree = Json::Null;
    for row in comparison {
        tree[&row.experiment][&row.task][label(&row.space, &row.variant, &row.preset)][&row.quantity] =
            serde_json::to_value(row)?;
    }
    Ok(tree)
}

/// The rows whose cells read as `wanted` says, each as its cells by column. A cell that reads as a number becomes one.
fn rows(table: &CsvTable, wanted: &[(&str, String)]) -> Result<Vec<BTreeMap<String, Json>>> {
    if let Some((column, _)) = wanted.iter().find(|(column, _)| table.position(column).is_none()) {
        bail!("{}: no column {column}", table.path().display());
    }
    // A commit's hash may have no letters, and stays a text.
    let number =
        |column: &str, text: &str| text.parse::<f64>().ok().filter(|value| column != "commit" && value.is_finite());
    let typed = |column: &str, text: &str| number(column, text).map_or(json!(text), |number| json!(number));
    let is_wanted = |row: &&csv::StringRecord| {
        wanted.iter().all(|(column, text)| table.position(column).is_some_and(|at| row[at] == *text))
    };
    let by_column = |row: &csv::StringRecord| {
        table.headers.iter().zip(row).map(|(column, text)| (column.to_string(), typed(column, text))).collect()
    };
    Ok(table.rows.iter().filter(is_wanted).map(by_column).collect())
}

fn problem(error: anyhow::Error) -> Error {
    Error::new(ErrorKind::InvalidOperation, format!("{error:#}"))
}

/// A share in per cent.
fn percent(share: &Value, digits: usize) -> Result<String, Error> {
    match f64::try_from(share.clone()) {
        Ok(share) => self::digits(&Value::from(100.0 * share), digits),
        Err(_) => Err(problem(anyhow!("percent: a number is needed, not {}", share.kind()))),
    }
}

fn digits(value: &Value, digits: usize) -> Result<String, Error> {
    let problem = |words: String| Err(Error::new(ErrorKind::InvalidOperation, format!("digits: {words}")));
    if digits > 17 {
        return problem(format!("a number has at most 17, not {digits}"));
    }
    if let Ok(number) = f64::try_from(value.clone()) {
        if !number.is_finite() {
            return problem(format!("{number} is no number to show"));
        }
        let text = format!("{number:.digits$}");
        let is_zero = text.trim_start_matches('-').chars().all(|c| matches!(c, '0' | '.'));
        return Ok(if is_zero { text.trim_start_matches('-').into() } else { text });
    }
    match value.kind() {
        ValueKind::Seq => {
            let each: Result<Vec<_>, _> = value.try_iter()?.map(|value| self::digits(&value, digits)).collect();
            Ok(each?.join(", "))
        }
        ValueKind::Map => {
            let of = |name| value.get_attr(name);
            let text = self::digits(&of("value")?, digits)?;
            let (low, high) = (of("ci_low")?, of("ci_high")?);
            if low.is_none() {
                return Ok(text);
            }
            Ok(format!("{text} ({} to {})", self::digits(&low, digits)?, self::digits(&high, digits)?))
        }
        kind => problem(format!("a number is needed, not {kind}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::comparison::comparison;
    use crate::report::groups::{groups, tests::runs};

    fn filled(template: &str) -> Result<String> {
        let mut all = runs("aforce", 5);
        all.extend(runs("osc", 2));
        all.extend(runs("variable", 5));
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("a.md.j2");
        fs_err::write(&path, template)?;
        fs_err::write(folder.path().join("b.csv"), "space,energy_j,commit\nosc,2.5,353933642383\naforce,1.5,e\n")?;
        let made = folder.path().join("made.csv");
        let derived = Derived::from([(made.clone(), CsvTable::parse(&made, "space,mean\nosc,3.5\n")?)]);
        fill(&path, &path.with_extension(""), &all, &comparison(&groups(&all)), &derived)
    }

    #[test]
    fn figures_come_from_the_runs() {
        let text = filled(
            "{% set lift = runs[''].lift %}{{ lift.osc.final_return | digits(1) }}: {{ lift.aforce.seed | join('/') }}\n",
        );
        assert_eq!(text.unwrap(), "60.0, 61.0: 0/1/2/3/4\n");
        let text = filled("{{ cell('b.csv', 'energy_j', space='osc') | percent(1) }}").unwrap();
        assert_eq!(text, "250.0");
        let text = filled(
            "{% for space in ['osc', 'variable'] -%}
             {{ comparison[''].lift[space]['probability that reference ends higher'] | digits(2) }};
             {%- endfor %}",
        );
        let text = text.unwrap();
        assert!(text.starts_with("0.80;0.50 (0.") && text.ends_with(");"), "of two seeds no interval: {text}");
        let text =
            filled("{{ rows('b.csv', space='aforce')[0].energy_j + 1 }}, {{ rows('b.csv', energy_j=2.5)[0].commit }}");
        assert_eq!(text.unwrap(), "2.5, 353933642383");
        for name in ["made.csv", "below/../made.csv"] {
            let text = filled(&format!("{{{{ cell('{name}', 'mean', space='osc') }}}}"));
            assert_eq!(text.unwrap(), "3.5");
        }
    }

    #[test]
    fn what_is_not_there_is_named_with_its_line() {
        for (template, hint) in [
            ("a\n{{ runs[''].wipe.osc.final_return | digits(1) }}", "a.md.j2:2"),
            ("{{ cell('b.csv', 'energy_j') | digits(1) }}", "b.csv: 2 rows; `cell` needs conditions that leave one"),
            ("{{ cell('b.csv', 'energy', space='osc') | digits(1) }}", "b.csv: no column energy"),
            ("{{ 'x' | percent(1) }}", "a number is needed, not string"),
            ("{{ [1, 2] | mean }}", "unknown filter"),
            ("{{ runs[''].lift.osc.energy | digits(1) }}", "a.md.j2:1"),
            ("{{ runs[''].lift.osc.steps_to_450 | digits(1) }}", "a number is needed, not none"),
            ("\n\n{{ runs", "syntax error"),
            ("{{ 1.5 | digits(100000) }}", "a number has at most 17"),
            ("{{ rows('c.csv') }}", "c.csv"),
            ("{{ rows('b.csv', seed=1) }}", "no column seed"),
        ] {
            let error = filled(template).unwrap_err().to_string();
            assert!(error.contains("a.md.j2:") && error.contains(hint), "{error}");
        }
    }
}
