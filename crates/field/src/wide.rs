//! Numbers side by side, for loops that the compiler does not turn into vectors itself.
//!
//! Natively such a loop is compiled for each width of vectors that a machine may have, and [`Single`] and [`Double`] are plain numbers, one
//! lane each. WebAssembly is compiled for size, and then LLVM makes no vectors; there they are vectors of 128 bits. Lanes are
//! independent and the operations IEEE's, so that results have the same bits.

use std::ops::{Add, AddAssign, Mul, Sub};

/// Numbers side by side; an operation is that of each lane.
pub trait Wide: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + AddAssign {
    /// What a lane holds.
    type Number: Copy;
    /// Lanes.
    const WIDTH: usize;

    /// The same number in all lanes.
    fn splat(v: Self::Number) -> Self;

    /// The first [`WIDTH`](Self::WIDTH) numbers of `v`.
    fn load(v: &[Self::Number]) -> Self;

    /// Writes them over the first of `to`.
    fn store(self, to: &mut [Self::Number]);

    /// `then` where this is less than `limit`, else `or`.
    fn if_less(self, limit: Self, then: Self, or: Self) -> Self;
}

/// [`Wide`] numbers in double precision.
pub trait WideDouble: Wide<Number = f64> {
    /// What `f` makes of the bits of each lane.
    fn map_bits(self, f: impl Fn(u64) -> u64) -> Self;
}

/// [`Wide`] numbers in single precision.
pub trait WideSingle: Wide<Number = f32> {
    /// Four numbers that lie together.
    type Row: Copy;

    /// Four numbers that lie together.
    fn row(v: [f32; 4]) -> Self::Row;

    /// A column for each number of the rows, row `at[l]` being lane l.
    fn columns(rows: &[Self::Row], at: &[u32]) -> [Self; 4];
}

#[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
mod lanes {
    /// In single precision.
    pub type Single = f32;
    /// In double precision.
    pub type Double = f64;
}

#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
mod lanes {
    use core::arch::wasm32::{
        f32x4, f32x4_add, f32x4_extract_lane, f32x4_lt, f32x4_mul, f32x4_splat, f32x4_sub, f64x2, f64x2_add,
        f64x2_extract_lane, f64x2_lt, f64x2_mul, f64x2_splat, f64x2_sub, i32x4_shuffle, v128, v128_bitselect,
    };
    use std::ops::{Add, AddAssign, Mul, Sub};

    use super::{Wide, WideDouble, WideSingle};

    /// In single precision.
    #[derive(Clone, Copy, Debug)]
    pub struct Single(v128, v128);

    /// In double precision.
    #[derive(Clone, Copy, Debug)]
    pub struct Double(v128);

    macro_rules! operators {
        ($type:ident, $add:ident, $sub:ident, $mul:ident) => {
            impl Add for $type {
                type Output = Self;
                #[inline(always)]
                fn add(self, b: Self) -> Self {
                    self.zip(b, |a, b| $add(a, b))
                }
            }
            impl Sub for $type {
                type Output = Self;
                #[inline(always)]
                fn sub(self, b: Self) -> Self {
                    self.zip(b, |a, b| $sub(a, b))
                }
            }
            impl Mul for $type {
                type Output = Self;
                #[inline(always)]
                fn mul(self, b: Self) -> Self {
                    self.zip(b, |a, b| $mul(a, b))
                }
            }
            impl AddAssign for $type {
                #[inline(always)]
                fn add_assign(&mut self, b: Self) {
                    *self = *self + b;
                }
            }
        };
    }
    operators!(Single, f32x4_add, f32x4_sub, f32x4_mul);
    operators!(Double, f64x2_add, f64x2_sub, f64x2_mul);

    /// The columns of four rows.
    #[inline(always)]
    fn transposed(a: v128, b: v128, c: v128, d: v128) -> (v128, v128, v128, v128) {
        let (xy, zw) = (i32x4_shuffle::<0, 4, 1, 5>(a, b), i32x4_shuffle::<2, 6, 3, 7>(a, b));
        let (uv, st) = (i32x4_shuffle::<0, 4, 1, 5>(c, d), i32x4_shuffle::<2, 6, 3, 7>(c, d));
        (
            i32x4_shuffle::<0, 1, 4, 5>(xy, uv),
            i32x4_shuffle::<2, 3, 6, 7>(xy, uv),
            i32x4_shuffle::<0, 1, 4, 5>(zw, st),
            i32x4_shuffle::<2, 3, 6, 7>(zw, st),
        )
    }

    impl Single {
        #[inline(always)]
        fn zip(self, b: Self, f: impl Fn(v128, v128) -> v128) -> Self {
            Self(f(self.0, b.0), f(self.1, b.1))
        }
    }

    impl Wide for Single {
        type Number = f32;
        const WIDTH: usize = 8;

        #[inline(always)]
        fn splat(v: f32) -> Self {
            Self(f32x4_splat(v), f32x4_splat(v))
        }

        #[inline(always)]
        fn load(v: &[f32]) -> Self {
            let v = &v[..8];
            Self(f32x4(v[0], v[1], v[2], v[3]), f32x4(v[4], v[5], v[6], v[7]))
        }

        #[inline(always)]
        fn store(self, to: &mut [f32]) {
            for (v, to) in [self.0, self.1].into_iter().zip(to[..8].as_chunks_mut().0) {
                *to = [
                    f32x4_extract_lane::<0>(v),
                    f32x4_extract_lane::<1>(v),
                    f32x4_extract_lane::<2>(v),
                    f32x4_extract_lane::<3>(v),
                ];
            }
        }

        #[inline(always)]
        fn if_less(self, limit: Self, then: Self, or: Self) -> Self {
            let one = |v, limit, then, or| v128_bitselect(then, or, f32x4_lt(v, limit));
            Self(one(self.0, limit.0, then.0, or.0), one(self.1, limit.1, then.1, or.1))
        }
    }

    impl WideSingle for Single {
        type Row = v128;

        #[inline(always)]
        fn row([x, y, z, w]: [f32; 4]) -> v128 {
            f32x4(x, y, z, w)
        }

        #[inline(always)]
        fn columns(rows: &[v128], at: &[u32]) -> [Self; 4] {
            let at = &at[..8];
            let (x0, y0, z0, w0) = transposed(
                rows[at[0] as usize],
                rows[at[1] as usize],
                rows[at[2] as usize],
                rows[at[3] as usize],
            );
            let (x1, y1, z1, w1) = transposed(
                rows[at[4] as usize],
                rows[at[5] as usize],
                rows[at[6] as usize],
                rows[at[7] as usize],
            );
            [Self(x0, x1), Self(y0, y1), Self(z0, z1), Self(w0, w1)]
        }
    }

    impl Double {
        #[inline(always)]
        fn zip(self, b: Self, f: impl Fn(v128, v128) -> v128) -> Self {
            Self(f(self.0, b.0))
        }
    }

    impl Wide for Double {
        type Number = f64;
        const WIDTH: usize = 2;

        #[inline(always)]
        fn splat(v: f64) -> Self {
            Self(f64x2_splat(v))
        }

        #[inline(always)]
        fn load(v: &[f64]) -> Self {
            let v = &v[..2];
            Self(f64x2(v[0], v[1]))
        }

        #[inline(always)]
        fn store(self, to: &mut [f64]) {
            to[..2].copy_from_slice(&[f64x2_extract_lane::<0>(self.0), f64x2_extract_lane::<1>(self.0)]);
        }

        #[inline(always)]
        fn if_less(self, limit: Self, then: Self, or: Self) -> Self {
            Self(v128_bitselect(then.0, or.0, f64x2_lt(self.0, limit.0)))
        }
    }

    impl WideDouble for Double {
        #[inline(always)]
        fn map_bits(self, f: impl Fn(u64) -> u64) -> Self {
            let lane = |v: f64| f64::from_bits(f(v.to_bits()));
            Self(f64x2(lane(f64x2_extract_lane::<0>(self.0)), lane(f64x2_extract_lane::<1>(self.0))))
        }
    }
}

pub use lanes::{Double, Single};

macro_rules! one_lane {
    ($number:ident) => {
        impl Wide for $number {
            type Number = $number;
            const WIDTH: usize = 1;

            #[inline(always)]
            fn splat(v: $number) -> Self {
                v
            }

            #[inline(always)]
            fn load(v: &[$number]) -> Self {
                v[0]
            }

            #[inline(always)]
            fn store(self, to: &mut [$number]) {
                to[0] = self;
            }

            #[inline(always)]
            fn if_less(self, limit: Self, then: Self, or: Self) -> Self {
                core::hint::select_unpredictable(self < limit, then, or)
            }
        }
    };
}
one_lane!(f32);
one_lane!(f64);

impl WideDouble for f64 {
    #[inline(always)]
    fn map_bits(self, f: impl Fn(u64) -> u64) -> Self {
        f64::from_bits(f(self.to_bits()))
    }
}

impl WideSingle for f32 {
    type Row = [f32; 4];

    #[inline(always)]
    fn row(v: [f32; 4]) -> [f32; 4] {
        v
    }

    #[inline(always)]
    fn columns(rows: &[[f32; 4]], at: &[u32]) -> [Self; 4] {
        rows[at[0] as usize]
    }
}
