//! Processor time of repeated runs of one thread, which other programs on the machine disturb least.

use cpu_time::ProcessTime;

/// Smallest processor time of `runs` calls on this thread, in seconds, after one call that is not counted.
pub fn fastest<R>(runs: usize, mut call: impl FnMut() -> R) -> f64 {
    std::hint::black_box(call());
    (0..runs).fold(f64::INFINITY, |best, _| {
        let start = ProcessTime::now();
        std::hint::black_box(call());
        best.min(start.elapsed().as_secs_f64())
    })
}

/// Processor time of a single call, for what takes minutes.
pub fn once<R>(call: impl FnOnce() -> R) -> f64 {
    let start = ProcessTime::now();
    std::hint::black_box(call());
    start.elapsed().as_secs_f64()
}

/// Uniform numbers in [0, 1): SplitMix64.
pub struct Uniform(pub u64);

impl Uniform {
    /// The next number.
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// The next number in [lo, hi).
    pub fn between(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * self.next()
    }
}
