//! A policy by itself: a zip archive with what of a run's folder is needed to play it, which is how `archive` keeps it.

use std::io::{Cursor, Read, Write};
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use output::file;
use zip::write::FileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

/// What lies in it, under the names that it has in the folder.
const FILES: [&str; 4] =
    ["config.toml", "manifest.json", "checkpoints/best/state.json", "checkpoints/best/actor.safetensors"];
/// What archivers may list beside it.
const FOLDERS: [&str; 2] = ["checkpoints/", "checkpoints/best/"];
/// Longest of the files when it is unpacked (bytes).
const LONGEST: u64 = 256 << 20;

/// Whether this is the name of a kept policy.
pub fn is_kept(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "zip") && !path.is_dir()
}

/// Keeps the best policy of the run in `folder` as `archive`, in place of one that is there. The same run gives the same bytes: no file
/// has a time.
///
/// # Errors
/// If the run has no such policy, or the disk does not take it.
pub fn pack(folder: &Path, archive: &Path) -> Result<()> {
    let mut zip = ZipWriter::new(Cursor::new(vec![]));
    for name in FILES {
        let small = FileOptions::default().compression_method(CompressionMethod::Deflated).compression_level(Some(9));
        zip.start_file(name, small.last_modified_time(DateTime::default()))?;
        zip.write_all(&fs_err::read(folder.join(name))?)?;
    }
    file::replace(archive, zip.finish()?.get_ref())
}

/// Writes the files of an archive to the folder `to`.
///
/// # Errors
/// If it is damaged, or has other files.
pub fn unpack(zip: fs_err::File, to: &Path) -> Result<()> {
    let mut zip = ZipArchive::new(zip)?;
    let mut missing = FILES.to_vec();
    for at in 0..zip.len() {
        let mut file = zip.by_index(at)?;
        let name = file.name().to_string();
        if FOLDERS.contains(&name.as_str()) {
            continue;
        }
        // No other name is written to: not one with `..` in it either.
        let Some(place) = missing.iter().position(|wanted| *wanted == name) else {
            bail!("has {name:?}; wanted are {}, each once", FILES.join(", "))
        };
        let path = to.join(missing.swap_remove(place));
        let mut bytes = vec![];
        file.by_ref().take(LONGEST + 1).read_to_end(&mut bytes).with_context(|| name.clone())?;
        ensure!(bytes.len() as u64 <= LONGEST, "{name}: longer than {} MiB", LONGEST >> 20);
        fs_err::create_dir_all(path.parent().expect("below the folder"))?;
        fs_err::write(path, bytes)?;
    }
    ensure!(missing.is_empty(), "has no {}", missing.join(", no "));
    Ok(())
}
