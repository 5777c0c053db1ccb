//! CSV files that grow row by row and survive a kill.

use std::io::Write;
use std::path::Path;

use anyhow::{Context, Result, bail};
use fs_err::OpenOptions;
use output::file;
use serde::Serialize;

use crate::rows::SCHEMA;

/// A CSV file open for appending; every row reaches the disk as it is written.
pub struct Table {
    writer: csv::Writer<Box<dyn Write>>,
}

impl Table {
    /// Opens `path`, keeping its rows; a new file gets a header with its first row.
    ///
    /// # Errors
    /// If the file cannot be opened.
    pub fn append(path: &Path) -> Result<Self> {
        let file = OpenOptions::new().create(true).append(true).open(path)?;
        let is_new = file.metadata()?.len() == 0;
        Ok(Table { writer: csv::WriterBuilder::new().has_headers(is_new).from_writer(Box::new(file)) })
    }

    /// A table that keeps nothing.
    pub fn discard() -> Self {
        Table { writer: csv::Writer::from_writer(Box::new(std::io::sink())) }
    }

    /// Writes a row made of `key` columns and `value` columns.
    ///
    /// # Errors
    /// If the disk does not take it.
    pub fn write(&mut self, row: impl Serialize) -> Result<()> {
        self.writer.serialize(row)?;
        self.writer.flush()?;
        Ok(())
    }
}

/// Cuts off the rows of `path` beyond `step` (and a row that a kill left half-written), so
/// that a resumed run writes them anew. A missing file is left missing.
///
/// # Errors
/// If the file has no `step` column, has rows of another schema, or cannot be rewritten.
pub fn cut_after(path: &Path, step: u64) -> Result<()> {
    if !path.exists() {
        return Ok(());
    }
    let Some(Rows { headers, rows }) = Rows::read(path)? else {
        return Ok(fs_err::write(path, "")?);
    };
    let schema = headers.iter().position(|h| h == "schema");
    let mut writer = csv::Writer::from_writer(vec![]);
    writer.write_record(&headers)?;
    for (at, record) in rows {
        if let Some(other) = schema.map(|i| &record[i]).filter(|schema| *schema != SCHEMA.to_string()) {
            bail!(
                "{}: has schema {other}, this program writes {SCHEMA}: go on with the one that began the run",
                path.display()
            );
        }
        if at <= step {
            writer.write_record(&record)?;
        }
    }
    file::replace(path, &writer.into_inner()?)
}

/// The last step in the table `path`; 0 if it has no rows or does not exist.
///
/// # Errors
/// If the file has no `step` column.
pub fn last_step(path: &Path) -> Result<u64> {
    let rows = if path.exists() { Rows::read(path)? } else { None };
    Ok(rows.and_then(|table| table.rows.last().map(|row| row.0)).unwrap_or(0))
}

/// What is complete of a table: the last line may have been cut by a kill.
struct Rows {
    headers: csv::StringRecord,
    /// Each with its step.
    rows: Vec<(u64, csv::StringRecord)>,
}

impl Rows {
    /// None if not even the header is complete.
    fn read(path: &Path) -> Result<Option<Self>> {
        let text = fs_err::read_to_string(path)?;
        let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(whole_lines(&text).as_bytes());
        let headers = reader.headers()?.clone();
        if headers.is_empty() {
            return Ok(None);
        }
        let column = headers.iter().position(|h| h == "step");
        let column = column.with_context(|| format!("{}: no column \"step\"", path.display()))?;
        let row = |record: csv::Result<csv::StringRecord>| {
            let record = record?;
            let step = record.get(column).unwrap_or_default();
            let step = step.parse().with_context(|| format!("{}: step {step:?}", path.display()))?;
            Ok((step, record))
        };
        Ok(Some(Rows { rows: reader.records().map(row).collect::<Result<_>>()?, headers }))
    }
}

/// A table without the last line, if a kill cut it.
pub(crate) fn whole_lines(text: &str) -> &str {
    text.rfind('\n').map_or("", |end| &text[..=end])
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
        Table::append(&path).unwrap().write((3, "d")).unwrap();
        assert_eq!(fs_err::read_to_string(&path).unwrap(), "step,x\n1,a\n2,b\n3,d\n");
    }

    #[test]
    fn rows_of_another_schema_are_not_mixed_with_ours() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        fs_err::write(&path, "schema,step\n1,1\n").unwrap();
        assert!(cut_after(&path, 2).unwrap_err().to_string().contains("schema 1"));
        assert_eq!(fs_err::read_to_string(&path).unwrap(), "schema,step\n1,1\n");
    }
}
