//! CSV files that are read back.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use serde::Serialize;

use crate::run::packed;

/// A CSV file in memory.
#[derive(Debug, Clone)]
pub struct CsvTable {
    path: PathBuf,
    /// Names of the columns; none if the file is empty.
    pub headers: csv::StringRecord,
    /// The rows, each as long as `headers`.
    pub rows: Vec<csv::StringRecord>,
}

impl CsvTable {
    /// Reads the complete lines of `path`. A program may still be writing it, or may have been killed within its last line.
    ///
    /// # Errors
    /// If it is missing or not a table.
    pub fn read(path: &Path) -> Result<Self> {
        let text = fs_err::read_to_string(path)?;
        let whole = text.rfind('\n').map_or("", |end| &text[..=end]);
        Self::parse(path, whole).with_context(|| path.display().to_string())
    }

    /// Reads all of `path`, to which no program writes any more; its last line may lack a line end. The file is
    /// compressed if its name ends in `.zst`.
    ///
    /// # Errors
    /// If it is missing or not a table.
    pub fn read_finished(path: &Path) -> Result<Self> {
        Self::parse(path, &packed::text(path)?).with_context(|| path.display().to_string())
    }

    /// A table from its parts.
    pub fn new(path: &Path, headers: csv::StringRecord, rows: Vec<csv::StringRecord>) -> Self {
        CsvTable { path: path.into(), headers, rows }
    }

    /// Parses `text`, the content of the file `path`.
    ///
    /// # Errors
    /// If it is not a table, its columns are not divided by commas, or its first line does not name them.
    pub fn parse(path: &Path, text: &str) -> Result<Self> {
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let headers = reader.headers()?.clone();
        let other =
            headers.get(0).filter(|_| headers.len() == 1).and_then(|name| name.chars().find(|c| ";\t".contains(*c)));
        ensure!(
            other.is_none(),
            "line 1: the columns are divided by {:?}: save the table with commas between them and points in its numbers",
            other.unwrap_or_default()
        );
        let number = headers.iter().find(|name| name.parse::<f64>().is_ok());
        ensure!(
            number.is_none(),
            "line 1: a column is called {:?}: the line with the names of the columns is missing",
            number.unwrap_or_default()
        );
        Ok(CsvTable { path: path.into(), headers, rows: reader.into_records().collect::<csv::Result<_>>()? })
    }

    /// The file from which it was read.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The file and line of a row, for messages. Lines are counted in the file, because the table may have only a part of its rows.
    pub fn place(&self, row: usize) -> String {
        let line = self.rows[row].position().map_or(row as u64 + 2, csv::Position::line);
        format!("{}, line {line}", self.path.display())
    }

    /// The place of a column, if there is one of this name.
    pub fn position(&self, column: &str) -> Option<usize> {
        self.headers.iter().position(|header| header == column)
    }

    /// The cells of a column, from the top; none if the table has no header yet.
    ///
    /// # Errors
    /// If there is no such column.
    pub fn column(&self, column: &str) -> Result<Vec<&str>> {
        if self.headers.is_empty() {
            return Ok(vec![]);
        }
        let at = self.position(column);
        let at = at.with_context(|| format!("{}: no column {column:?}", self.path.display()))?;
        Ok(self.rows.iter().map(|row| &row[at]).collect())
    }

    /// Keeps only the rows that have `value` in `column`. A table without a header stays as it is.
    ///
    /// # Errors
    /// If there is no such column.
    pub fn keep(&mut self, column: &str, value: &str) -> Result<()> {
        let mut fits = self.column(column)?.into_iter().map(|cell| cell == value).collect::<Vec<_>>().into_iter();
        self.rows.retain(|_| fits.next() == Some(true));
        Ok(())
    }

    /// A table for each text in `column`, of the rows that have it; the texts in the order in which they first occur.
    ///
    /// # Errors
    /// If there is no such column.
    pub fn split(self, column: &str) -> Result<Vec<(String, Self)>> {
        let texts: Vec<String> = self.column(column)?.into_iter().map(String::from).collect();
        let mut parts: Vec<(String, Self)> = vec![];
        for (text, row) in texts.into_iter().zip(self.rows) {
            match parts.iter_mut().find(|(other, _)| *other == text) {
                Some((_, part)) => part.rows.push(row),
                None => {
                    let (path, headers) = (self.path.clone(), self.headers.clone());
                    parts.push((text, CsvTable { path, headers, rows: vec![row] }));
                }
            }
        }
        Ok(parts)
    }

    /// The `step` of every row.
    ///
    /// # Errors
    /// If there is no such column, or a cell of it is no number of actions.
    pub fn steps(&self) -> Result<Vec<u64>> {
        let parse = |cell: &str| cell.parse().with_context(|| format!("{}: step {cell:?}", self.path.display()));
        self.column("step")?.into_iter().map(parse).collect()
    }
}

/// The names of the columns of rows such as `row`.
pub fn header(row: impl Serialize) -> Vec<String> {
    let mut writer = csv::Writer::from_writer(vec![]);
    writer.serialize(row).expect("rows are written to memory");
    let text = writer.into_inner().expect("rows are written to memory");
    let mut reader = csv::Reader::from_reader(text.as_slice());
    reader.headers().expect("written just now").iter().map(String::from).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<CsvTable> {
        CsvTable::parse(Path::new("a.csv"), text)
    }

    #[test]
    fn only_a_table_under_way_loses_its_last_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        fs_err::write(&path, "step,x\n1,0.5\n2,0.75").unwrap();
        assert_eq!(CsvTable::read(&path).unwrap().steps().unwrap(), [1]);
        assert_eq!(CsvTable::read_finished(&path).unwrap().steps().unwrap(), [1, 2]);
        fs_err::write(&path, "step,x\n1,0.5\n2").unwrap();
        let told = format!("{:#}", CsvTable::read_finished(&path).unwrap_err());
        assert!(told.contains("a.csv") && told.contains("line: 3"), "{told}");
    }

    /// A byte order mark, other line ends, quotes and empty lines are what spreadsheets add.
    #[test]
    fn what_a_spreadsheet_adds_is_read_and_what_it_changes_is_told() {
        let table = parsed("\u{feff}step,\"x\"\r\n1,\"0.5\"\r\n\r\n").unwrap();
        assert_eq!((table.steps().unwrap(), table.column("x").unwrap()), (vec![1], vec!["0.5"]));
        // Columns in another order, and pandas' numbers of the rows, which have no name.
        for text in ["x,step\n0.5,1\n", ",step,x\n0,1,0.5\n"] {
            let table = parsed(text).unwrap();
            assert_eq!((table.steps().unwrap(), table.column("x").unwrap()), (vec![1], vec!["0.5"]), "{text}");
        }
        for (text, reason) in [
            ("step;x\n1;0,5\n", "divided by ';'"),
            ("step\tx\n1\t0.5\n", "divided by '\\t'"),
            ("1,0.5\n2,0.75\n", "a column is called \"1\""),
        ] {
            let told = parsed(text).unwrap_err().to_string();
            assert!(told.contains("line 1: ") && told.contains(reason), "{told}");
        }
    }
}
