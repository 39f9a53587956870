//! Uploads to device buffers and downloads from them, each waited for by a fence.

use bytemuck::Pod;

use super::error::GpuError;
use super::lists::{self, FETCHED, STAGED};
use super::once::Once;
use super::resource::Resource;
use super::store::{Region, Resources};

/// Largest staging copy [bytes]. Longer uploads are split.
const STAGED_AT_MOST: usize = 16 << 20;

impl Resources {
    /// Fills a device buffer with values and waits. It does nothing if the resource has no buffer.
    pub(super) fn upload<T: Pod>(
        &mut self,
        once: &mut Once,
        resource: &'static Resource,
        values: &[T],
    ) -> Result<(), GpuError> {
        self.upload_from(once, resource, values, 0)
    }

    /// The same from the element `first` on.
    pub(super) fn upload_from<T: Pod>(
        &mut self,
        once: &mut Once,
        resource: &'static Resource,
        values: &[T],
        first: usize,
    ) -> Result<(), GpuError> {
        let Some(target) = self.get(resource).cloned() else { return Ok(()) };
        if self.get(&STAGED).is_none() {
            self.make(&STAGED, STAGED_AT_MOST as u64)?;
        }
        let list = lists::upload(resource);
        let mut offset = target.offset + (first * size_of::<T>()) as u64;
        for piece in bytemuck::cast_slice::<T, u8>(values).chunks(STAGED_AT_MOST) {
            self.write(&STAGED, 0, piece)?;
            let bytes = piece.len() as u64;
            let mut of_piece = Self::new(&self.context);
            of_piece.lodge(&STAGED, self.region(&STAGED, 0).clone());
            of_piece.lodge(resource, Region::lodged(&target.buffer, offset, bytes));
            once.run([&list], &of_piece, None)?;
            offset += bytes;
        }
        Ok(())
    }

    /// Frees the staging buffer.
    pub(super) fn free_staging(&mut self) {
        self.free(&STAGED);
    }

    /// Downloads the first values of a device buffer and waits.
    pub(super) fn download<T: Pod>(
        &mut self,
        once: &mut Once,
        resource: &'static Resource,
        count: usize,
    ) -> Result<Vec<T>, GpuError> {
        self.make(&FETCHED, (count * size_of::<T>()) as u64)?;
        once.run([&lists::download(resource)], self, None)?;
        let values = self.read(&FETCHED, 0, count).to_vec();
        self.free(&FETCHED);
        Ok(values)
    }
}
