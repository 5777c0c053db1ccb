//! Named f32 tensors in the safetensors format, which Python opens with one call.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use blake3::Hash;
use fs_err as fs;
use safetensors::tensor::{Dtype, SafeTensors, TensorView};

use crate::Error;
use crate::network::Entry;
use crate::synced_file;

/// Writes groups of entries, each under its name and the group's suffix, and a note about them. Returns the BLAKE3 hash of the file.
pub(crate) fn write_tensors(
    path: &Path,
    groups: &[(&[Entry], &str, &[f32])],
    note: Option<(&str, String)>,
) -> Result<Hash, Error> {
    let note = note.map(|(key, value)| HashMap::from([(key.to_string(), value)]));
    let mut tensors = Vec::new();
    for (entries, suffix, values) in groups {
        for entry in *entries {
            let bytes: Vec<u8> = values[entry.range()].iter().flat_map(|x| x.to_le_bytes()).collect();
            tensors.push((format!("{}{suffix}", entry.name), entry.shape.clone(), bytes));
        }
    }
    let views = tensors.iter().map(|(name, shape, bytes)| {
        (name, TensorView::new(Dtype::F32, shape.clone(), bytes).expect("as many bytes as the shape says"))
    });
    let bytes = safetensors::serialize(views, note).map_err(|e| Error::checkpoint(path, e))?;
    synced_file::write(path, &bytes)?;
    Ok(blake3::hash(&bytes))
}

/// A safetensors file in memory.
pub(crate) struct Tensors {
    pub path: PathBuf,
    bytes: Vec<u8>,
}

impl Tensors {
    pub fn read(path: PathBuf) -> Result<Self, Error> {
        Ok(Self { bytes: fs::read(&path)?, path })
    }

    /// BLAKE3 of the file, in hexadecimal.
    pub fn hash(&self) -> String {
        blake3::hash(&self.bytes).to_hex().to_string()
    }

    /// The note of this name, if there is one.
    pub fn metadata(&self, key: &str) -> Result<Option<String>, Error> {
        let header = SafeTensors::read_metadata(&self.bytes);
        let (_, header) = header.map_err(|e| Error::checkpoint(&self.path, format!("damaged or cut off ({e})")))?;
        Ok(header.metadata().as_ref().and_then(|notes| notes.get(key).cloned()))
    }

    /// The numbers of every entry, each under its name and `suffix`, one after the other. Memory is allocated only after an entry's shape
    /// has been compared with the file's.
    pub fn values(&self, entries: &[Entry], suffix: &str) -> Result<Vec<f32>, Error> {
        let error = |problem: String| Error::checkpoint(&self.path, problem);
        let file = SafeTensors::deserialize(&self.bytes).map_err(|e| error(format!("damaged or cut off ({e})")))?;
        let mut values = Vec::new();
        for entry in entries {
            let name = format!("{}{suffix}", entry.name);
            let tensor = file.tensor(&name).map_err(|_| error(format!("holds no {name}")))?;
            if tensor.shape() != entry.shape || tensor.dtype() != Dtype::F32 {
                let (dtype, shape) = (tensor.dtype(), tensor.shape());
                return Err(error(format!("{name} is {dtype:?} {shape:?}, not F32 {:?}", entry.shape)));
            }
            let numbers = tensor.data().as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes));
            if let Some((index, value)) = numbers.clone().enumerate().find(|(_, value)| !value.is_finite()) {
                return Err(error(format!("{name} holds {value} at {index}: damaged")));
            }
            values.extend(numbers);
        }
        Ok(values)
    }
}
