//! Work that is all done by the threads of the pool.

use crate::surface::Surface;

/// Runs `f` on a thread of the pool, if the surface that it evaluates may be asked there. A loop in parallel that begins on any other thread
/// wakes one of the pool and sleeps until that is done, which takes longer than a short loop does; in the pool it begins at once. What must
/// run on the thread of the caller (reports of progress, which look for signals) has no place in `f`.
pub fn in_pool<R: Send>(surface: &dyn Surface, f: impl FnOnce() -> R + Send) -> R {
    if surface.any_thread() { rayon::join(f, || ()).0 } else { f() }
}
