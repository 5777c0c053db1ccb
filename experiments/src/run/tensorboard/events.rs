//! Event files: records of TFRecord framing, each a protocol buffer `Event` with scalars in it.

use std::io::Write;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use anyhow::Result;
use fs_err::File;

/// An event file that grows; every record is handed to the system as it is written.
pub struct EventFile(File);

// Field numbers and wire types of the messages `Event`, `SessionLog`, `Summary` and `Summary.Value`.
const WALL_TIME: u8 = 1 << 3 | 1;
const STEP: u8 = 2 << 3;
const FILE_VERSION: u8 = 3 << 3 | 2;
const SUMMARY: u8 = 5 << 3 | 2;
const SESSION_LOG: u8 = 7 << 3 | 2;
const STATUS: u8 = 1 << 3;
const START: u8 = 1;
const VALUE: u8 = 1 << 3 | 2;
const TAG: u8 = 1 << 3 | 2;
const SIMPLE_VALUE: u8 = 2 << 3 | 5;

impl EventFile {
    /// A new file in `folder` for what happens after `step`: readers forget what earlier files in
    /// the folder say of later steps.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn create(folder: &Path, step: u64) -> Result<Self> {
        // Two starts within a second would have the same name, so the second file's name ends in a number.
        let name = format!("events.out.tfevents.{}.{step}", seconds() as u64);
        let names = std::iter::once(name.clone()).chain((1..).map(|k| format!("{name}.{k}")));
        let path = names.map(|name| folder.join(name)).find(|path| !path.exists()).expect("numbers do not end");
        let mut file = EventFile(File::create(path)?);
        file.record(0, &message(FILE_VERSION, b"brain.Event:2"))?;
        file.record(step + 1, &message(SESSION_LOG, &[STATUS, START]))?;
        Ok(file)
    }

    /// Writes the scalars of one step.
    ///
    /// # Errors
    /// If they cannot be written.
    pub fn write(&mut self, step: u64, scalars: &[(&str, f64)]) -> Result<()> {
        let mut summary = vec![];
        for (tag, value) in scalars {
            let mut scalar = message(TAG, tag.as_bytes());
            scalar.push(SIMPLE_VALUE);
            scalar.extend((*value as f32).to_le_bytes());
            summary.extend(message(VALUE, &scalar));
        }
        self.record(step, &message(SUMMARY, &summary))
    }

    /// Length, its checksum, the event, its checksum.
    fn record(&mut self, step: u64, content: &[u8]) -> Result<()> {
        let mut event = vec![WALL_TIME];
        event.extend(seconds().to_le_bytes());
        event.push(STEP);
        event.extend(varint(step));
        event.extend(content);
        let length = (event.len() as u64).to_le_bytes();
        let sums = [masked_crc(&length).to_le_bytes(), masked_crc(&event).to_le_bytes()];
        self.0.write_all(&[&length[..], &sums[0], &event, &sums[1]].concat())?;
        Ok(())
    }
}

/// Seconds since 1970.
fn seconds() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |time| time.as_secs_f64())
}

/// A field that holds bytes, text or another message.
fn message(key: u8, content: &[u8]) -> Vec<u8> {
    let mut bytes = vec![key];
    bytes.extend(varint(content.len() as u64));
    bytes.extend(content);
    bytes
}

/// Seven bits per byte, the lowest first; the top bit says that more follow.
fn varint(mut value: u64) -> Vec<u8> {
    let mut bytes = vec![];
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
    bytes
}

/// CRC-32C, rotated and shifted as TFRecord asks for.
fn masked_crc(bytes: &[u8]) -> u32 {
    crc32c(bytes).rotate_right(15).wrapping_add(0xa282_ead8)
}

fn crc32c(bytes: &[u8]) -> u32 {
    /// Castagnoli's polynomial, lowest bit first.
    const POLYNOMIAL: u32 = 0x82f6_3b78;
    !bytes.iter().fold(!0, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| crc >> 1 ^ if crc & 1 == 1 { POLYNOMIAL } else { 0 })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksum_and_lengths_follow_their_standards() {
        // The check value of the CRC catalogue, and the example of the protocol buffers' guide.
        assert_eq!(crc32c(b"123456789"), 0xe306_9283);
        assert_eq!(varint(150), [0x96, 0x01]);
        assert_eq!(varint(0), [0]);
    }

    #[test]
    fn a_second_start_within_a_second_leaves_the_first_file() {
        let folder = tempfile::tempdir().unwrap();
        let kept: Vec<EventFile> = (0..3).map(|_| EventFile::create(folder.path(), 7).unwrap()).collect();
        assert_eq!(fs_err::read_dir(folder.path()).unwrap().count(), kept.len());
    }
}
