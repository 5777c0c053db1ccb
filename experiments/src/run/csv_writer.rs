//! CSV files that grow row by row and survive a kill.

use std::io::Write;
use std::path::Path;

use anyhow::{Result, bail, ensure};
use fs_err::{File, OpenOptions};
use output::file;
use serde::Serialize;

use crate::run::csv_table::{CsvTable, header};
use crate::run::rows::SCHEMA;

/// A CSV file open for appending; every row is handed to the system as it is written, so that it survives the process.
pub struct CsvWriter {
    /// `None` discards all rows.
    file: Option<File>,
    /// Whether the header is still to be written.
    is_new: bool,
}

impl CsvWriter {
    /// Opens `path`, keeping its rows; a new file gets a header with its first row.
    ///
    /// # Errors
    /// If the file cannot be opened.
    pub fn append(path: &Path) -> Result<Self> {
        let file = OpenOptions::new().create(true).append(true).open(path)?;
        let is_new = file.metadata()?.len() == 0;
        Ok(CsvWriter { file: Some(file), is_new })
    }

    /// A table that discards all rows.
    pub fn discard() -> Self {
        CsvWriter { file: None, is_new: true }
    }

    /// Writes a row, fractions with seven digits.
    ///
    /// # Errors
    /// If the row cannot be written. Then no part of it stays in the file.
    pub fn write(&mut self, row: impl Serialize) -> Result<()> {
        let Some(file) = &mut self.file else { return Ok(()) };
        let mut exact = csv::WriterBuilder::new().has_headers(self.is_new).from_writer(vec![]);
        exact.serialize(row)?;
        let exact = exact.into_inner()?;
        let mut text = csv::Writer::from_writer(vec![]);
        for record in csv::ReaderBuilder::new().has_headers(false).from_reader(exact.as_slice()).records() {
            text.write_record(record?.iter().map(|cell| rounded(cell, DIGITS)))?;
        }
        let before = file.metadata()?.len();
        file.write_all(&text.into_inner()?).inspect_err(|_| drop(file.set_len(before)))?;
        self.is_new = false;
        Ok(())
    }

    /// Waits until every row is on the disk, so that a checkpoint that relies on the rows may be written.
    ///
    /// # Errors
    /// If they cannot be written.
    pub fn sync(&self) -> Result<()> {
        Ok(self.file.as_ref().map_or(Ok(()), File::sync_data)?)
    }
}

/// Significant digits of a fraction in the tables of a run. The simulation of contacts is not more precise than that.
pub const DIGITS: usize = 7;

/// A cell as it is written: a fraction with so many significant `digits`.
pub(crate) fn rounded(cell: &str, digits: usize) -> String {
    match cell.parse::<f64>() {
        Ok(value) if cell.contains(['.', 'e']) && value.is_finite() => {
            let rounded: f64 = format!("{value:.*e}", digits - 1).parse().expect("written just now");
            format!("{rounded:?}")
        }
        _ => cell.into(),
    }
}

/// Checks that rows such as `row` may be appended to `path`: they need the columns and the schema of the table. A new or
/// empty file takes any rows.
///
/// # Errors
/// Names the columns or the schema if they differ.
pub fn takes(path: &Path, row: impl Serialize) -> Result<()> {
    if !path.exists() {
        return Ok(());
    }
    let table = CsvTable::read(path)?;
    let schemas = table.position("schema").map(|at| table.rows.iter().map(move |row| &row[at]));
    if let Some(other) = schemas.and_then(|mut schemas| schemas.find(|schema| *schema != SCHEMA.to_string())) {
        bail!(
            "{}: has schema {other}, this program writes {SCHEMA}: go on with the one that began the run",
            path.display()
        );
    }
    let (there, ours) = (table.headers, header(row));
    let only = |here: &[String], there: &[String]| {
        let names: Vec<&str> = here.iter().filter(|name| !there.contains(name)).map(String::as_str).collect();
        if names.is_empty() { "none".to_string() } else { names.join(", ") }
    };
    let there: Vec<String> = there.iter().map(String::from).collect();
    ensure!(
        there.is_empty() || there == ours,
        "{}: its columns are not those of this program (only there: {}; only here: {}): go on with the program that began the run",
        path.display(),
        only(&there, &ours),
        only(&ours, &there)
    );
    Ok(())
}

/// Cuts off the rows of `path` beyond `step` (and a row that a kill left half-written), so
/// that a resumed run writes them anew. A missing file is left missing.
///
/// # Errors
/// If the file has no `step` column, or cannot be rewritten.
pub fn cut_after(path: &Path, step: u64) -> Result<()> {
    if !path.exists() {
        return Ok(());
    }
    let table = CsvTable::read(path)?;
    if table.headers.is_empty() {
        return Ok(fs_err::write(path, "")?);
    }
    let mut writer = csv::Writer::from_writer(vec![]);
    writer.write_record(&table.headers)?;
    for (row, at) in table.rows.iter().zip(table.steps()?) {
        if at <= step {
            writer.write_record(row)?;
        }
    }
    file::replace(path, &writer.into_inner()?)
}

/// The last step in the table `path`; 0 if it has no rows or does not exist.
///
/// # Errors
/// If the file has no `step` column.
pub fn last_step(path: &Path) -> Result<u64> {
    let steps = if path.exists() { CsvTable::read(path)?.steps()? } else { vec![] };
    Ok(steps.last().copied().unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_beyond_the_step_and_torn_rows_go() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        fs_err::write(&path, "step,x\n1,a\n2,b\n3,c\n4,tor").unwrap();
        cut_after(&path, 2).unwrap();
        assert_eq!(fs_err::read_to_string(&path).unwrap(), "step,x\n1,a\n2,b\n");
        assert_eq!((last_step(&path).unwrap(), last_step(&folder.path().join("b.csv")).unwrap()), (2, 0));
        CsvWriter::append(&path).unwrap().write((3, "d")).unwrap();
        assert_eq!(fs_err::read_to_string(&path).unwrap(), "step,x\n1,a\n2,b\n3,d\n");
    }

    #[test]
    fn rows_of_another_schema_are_not_mixed_with_ours() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        fs_err::write(&path, "schema,step\n1,1\n").unwrap();
        assert!(takes(&path, ()).unwrap_err().to_string().contains("schema 1"));
        assert_eq!(fs_err::read_to_string(&path).unwrap(), "schema,step\n1,1\n");
    }

    #[test]
    fn fractions_have_seven_digits() {
        let cells = ["0.1234567891", "123456.7891", "1.0", "-1e-12", "12345678901", "true", "a.b", ""];
        let written = cells.map(|cell| rounded(cell, DIGITS));
        assert_eq!(written, ["0.1234568", "123456.8", "1.0", "-1e-12", "12345678901", "true", "a.b", ""]);
    }

    #[test]
    fn a_table_has_one_set_of_columns() {
        #[derive(Serialize)]
        struct Row {
            step: u64,
            x: f64,
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        let row = || Row { step: 1, x: 0.5 };
        takes(&path, row()).unwrap();
        fs_err::write(&path, "").unwrap();
        takes(&path, row()).unwrap();
        fs_err::write(&path, "step,x\n1,0.5\n").unwrap();
        takes(&path, row()).unwrap();
        fs_err::write(&path, "step,y\n1,0.5\n").unwrap();
        let error = takes(&path, row()).unwrap_err().to_string();
        assert!(error.contains("a.csv") && error.contains("only there: y; only here: x"), "{error}");
    }
}
