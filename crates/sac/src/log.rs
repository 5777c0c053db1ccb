//! An append-only log of rows of numbers, in segments, so that a save leaves old segments as they are and writes only what is new.

use std::collections::VecDeque;

use blake3::Hash;

/// Rows in a segment. On average a save writes half a segment of rows that the next save writes again.
pub(crate) const SEGMENT: usize = 1 << 14;

/// Rows of equal width, numbered from the first row ever pushed. The oldest rows may be forgotten, a segment at a time.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Log {
    pub width: usize,
    /// Full segments forgotten so far.
    pub forgotten: usize,
    /// Full segments, oldest first.
    pub segments: VecDeque<Segment>,
    /// The rows after the full segments.
    pub tail: Vec<f32>,
}

/// Rows that do not change any more.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Segment {
    pub numbers: Vec<f32>,
    /// BLAKE3 of the segment's bytes on disk: it tells a save which segments are there already, and a load which are damaged.
    pub hash: Hash,
}

impl Segment {
    pub fn new(numbers: Vec<f32>) -> Self {
        Self { hash: blake3::hash(&bytes(&numbers)), numbers }
    }
}

impl Log {
    pub fn new(width: usize) -> Self {
        Self { width, forgotten: 0, segments: VecDeque::new(), tail: Vec::new() }
    }

    /// Number of rows pushed so far, forgotten ones included.
    pub fn len(&self) -> usize {
        (self.forgotten + self.segments.len()) * SEGMENT + self.tail.len() / self.width
    }

    /// Adds the row that consists of these parts.
    pub fn push(&mut self, parts: &[&[f32]]) {
        parts.iter().for_each(|part| self.tail.extend_from_slice(part));
        if self.tail.len() == SEGMENT * self.width {
            let mut numbers = std::mem::take(&mut self.tail);
            numbers.shrink_to_fit();
            self.segments.push_back(Segment::new(numbers));
        }
    }

    /// Row `index`, counted from the first row ever pushed.
    pub fn row(&self, index: usize) -> &[f32] {
        let (segment, row) = (index / SEGMENT - self.forgotten, index % SEGMENT);
        let numbers = self.segments.get(segment).map_or(&self.tail, |segment| &segment.numbers);
        &numbers[row * self.width..][..self.width]
    }

    /// Forgets the segments that hold no row from `index` on.
    pub fn forget_before(&mut self, index: usize) {
        while (self.forgotten + 1) * SEGMENT <= index && self.segments.pop_front().is_some() {
            self.forgotten += 1;
        }
    }
}

/// The numbers in little endian, as on disk.
pub(crate) fn bytes(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
}
