//! A run to report on: from the folder that it was trained in, or from the archive of its experiment.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

use crate::config::{RunConfig, RunId};
use crate::report::columns::Columns;
use crate::report::outside;
use crate::report::table::Table;
use crate::run::csv_table::CsvTable;
use crate::run::folder::RunFolder;
use crate::run::manifest::Manifest;
use crate::run::tables::of_run;

/// A run's configuration, manifest and tables.
#[derive(Debug, Clone)]
pub struct Record {
    /// Its folder, `EXPERIMENT/TASK/LABEL/seed_N`; for an archived run `TASK/LABEL/seed_N` below the archive of its experiment.
    pub path: PathBuf,
    /// The text of its `config.toml`.
    pub config_text: String,
    /// The configuration in `config_text`.
    pub config: RunConfig,
    /// The content of its `manifest.json`.
    pub manifest: Manifest,
    /// Whether all its steps are done.
    pub done: bool,
    /// Whether another learner made it ([`outside`]): only its task, space, variant and seed are known, and it may lack any table.
    pub outside: bool,
    tables: Tables,
}

#[derive(Debug, Clone)]
enum Tables {
    /// Files in the run's folder, read when they are asked for because the run may still be going on.
    Folder,
    Archived(Vec<(Table, CsvTable)>),
}

impl Record {
    /// The run in a folder.
    ///
    /// # Errors
    /// If its configuration or its manifest cannot be read.
    pub fn of_folder(folder: &RunFolder) -> Result<Self> {
        Ok(Record {
            path: folder.path().into(),
            config_text: fs_err::read_to_string(folder.config())?,
            config: RunConfig::resolve(Some(&folder.config()), &[])?,
            manifest: folder.manifest()?,
            done: folder.done().exists(),
            outside: false,
            tables: Tables::Folder,
        })
    }

    /// An archived run; `config_text` is what its `config.toml` said.
    ///
    /// # Errors
    /// If `config_text` is not a configuration.
    pub fn archived(
        path: PathBuf,
        config_text: String,
        manifest: Manifest,
        done: bool,
        tables: Vec<(Table, CsvTable)>,
    ) -> Result<Self> {
        let config = RunConfig::of_text(&config_text, &path.join("config.toml"))?;
        Ok(Record { path, config_text, config, manifest, done, outside: false, tables: Tables::Archived(tables) })
    }

    /// The run of another library in a folder.
    ///
    /// # Errors
    /// As [`outside::read`].
    pub fn of_outside(folder: &Path) -> Result<Self> {
        let (config, tables) = outside::read(folder)?;
        let manifest = Manifest::unknown(config.seed);
        let tables = Tables::Archived(tables);
        Ok(Record {
            path: folder.into(),
            config_text: String::new(),
            config,
            manifest,
            done: true,
            outside: true,
            tables,
        })
    }

    /// Where a table lies, for messages. For an archived run this includes its identity, because a file of an archive has
    /// the rows of other runs too.
    pub fn place(&self, table: Table) -> String {
        let file = self.path.join(table.file());
        match &self.tables {
            Tables::Archived(tables) if !self.outside => {
                let packed = tables.iter().find(|(kind, _)| *kind == table).map(|(_, csv)| csv.path());
                format!("{}, {}", packed.unwrap_or(&file).display(), RunId::of(&self.config))
            }
            _ => file.display().to_string(),
        }
    }

    /// This archived run, with the tables that only its run folder, `other`, has, such as one of a policy that was played
    /// after archiving. Also returns which tables were added.
    ///
    /// # Errors
    /// If a table cannot be read.
    pub fn with_tables_of(&self, other: &Record) -> Result<(Self, Vec<Table>)> {
        let (mut tables, mut added) = (vec![], vec![]);
        for table in Table::ALL {
            if let Some(own) = self.csv(table)? {
                tables.push((table, own));
            } else if let Some(theirs) = other.csv(table)? {
                tables.push((table, theirs));
                added.push(table);
            }
        }
        Ok((Record { tables: Tables::Archived(tables), ..self.clone() }, added))
    }

    /// A table, if the run has it.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn csv(&self, table: Table) -> Result<Option<CsvTable>> {
        match &self.tables {
            Tables::Folder => {
                let path = self.path.join(table.file());
                let read = if self.done { CsvTable::read_finished } else { CsvTable::read };
                path.exists().then(|| read(&path)).transpose()
            }
            Tables::Archived(tables) => Ok(tables.iter().find(|(kind, _)| *kind == table).map(|(_, csv)| csv.clone())),
        }
    }

    /// A table as numbers.
    ///
    /// # Errors
    /// If the run does not have the table, or the table has another schema. A table that an outside run lacks is empty.
    pub fn columns(&self, table: Table) -> Result<Columns> {
        let missing = || format!("{}: no such table", self.place(table));
        match self.csv(table)? {
            None if self.outside => Columns::of(CsvTable::new(&self.path.join(table.file()), <_>::default(), vec![])),
            found => Columns::of(found.with_context(missing)?),
        }
    }

    /// The evaluations with `policy`, `mean` or `sampled`, without an unfinished last one.
    ///
    /// # Errors
    /// If they cannot be read.
    pub fn evaluations(&self, policy: &str) -> Result<Columns> {
        self.columns(Table::Eval)?.evaluations(policy, self.config.evaluation_episodes as usize)
    }

    /// Whether the policy that played a table is the run's best, and whether it is its last. It has to be one of them:
    /// a run that was trained further since may have another best and another last policy.
    ///
    /// # Errors
    /// If it is of neither, of another run, or of sampled actions.
    pub fn policies_of(&self, table: Table, played: &Columns) -> Result<[bool; 2]> {
        let path = self.place(table);
        // Not checked in an archive, which has replaced these columns by the run's own.
        if matches!(self.tables, Tables::Folder) {
            self.csv(table)?.map_or(Ok(()), |csv| of_run(&csv, &self.config))?;
        }
        let policies = played.by_text("policy")?;
        ensure!(
            policies.iter().all(|(policy, _)| policy == "mean"),
            "{path}: its episodes are to be of mean actions: evaluate without --sample"
        );
        let played = played.values("step")?;
        let evaluations = self.evaluations("mean")?.mean_by_step("return")?;
        let better = |best: (f64, f64), next: (f64, f64)| if next.1 > best.1 { next } else { best };
        let best = evaluations.iter().copied().reduce(better).map_or(f64::NAN, |evaluation| evaluation.0);
        let last = evaluations.last().map_or(f64::NAN, |evaluation| evaluation.0);
        // The last policy is saved at the end of the last episode, which need not be at the last evaluation.
        let trained = self.csv(Table::Episodes)?.map(|episodes| episodes.steps()).transpose()?.unwrap_or_default();
        let end = trained.last().map_or(last, |&step| step as f64);
        let is = |of: f64| played.iter().all(|&step| step == of);
        // In other tables than `end.csv` the policy of the last evaluation counts as the last, though training may have
        // gone on after it.
        let is_last = is(end) || is(last) && table != Table::End;
        let of = [is(best), is_last];
        ensure!(
            of.contains(&true),
            "{path}: neither of the best policy, which is of action {best}, nor of the last, of action {end}: evaluate again"
        );
        Ok(of)
    }

    /// The path of the experiment: what lies between `root` and the TASK/LABEL/seed_N of the run.
    pub fn experiment(&self, root: &Path) -> String {
        let below = self.path.strip_prefix(root).unwrap_or(&self.path);
        let folders: Vec<_> = below.iter().map(|name| name.to_string_lossy()).collect();
        folders[..folders.len().saturating_sub(3)].join("/")
    }
}
