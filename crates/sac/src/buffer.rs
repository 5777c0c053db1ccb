//! Flat memory that both libtorch (matrix products) and plain Rust loops (everything else) work on.

use tch::{Kind, Tensor};

/// A contiguous vector of f32 in main memory, owned by libtorch.
#[derive(Debug)]
pub(crate) struct Buffer(Tensor);

impl Buffer {
    pub fn zeros(len: usize) -> Self {
        Self(Tensor::zeros([len as i64], (Kind::Float, tch::Device::Cpu)))
    }

    pub fn from_slice(values: &[f32]) -> Self {
        let mut buffer = Self::zeros(values.len());
        buffer.copy_from_slice(values);
        buffer
    }

    /// The part from `offset` as a tensor of `shape`. It shares the memory: what is written to either is seen in both. Views
    /// are for matrix products only.
    pub fn view(&self, offset: usize, shape: &[usize]) -> Tensor {
        let length = shape.iter().product::<usize>() as i64;
        let shape: Vec<i64> = shape.iter().map(|&n| n as i64).collect();
        self.0.narrow(0, offset as i64, length).view(shape.as_slice())
    }
}

impl Clone for Buffer {
    fn clone(&self) -> Self {
        Self::from_slice(self)
    }
}

impl std::ops::Deref for Buffer {
    type Target = [f32];

    fn deref(&self) -> &[f32] {
        // SAFETY: the tensor was made by `zeros`: contiguous, f32, main memory, never resized, and kept alive by `self`. Matrix products
        // write through views, but only in calls that take no slice of the buffer they write to, so no slice lives while they run.
        match self.0.numel() {
            // The pointer may be null, which a slice does not allow.
            0 => &[],
            length => unsafe { std::slice::from_raw_parts(self.0.data_ptr().cast(), length) },
        }
    }
}

impl std::ops::DerefMut for Buffer {
    fn deref_mut(&mut self) -> &mut [f32] {
        // SAFETY: as in `deref`, and `&mut self` excludes every other slice.
        match self.0.numel() {
            0 => &mut [],
            length => unsafe { std::slice::from_raw_parts_mut(self.0.data_ptr().cast(), length) },
        }
    }
}

/// A buffer as a row-major matrix, with the views that products take. Views are made once, as libtorch takes half a microsecond to make
/// one.
#[derive(Debug)]
pub(crate) struct Matrix {
    values: Buffer,
    /// `(rows, columns)`.
    pub view: Tensor,
}

impl Matrix {
    pub fn zeros(rows: usize, columns: usize) -> Self {
        let values = Buffer::zeros(rows * columns);
        Self { view: values.view(0, &[rows, columns]), values }
    }

    /// A view of some of the columns.
    pub fn columns(&self, columns: std::ops::Range<usize>) -> Tensor {
        self.view.narrow(1, columns.start as i64, columns.len() as i64)
    }
}

impl std::ops::Deref for Matrix {
    type Target = Buffer;

    fn deref(&self) -> &Buffer {
        &self.values
    }
}

impl std::ops::DerefMut for Matrix {
    fn deref_mut(&mut self) -> &mut Buffer {
        &mut self.values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_buffer_is_an_empty_slice() {
        let mut buffer = Buffer::from_slice(&[]);
        assert!(buffer.is_empty() && buffer.clone().is_empty());
        buffer.fill(1.0);
        assert_eq!((buffer.len(), Buffer::from_slice(&[1.0, 2.0])[1]), (0, 2.0));
    }
}
