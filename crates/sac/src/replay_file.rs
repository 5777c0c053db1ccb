//! The replay memory on disk, in a checkpoint's folder. Each full segment of its two logs is a file that never changes. `replay.bin` holds
//! the rest: the hashes of the segments, the rows after them, the steps that wait for their rewards, and a checksum of the file. Numbers
//! are little endian.
//!
//! A save makes hard links to the segments that the previous checkpoint has, and writes the others.

use std::collections::HashMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use blake3::Hash;
use fs_err as fs;

use crate::log::{SEGMENT, Segment, bytes};
use crate::n_step::Pending;
use crate::{Config, Error, Replay, Sizes, synced_file};

const FILE: &str = "replay.bin";
const MAGIC: &[u8; 8] = b"SACRPLY2";
/// Magic number of an earlier version.
const OLD_MAGIC: &[u8; 8] = b"SACRPLY1";
/// Names of the two logs in file names.
const NAMES: [&str; 2] = ["observations", "transitions"];
const HASH_BYTES: usize = 32;

/// Whether a checkpoint has a replay memory.
pub(crate) fn exists(folder: &Path) -> bool {
    folder.join(FILE).exists()
}

/// The header of `replay.bin`.
struct Head {
    /// Numbers in an observation, numbers in an action, capacity in transitions.
    sizes: [usize; 3],
    /// Of each log: number of segments forgotten, number of full segments, count of numbers after the segments.
    lengths: [[usize; 3]; 2],
    /// Number of steps that wait for their rewards.
    pending: usize,
    /// Hashes of each log's full segments.
    hashes: [Vec<Hash>; 2],
}

impl Head {
    /// Reads the header from the whole content, and returns also what follows it: the numbers and the checksum.
    fn read(content: &[u8]) -> Result<(Self, &[u8]), Error> {
        let mut rest = &content[MAGIC.len()..];
        let (sizes, lengths) = (counts(&mut rest)?, [counts(&mut rest)?, counts(&mut rest)?]);
        let [pending] = counts(&mut rest)?;
        let mut hash = || array(&mut rest).map(Hash::from_bytes);
        let mut hashes = |count| (0..count).map(|_| hash()).collect::<Result<_, Error>>();
        let hashes = [hashes(lengths[0][1])?, hashes(lengths[1][1])?];
        Ok((Self { sizes, lengths, pending, hashes }, rest))
    }
}

/// Checks by magic and checksum that this is a whole `replay.bin`. The error says what is wrong.
fn whole(content: &[u8]) -> Result<(), &'static str> {
    if content.starts_with(OLD_MAGIC) {
        return Err("the replay memory of an earlier version, which this one cannot go on from: begin the run anew");
    }
    if !content.starts_with(MAGIC) {
        return Err("not a replay memory, or cut off");
    }
    let body = content.len().saturating_sub(HASH_BYTES);
    let agrees = blake3::hash(&content[..body]).as_bytes() == &content[body..];
    if agrees { Ok(()) } else { Err("the checksum does not agree: damaged or cut off") }
}

/// Hashes of the segments that a checkpoint has, by their paths; empty if it has no undamaged replay memory.
fn segments_of(folder: &Path) -> HashMap<PathBuf, Hash> {
    let content = fs::read(folder.join(FILE)).unwrap_or_default();
    let head = whole(&content).ok().and_then(|()| Head::read(&content).ok());
    let of_log = |(name, ([forgotten, ..], hashes)): (&'static str, ([usize; 3], Vec<Hash>))| {
        (forgotten..).zip(hashes).map(move |(number, hash)| (segment_path(folder, name, number), hash))
    };
    head.into_iter()
        .flat_map(|(head, _)| NAMES.into_iter().zip(head.lengths.into_iter().zip(head.hashes)).flat_map(of_log))
        .collect()
}

/// Writes `replay` into the new folder of a checkpoint, and waits until it is on the disk. `before` is the checkpoint that the new one will
/// replace.
pub(crate) fn write(folder: &Path, before: &Path, replay: &Replay) -> Result<(), Error> {
    let logs = [&replay.observations, &replay.transitions];
    let there = segments_of(before);
    for (name, log) in NAMES.into_iter().zip(logs) {
        for (number, segment) in (log.forgotten..).zip(&log.segments) {
            let (file, old) = (segment_path(folder, name, number), segment_path(before, name, number));
            let same = there.get(&old) == Some(&segment.hash) && is_long(&old, 4 * segment.numbers.len());
            let linked = same && fs::hard_link(&old, &file).is_ok();
            // Some file systems have no hard links, and a file that was cut off must be written again.
            if !linked {
                synced_file::write(&file, &bytes(&segment.numbers))?;
            }
        }
    }
    let pending = &replay.n_step.pending;
    let lengths = logs.map(|log| [log.forgotten, log.segments.len(), log.tail.len()]);
    let sizes = [replay.whole_observation, replay.action_dim, replay.capacity];
    let counts = [&sizes[..], lengths.as_flattened(), &[pending.len()]].concat();
    let mut out = MAGIC.to_vec();
    out.extend(counts.into_iter().flat_map(|n| (n as u64).to_le_bytes()));
    for segment in logs.into_iter().flat_map(|log| &log.segments) {
        out.extend(segment.hash.as_bytes());
    }
    logs.into_iter().for_each(|log| out.extend(bytes(&log.tail)));
    for step in pending {
        out.extend((step.observation as u64).to_le_bytes());
        out.extend(bytes(&step.action));
        out.extend(bytes(&[step.reward, step.discount]));
    }
    out.extend(blake3::hash(&out).as_bytes());
    synced_file::write(&folder.join(FILE), &out)
}

/// Whether a file has this many bytes.
fn is_long(file: &Path, bytes: usize) -> bool {
    fs::metadata(file).is_ok_and(|there| there.len() == bytes as u64)
}

/// Reads what [`write()`] wrote.
pub(crate) fn read(folder: &Path, config: &Config, sizes: impl Into<Sizes>) -> Result<Replay, Error> {
    let path = folder.join(FILE);
    let content = fs::read(&path)?;
    whole(&content).map_err(|problem| Error::checkpoint(&path, problem))?;
    let (head, mut rest) = Head::read(&content)?;
    let mut replay = Replay::new(config, sizes);
    let expected = [replay.whole_observation, replay.action_dim, replay.capacity];
    if head.sizes != expected {
        let words = |[observations, actions, capacity]: [usize; 3]| {
            format!("{observations} observations, {actions} actions and room for {capacity} transitions")
        };
        let problem = format!("holds {}; {} expected", words(head.sizes), words(expected));
        return Err(Error::checkpoint(&path, problem));
    }
    let logs = [&mut replay.observations, &mut replay.transitions];
    let found = NAMES.into_iter().zip(head.lengths).zip(head.hashes);
    for (log, ((name, [forgotten, _, tail]), hashes)) in logs.into_iter().zip(found) {
        log.forgotten = forgotten;
        for (number, hash) in (forgotten..).zip(hashes) {
            log.segments.push_back(read_segment(&segment_path(folder, name, number), log.width, hash)?);
        }
        log.tail = floats(&mut rest, tail)?;
    }
    for _ in 0..head.pending {
        let [observation] = counts(&mut rest)?;
        let (action, numbers) = (floats(&mut rest, replay.action_dim)?, floats(&mut rest, 2)?);
        let (reward, discount) = (numbers[0], numbers[1]);
        replay.n_step.pending.push_back(Pending { observation, action, reward, discount });
    }
    Ok(replay)
}

fn read_segment(path: &Path, width: usize, hash: Hash) -> Result<Segment, Error> {
    let content = fs::read(path)?;
    if content.len() != 4 * SEGMENT * width {
        let (length, expected) = (content.len(), 4 * SEGMENT * width);
        return Err(Error::checkpoint(path, format!("{length} bytes long, {expected} expected: damaged or cut off")));
    }
    if blake3::hash(&content) != hash {
        return Err(Error::checkpoint(
            path,
            format!("not the part that {FILE} beside it names: damaged, or of another run"),
        ));
    }
    let numbers = floats(&mut content.as_slice(), SEGMENT * width)?;
    Ok(Segment { numbers, hash })
}

fn segment_path(folder: &Path, name: &str, number: usize) -> PathBuf {
    folder.join(format!("replay_{name}_{number:06}.bin"))
}

fn counts<const N: usize>(rest: &mut &[u8]) -> Result<[usize; N], Error> {
    let mut counts = [0; N];
    for count in &mut counts {
        *count = u64::from_le_bytes(array(rest)?) as usize;
    }
    Ok(counts)
}

/// The next `N` bytes. They exist, as the checksum has been compared.
fn array<const N: usize>(rest: &mut &[u8]) -> Result<[u8; N], Error> {
    let mut bytes = [0; N];
    rest.read_exact(&mut bytes)?;
    Ok(bytes)
}

fn floats(rest: &mut &[u8], count: usize) -> Result<Vec<f32>, Error> {
    let missing = || std::io::Error::from(std::io::ErrorKind::UnexpectedEof);
    let (here, after) = rest.split_at_checked(count.saturating_mul(4)).ok_or_else(missing)?;
    *rest = after;
    Ok(here.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect())
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::MetadataExt;

    use super::*;
    use crate::Transition;

    fn config() -> Config {
        Config { replay_capacity: 40_000, n_step: 3, ..Config::default() }
    }

    /// Episodes of 700 steps.
    fn play(replay: &mut Replay, steps: std::ops::Range<usize>) {
        for k in steps {
            let observe = |k: usize| [(k as f32).sin(), k as f32];
            let step = Transition {
                observation: &observe(k),
                action: &[(k as f32).cos()],
                reward: k as f32,
                next_observation: &observe(k + 1),
                terminated: false,
                truncated: k % 700 == 699,
            };
            replay.push(&step).unwrap();
        }
    }

    /// Saves the memory into a checkpoint's folder whose predecessor is `before`.
    fn save(root: &Path, before: &str, replay: &Replay) -> PathBuf {
        let folder = root.join(replay.observations.len().to_string());
        fs::create_dir(&folder).unwrap();
        write(&folder, &root.join(before), replay).unwrap();
        folder
    }

    #[test]
    fn what_is_on_disk_is_not_written_again_and_what_is_forgotten_goes() {
        let root = tempfile::tempdir().unwrap();
        let mut replay = Replay::new(&config(), (2, 1));
        play(&mut replay, 0..35_000);
        let first = save(root.path(), "none", &replay);
        play(&mut replay, 35_000..90_000);
        let second = save(root.path(), first.file_name().unwrap().to_str().unwrap(), &replay);
        let names = |folder: &Path| {
            let mut names: Vec<String> = fs::read_dir(folder)
                .unwrap()
                .map(|file| file.unwrap().file_name().into_string().unwrap())
                .filter(|name| name.contains("transitions"))
                .collect();
            names.sort();
            names
        };
        let numbered = |numbers: std::ops::Range<usize>| {
            numbers.map(|n| format!("replay_transitions_{n:06}.bin")).collect::<Vec<_>>()
        };
        // 35 000 rows fill two segments. 90 000 rows fill five; the first 50 000 are not needed, and the three segments with only such rows
        // are forgotten.
        assert_eq!((names(&first), names(&second)), (numbered(0..2), numbered(3..5)));
        assert_eq!(read(&second, &config(), (2, 1)).unwrap(), replay);

        play(&mut replay, 90_000..91_000);
        let third = save(root.path(), second.file_name().unwrap().to_str().unwrap(), &replay);
        let inode = |folder: &Path, name: &str| fs::metadata(folder.join(name)).unwrap().ino();
        for name in names(&second) {
            assert_eq!(inode(&second, &name), inode(&third, &name), "{name} was written again");
        }
        // After a checkpoint is removed, the next one keeps the segments that the two shared.
        fs::remove_dir_all(&second).unwrap();
        let mut loaded = read(&third, &config(), (2, 1)).unwrap();
        assert_eq!(loaded, replay);
        play(&mut replay, 91_000..99_000);
        play(&mut loaded, 91_000..99_000);
        assert_eq!(loaded, replay);
    }

    #[test]
    fn a_segment_that_is_another_is_neither_shared_nor_read() {
        let root = tempfile::tempdir().unwrap();
        let [mut replay, mut other] = [(); 2].map(|()| Replay::new(&config(), (2, 1)));
        play(&mut replay, 0..20_000);
        play(&mut other, 700..21_400);
        let folder = save(root.path(), "none", &other);
        let folder = save(root.path(), folder.file_name().unwrap().to_str().unwrap(), &replay);
        assert_eq!(read(&folder, &config(), (2, 1)).unwrap(), replay);

        let name = "replay_observations_000000.bin";
        let refused = || read(&folder, &config(), (2, 1)).unwrap_err().to_string();
        let whole = fs::read(folder.join(name)).unwrap();
        let mut flipped = whole.clone();
        flipped[70_000] ^= 1;
        fs::write(folder.join(name), flipped).unwrap();
        assert!(
            refused().ends_with(&format!(
                "{name}: not the part that replay.bin beside it names: damaged, or of another run"
            ))
        );
        fs::write(folder.join(name), &whole[..whole.len() - 1]).unwrap();
        assert!(refused().ends_with("131071 bytes long, 131072 expected: damaged or cut off"), "{}", refused());
        fs::remove_file(folder.join(name)).unwrap();
        assert!(refused().contains(name), "{}", refused());
    }
}
