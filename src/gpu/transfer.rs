//! Uploads to device buffers and downloads from them, each waited for by a fence.

use bytemuck::Pod;

use super::error::GpuError;
use super::lists;
use super::once::Once;
use super::resource::Resource;
use super::store::{Region, Resources};

/// Largest staging copy [bytes]. Longer uploads are split.
const STAGED_AT_MOST: usize = 16 << 20;

impl Resources {
    /// Fills a device buffer with values and waits. It does nothing if the resource has no buffer.
    pub(super) fn upload<T: Pod>(&mut self, once: &mut Once, resource: Resource, values: &[T]) -> Result<(), GpuError> {
        let Some(target) = self.get(resource).cloned() else { return Ok(()) };
        if self.get(Resource::Staged).is_none() {
            self.make(Resource::Staged, STAGED_AT_MOST as u64)?;
        }
        let list = lists::upload(resource);
        let mut offset = target.offset;
        for piece in bytemuck::cast_slice::<T, u8>(values).chunks(STAGED_AT_MOST) {
            self.write(Resource::Staged, 0, piece)?;
            let bytes = piece.len() as u64;
            let mut of_piece = Self::new(&self.context);
            of_piece.lodge(Resource::Staged, self.region(Resource::Staged, 0).clone());
            of_piece.lodge(resource, Region::lodged(&target.buffer, offset, bytes));
            once.run([&list], &of_piece, None, &|_| Vec::new())?;
            offset += bytes;
        }
        Ok(())
    }

    /// Frees the staging buffer.
    pub(super) fn free_staging(&mut self) {
        self.free(Resource::Staged);
    }

    /// Downloads the first values of a device buffer and waits.
    pub(super) fn download<T: Pod>(
        &mut self,
        once: &mut Once,
        resource: Resource,
        count: usize,
    ) -> Result<Vec<T>, GpuError> {
        self.make(Resource::Fetched, (count * size_of::<T>()) as u64)?;
        once.run([&lists::download(resource)], self, None, &|_| Vec::new())?;
        let values = self.read(Resource::Fetched, 0, count).to_vec();
        self.free(Resource::Fetched);
        Ok(values)
    }
}
