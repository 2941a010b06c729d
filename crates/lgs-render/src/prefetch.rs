//! Asking memory for what will be needed.

use crate::simd::BLOCK;
use pulp::Simd;

/// Values that [`prefetch`] asks for at once.
pub(crate) const PREFETCHED: usize = 8 * BLOCK;

/// Asks for the first [`PREFETCHED`] values, if there are so many, because they will be read, or written, soon. A hint: without it nothing changes but
/// the time.
#[inline(always)]
pub(crate) fn prefetch<S: Simd, const WRITE: bool>(simd: S, values: &[f32]) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::any::Any;
        use std::arch::x86_64::{_MM_HINT_ET0, _MM_HINT_T1};
        let simd: &dyn Any = &simd;
        let sse = simd.downcast_ref().map(|v4: &pulp::x86::V4| v4.sse).or_else(|| simd.downcast_ref().map(|v3: &pulp::x86::V3| v3.sse));
        if let (Some(sse), Some(values)) = (sse, values.first_chunk::<PREFETCHED>()) {
            for line in 0..PREFETCHED / BLOCK {
                let line = values[BLOCK * line..].as_ptr().cast();
                if WRITE { sse._mm_prefetch::<_MM_HINT_ET0>(line) } else { sse._mm_prefetch::<_MM_HINT_T1>(line) }
            }
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (simd, values);
}
