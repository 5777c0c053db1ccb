//! A kept policy: a zip file with those files of a run's folder that are needed to play the policy. `archive` writes it.

use std::io::{Cursor, Read, Write};
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use output::file;
use zip::write::FileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

use crate::run::which::Which;

/// Maximum size of an unpacked file (bytes).
const LONGEST: u64 = 256 << 20;

/// Folder of a checkpoint, as archivers list it.
fn folder_of(which: Which) -> String {
    format!("checkpoints/{}/", which.name())
}

/// What lies in the archive, under the names that it has in the run's folder.
fn files(which: Which) -> [String; 4] {
    let folder = folder_of(which);
    ["config.toml".into(), "manifest.json".into(), folder.clone() + "state.json", folder + "actor.safetensors"]
}

/// Whether this is the name of a kept policy.
pub fn is_kept(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "zip") && !path.is_dir()
}

/// Writes a policy of the run in `folder` to `archive`, and replaces an existing file. The files in it have no time, so
/// that the same run gives the same bytes.
///
/// # Errors
/// If the run has no such policy, or the file cannot be written.
pub fn pack(folder: &Path, which: Which, archive: &Path) -> Result<()> {
    let mut zip = ZipWriter::new(Cursor::new(vec![]));
    for name in files(which) {
        let small = FileOptions::default().compression_method(CompressionMethod::Deflated).compression_level(Some(9));
        zip.start_file(&name, small.last_modified_time(DateTime::default()))?;
        zip.write_all(&fs_err::read(folder.join(name))?)?;
    }
    file::replace(archive, zip.finish()?.get_ref())
}

/// Whether a run's folder has all that [`pack`] takes.
pub fn can_pack(folder: &Path, which: Which) -> bool {
    files(which).iter().all(|name| folder.join(name).is_file())
}

/// Whether every file of `archive` can be read.
pub fn is_whole(archive: &Path) -> bool {
    let read = || -> Result<()> {
        let mut zip = ZipArchive::new(fs_err::File::open(archive)?)?;
        for name in files(held(&zip)) {
            std::io::copy(&mut zip.by_name(&name)?, &mut std::io::sink())?;
        }
        Ok(())
    };
    read().is_ok()
}

/// Whether `archive` holds the checkpoint `which`; a damaged archive holds none.
pub fn holds(archive: &Path, which: Which) -> bool {
    let zip = fs_err::File::open(archive).ok().and_then(|file| ZipArchive::new(file).ok());
    zip.is_some_and(|zip| held(&zip) == which)
}

/// Which checkpoint is in an archive.
fn held(zip: &ZipArchive<fs_err::File>) -> Which {
    let has = |which| zip.file_names().any(|name| name.starts_with(&folder_of(which)));
    if has(Which::Last) && !has(Which::Best) { Which::Last } else { Which::Best }
}

/// Writes the files of an archive to the folder `to`. Returns which checkpoint it holds.
///
/// # Errors
/// If it is damaged, or has other files.
pub fn unpack(zip: fs_err::File, to: &Path) -> Result<Which> {
    let mut zip = ZipArchive::new(zip)?;
    let which = held(&zip);
    let (wanted, folders) = (files(which), ["checkpoints/".into(), folder_of(which)]);
    let mut missing = wanted.to_vec();
    for at in 0..zip.len() {
        let mut file = zip.by_index(at)?;
        let name = file.name().to_string();
        if folders.contains(&name) {
            continue;
        }
        // Only the wanted names are written, so that a name with `..` cannot leave the folder.
        let Some(place) = missing.iter().position(|wanted| *wanted == name) else {
            bail!("has {name:?}; wanted are {}, each once", wanted.join(", "))
        };
        let path = to.join(missing.swap_remove(place));
        let mut bytes = vec![];
        file.by_ref().take(LONGEST + 1).read_to_end(&mut bytes).with_context(|| name.clone())?;
        ensure!(bytes.len() as u64 <= LONGEST, "{name}: longer than {} MiB", LONGEST >> 20);
        fs_err::create_dir_all(path.parent().expect("below the folder"))?;
        fs_err::write(path, bytes)?;
    }
    ensure!(missing.is_empty(), "has no {}", missing.join(", no "));
    Ok(which)
}
