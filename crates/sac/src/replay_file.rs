//! The replay memory on disk: a header, the rows, the steps that wait for their rewards, and a checksum of it all. Little endian.

use std::io::{BufReader, BufWriter, Read, Write};
use std::path::Path;

use fs_err::File;

use crate::n_step::Pending;
use crate::{Config, Error, Replay};

const MAGIC: &[u8; 8] = b"SACRPLY1";
/// Magic word and six numbers.
const HEADER_BYTES: u64 = 8 + 6 * 8;
const HASH_BYTES: u64 = 32;

/// Writes `replay` to a new file and waits until it is on the disk.
pub(crate) fn write(path: &Path, replay: &Replay) -> Result<(), Error> {
    let mut out =
        Hashing { inner: BufWriter::with_capacity(1 << 20, File::create(path)?), hash: blake3::Hasher::new() };
    let pending = &replay.n_step.pending;
    let header =
        [replay.observation_dim, replay.action_dim, replay.capacity, replay.len(), replay.oldest, pending.len()];
    out.write(MAGIC)?;
    header.iter().try_for_each(|&n| out.write(&(n as u64).to_le_bytes()))?;
    out.write_floats(&replay.rows)?;
    for step in pending {
        out.write_floats(&step.observation)?;
        out.write_floats(&step.action)?;
        out.write_floats(&[step.reward, step.discount])?;
    }
    let Hashing { mut inner, hash } = out;
    inner.write_all(hash.finalize().as_bytes())?;
    inner.flush()?;
    Ok(inner.get_ref().sync_all()?)
}

/// Reads what [`write()`] wrote.
pub(crate) fn read(path: &Path, config: &Config, observation_dim: usize, action_dim: usize) -> Result<Replay, Error> {
    let error = |problem: String| Error::checkpoint(path, problem);
    let file = File::open(path)?;
    let length = file.metadata()?.len();
    let mut input = Hashing { inner: BufReader::with_capacity(1 << 20, file), hash: blake3::Hasher::new() };
    if length < HEADER_BYTES || &input.read::<8>()? != MAGIC {
        return Err(error("not a replay memory, or cut off".into()));
    }
    let mut header = [0; 6];
    for n in &mut header {
        *n = u64::from_le_bytes(input.read()?) as usize;
    }
    let [observations, actions, capacity, len, oldest, pending] = header;
    let mut replay = Replay::new(config, observation_dim, action_dim);
    if (observations, actions, capacity) != (observation_dim, action_dim, replay.capacity) {
        let expected = replay.capacity;
        return Err(error(format!(
            "holds {observations} observations, {actions} actions and room for {capacity} transitions; {observation_dim}, \
             {action_dim} and {expected} expected"
        )));
    }
    // Compared before memory is asked for: a damaged length must not ask for all of it. In u128, which cannot overflow here.
    let floats = len as u128 * replay.width() as u128 + pending as u128 * (observations + actions + 2) as u128;
    let expected = u128::from(HEADER_BYTES + HASH_BYTES) + 4 * floats;
    if u128::from(length) != expected || len > capacity {
        return Err(error(format!("{length} bytes long, {expected} expected: damaged or cut off")));
    }
    replay.oldest = oldest;
    replay.rows = input.read_floats(len * replay.width())?;
    for _ in 0..pending {
        let (observation, action) = (input.read_floats(observations)?, input.read_floats(actions)?);
        let [reward, discount] = [f32::from_le_bytes(input.read()?), f32::from_le_bytes(input.read()?)];
        replay.n_step.pending.push_back(Pending { observation, action, reward, discount });
    }
    let computed = input.hash.finalize();
    if &input.read::<32>()? != computed.as_bytes() {
        return Err(error("the checksum does not agree: damaged".into()));
    }
    Ok(replay)
}

/// Hashes what passes through.
struct Hashing<T> {
    inner: T,
    hash: blake3::Hasher,
}

impl<T: Write> Hashing<T> {
    fn write(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.hash.update(bytes);
        Ok(self.inner.write_all(bytes)?)
    }

    fn write_floats(&mut self, values: &[f32]) -> Result<(), Error> {
        let mut bytes = Vec::new();
        for part in values.chunks(1 << 16) {
            bytes.clear();
            bytes.extend(part.iter().flat_map(|x| x.to_le_bytes()));
            self.write(&bytes)?;
        }
        Ok(())
    }
}

impl<T: Read> Hashing<T> {
    fn read<const N: usize>(&mut self) -> Result<[u8; N], Error> {
        let mut bytes = [0; N];
        self.inner.read_exact(&mut bytes)?;
        self.hash.update(&bytes);
        Ok(bytes)
    }

    fn read_floats(&mut self, count: usize) -> Result<Vec<f32>, Error> {
        let mut values = Vec::with_capacity(count);
        let mut bytes = vec![0; 4 * count.min(1 << 16)];
        while values.len() < count {
            let part = &mut bytes[..4 * (count - values.len()).min(1 << 16)];
            self.inner.read_exact(part)?;
            self.hash.update(part);
            values.extend(part.as_chunks().0.iter().map(|x| f32::from_le_bytes(*x)));
        }
        Ok(values)
    }
}
