//! The calls of pulp that the core makes, for the one vector width that WebAssembly has.
//!
//! pulp compiles each kernel once for every width that a machine might turn out to have. A module is compiled for vectors of 128 bits
//! or does not load: here a kernel is there once, and called.

/// The machine.
#[derive(Clone, Copy, Debug, Default)]
pub struct Arch;

impl Arch {
    /// The machine that this runs on.
    #[inline(always)]
    pub fn new() -> Self {
        Self
    }

    /// Calls a kernel.
    #[inline(always)]
    pub fn dispatch<K: WithSimd>(self, kernel: K) -> K::Output {
        kernel.with_simd(Pairs)
    }
}

/// A kernel that leaves vectors to the compiler.
pub trait NullaryFnOnce {
    /// What it gives.
    type Output;

    /// Runs it.
    fn call(self) -> Self::Output;
}

impl<R, F: FnOnce() -> R> NullaryFnOnce for F {
    type Output = R;

    #[inline(always)]
    fn call(self) -> R {
        self()
    }
}

/// A kernel written in vectors of any width.
pub trait WithSimd {
    /// What it gives.
    type Output;

    /// Runs it with vectors of one width.
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output;
}

impl<F: NullaryFnOnce> WithSimd for F {
    type Output = F::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> F::Output {
        self.call()
    }
}

/// Vectors of a width.
#[allow(non_camel_case_types)]
pub trait Simd: Copy {
    /// A vector.
    type f64s: Copy;

    /// Numbers in a vector.
    const F64_LANES: usize;

    /// One number in all lanes.
    fn splat_f64s(self, v: f64) -> Self::f64s;

    /// a + b
    fn add_f64s(self, a: Self::f64s, b: Self::f64s) -> Self::f64s;

    /// a b
    fn mul_f64s(self, a: Self::f64s, b: Self::f64s) -> Self::f64s;

    /// Whole vectors, and what is left.
    fn as_simd_f64s(v: &[f64]) -> (&[Self::f64s], &[f64]);

    /// Whole vectors, and what is left.
    fn as_mut_simd_f64s(v: &mut [f64]) -> (&mut [Self::f64s], &mut [f64]);
}

/// Vectors of two numbers.
#[derive(Clone, Copy, Debug)]
pub struct Pairs;

impl Simd for Pairs {
    type f64s = [f64; 2];

    const F64_LANES: usize = 2;

    #[inline(always)]
    fn splat_f64s(self, v: f64) -> [f64; 2] {
        [v; 2]
    }

    #[inline(always)]
    fn add_f64s(self, a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
        [a[0] + b[0], a[1] + b[1]]
    }

    #[inline(always)]
    fn mul_f64s(self, a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
        [a[0] * b[0], a[1] * b[1]]
    }

    #[inline(always)]
    fn as_simd_f64s(v: &[f64]) -> (&[[f64; 2]], &[f64]) {
        v.as_chunks()
    }

    #[inline(always)]
    fn as_mut_simd_f64s(v: &mut [f64]) -> (&mut [[f64; 2]], &mut [f64]) {
        v.as_chunks_mut()
    }
}
