//! Asking memory for what will be needed.

use pulp::Simd;

/// Asks for the cache line in which a value begins, if there is one, because it will be read, or written,
/// soon. A hint: without it nothing changes but the time.
#[inline(always)]
pub fn prefetch<S: Simd, T, const WRITE: bool>(simd: S, value: Option<&T>) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::any::Any;
        use std::arch::x86_64::{_MM_HINT_ET0, _MM_HINT_T0};
        let simd: &dyn Any = &simd;
        let sse = simd
            .downcast_ref()
            .map(|v4: &pulp::x86::V4| v4.sse)
            .or_else(|| simd.downcast_ref().map(|v3: &pulp::x86::V3| v3.sse));
        if let (Some(sse), Some(value)) = (sse, value) {
            let line = std::ptr::from_ref(value).cast();
            if WRITE { sse._mm_prefetch::<_MM_HINT_ET0>(line) } else { sse._mm_prefetch::<_MM_HINT_T0>(line) }
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (simd, value);
}
