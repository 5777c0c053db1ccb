//! The file of a sweep, with what it extends.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use output::program::bad;
use serde::Deserialize;
use settings::{lay_over, parse, robots, setup, spaces};
use toml::{Table, Value};

use crate::config::cli::record;
use crate::config::sweep::group::{Group, is_name, no_identity};

/// The file: groups of runs, and settings that all of them share.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    pub(super) name: Option<String>,
    /// Path, relative to this file, of the sweep that this one extends. Its settings apply below the settings here, of
    /// which a set-up replaces all that a set-up sets; its groups, variants and halving apply if this file has none.
    pub(super) extends: Option<PathBuf>,
    /// Any part of a run's configuration.
    #[serde(default)]
    pub(super) run: Table,
    /// Settings by the variant's name. Every group is run once with each variant, whose settings come on top of the group's.
    pub(super) variants: Option<Table>,
    pub(super) halving: Option<Vec<u64>>,
    #[serde(default)]
    pub(super) group: Vec<Group>,
}

impl File {
    /// Reads the file, laid over the one that it extends. `readers` are the files whose `extends` led here.
    pub(super) fn read(path: &Path, readers: &mut Vec<PathBuf>) -> Result<Self> {
        if !path.exists() {
            return Err(bad(format!("{}: there is no such file", path.display())));
        }
        let here = fs_err::canonicalize(path)?;
        if readers.contains(&here) {
            return Err(bad(format!("{}: extends itself", path.display())));
        }
        readers.push(here);
        let wrong = |problem: String| bad(format!("{}: {problem}", path.display()));
        let mut file: File = parse(&settings::text(path)?).map_err(wrong)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        for space in file.group.iter_mut().flat_map(|group| &mut group.spaces) {
            let named = spaces::of_value(space.clone(), folder);
            *space = record(&named.map_err(|problem| wrong(format!("spaces: {problem:#}")))?);
        }
        file.count_robots_from(folder);
        let Some(base) = &file.extends else { return Ok(file) };
        let base = File::read(&folder.join(base), readers).with_context(|| format!("{}: extends", path.display()))?;
        let mut run = base.run;
        if file.run.contains_key("setup") {
            setup::make_room(&mut run);
        }
        lay_over(&mut run, file.run).map_err(|problem| wrong(format!("run.{problem}")))?;
        let group = if file.group.is_empty() { base.group } else { file.group };
        let (variants, halving) = (file.variants.or(base.variants), file.halving.or(base.halving));
        Ok(File { run, group, variants, halving, ..file })
    }

    /// Resolves the paths of robot files, which are relative to the file that names them.
    fn count_robots_from(&mut self, folder: &Path) {
        let variants = self.variants.iter_mut().flatten().filter_map(|(_, settings)| settings.as_table_mut());
        let groups = self.group.iter_mut();
        let (runs, varied): (Vec<_>, Vec<_>) = groups.map(|group| (&mut group.run, &mut group.vary)).unzip();
        for settings in variants.chain(runs).chain([&mut self.run]) {
            robots::count_from(settings, folder);
        }
        for value in varied.into_iter().filter_map(|vary| vary.get_mut("env.robot")?.as_array_mut()).flatten() {
            if let Value::String(text) = value {
                *text = robots::counted_from(text, folder);
            }
        }
    }

    /// The file's variants in its order; a single one without a name if it has none.
    pub(super) fn variants(&self) -> Result<Vec<Variant>, String> {
        let Some(variants) = self.variants.as_ref().filter(|variants| !variants.is_empty()) else {
            return Ok(vec![Variant::default()]);
        };
        let variant = |(name, settings): (&String, &Value)| {
            is_name(name)?;
            let settings =
                settings.as_table().ok_or_else(|| format!("variants.{name}: a table of settings is needed"))?;
            no_identity(&format!("variants.{name}"), settings)?;
            Ok(Variant { name: name.clone(), settings: settings.clone() })
        };
        variants.iter().map(variant).collect()
    }
}

/// A name and the settings that it stands for.
#[derive(Clone, Default)]
pub(super) struct Variant {
    pub(super) name: String,
    pub(super) settings: Table,
}
