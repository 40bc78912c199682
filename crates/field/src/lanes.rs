//! Several intervals side by side: one pass over a tape for a box and all its neighbours.

use std::ops::{Add, Div, Mul, Neg, Sub};

use pulp::{Arch, NullaryFnOnce};

use crate::interval::Interval;
use crate::plain;
use crate::scalar::Scalar;
use crate::surface::Aabb;
use crate::tape::Tape;

/// Boxes that one pass takes.
pub(crate) const LANES: usize = 8;

/// [`LANES`] intervals; each operation is the interval's, lane by lane.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Lanes {
    pub lo: [f64; LANES],
    pub hi: [f64; LANES],
}

impl Lanes {
    pub(crate) fn from_fn(f: impl Fn(usize) -> Interval) -> Self {
        let all: [Interval; LANES] = std::array::from_fn(f);
        Self { lo: all.map(|i| i.lo), hi: all.map(|i| i.hi) }
    }

    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    pub(crate) fn lane(&self, l: usize) -> Interval {
        Interval { lo: self.lo[l], hi: self.hi[l] }
    }

    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn map(self, f: impl Fn(Interval) -> Interval) -> Self {
        let mut r = self;
        for l in 0..LANES {
            let v = f(self.lane(l));
            (r.lo[l], r.hi[l]) = (v.lo, v.hi);
        }
        r
    }

    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn zip(self, b: Self, f: impl Fn(Interval, Interval) -> Interval) -> Self {
        let mut r = self;
        for l in 0..LANES {
            let v = f(self.lane(l), b.lane(l));
            (r.lo[l], r.hi[l]) = (v.lo, v.hi);
        }
        r
    }

    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn zip3(self, b: Self, c: Self, f: impl Fn(Interval, Interval, Interval) -> Interval) -> Self {
        let mut r = self;
        for l in 0..LANES {
            let v = f(self.lane(l), b.lane(l), c.lane(l));
            (r.lo[l], r.hi[l]) = (v.lo, v.hi);
        }
        r
    }
}

impl From<Interval> for Lanes {
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn from(v: Interval) -> Self {
        Self { lo: [v.lo; LANES], hi: [v.hi; LANES] }
    }
}

/// What every instruction comes to in each of up to [`LANES`] boxes, and how much F depends on it there.
#[derive(Default)]
pub(crate) struct Pass {
    values: Vec<Lanes>,
    adjoints: plain::Adjoints<Lanes>,
    /// Instructions of the tape that was run last.
    length: usize,
}

impl Pass {
    /// Evaluates the tape over the boxes; lanes without a box repeat the first.
    pub(crate) fn run(
        &mut self,
        tape: &Tape,
        shared: &[Interval],
        boxes: &[Aabb],
        axes: usize,
        adjoints: bool,
    ) {
        let mut inputs = [Lanes::from(Interval::ZERO); crate::MAX_AXES];
        for a in 0..axes.min(3) {
            inputs[a] = Lanes::from_fn(|l| {
                let b = boxes.get(l).unwrap_or(&boxes[0]);
                Interval::new(b.lo[a], b.hi[a])
            });
        }
        Arch::new().dispatch(Sweeps { pass: self, tape, shared, inputs, adjoints });
    }

    /// Instruction `i` in all boxes.
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    pub(crate) fn lanes(&self, i: usize) -> &Lanes {
        &self.values[i]
    }

    /// Instruction `i` in box `lane`.
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    pub(crate) fn value(&self, i: usize, lane: usize) -> Interval {
        self.values[i].lane(lane)
    }

    /// ∂F/∂(instruction `i`) in box `lane`.
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    pub(crate) fn adjoint(&self, i: usize, lane: usize) -> Interval {
        self.adjoints.list[i].lane(lane)
    }

    /// F in box `lane`.
    pub(crate) fn result(&self, lane: usize) -> Interval {
        self.value(self.length - 1, lane)
    }
}

struct Sweeps<'a> {
    pass: &'a mut Pass,
    tape: &'a Tape,
    shared: &'a [Interval],
    inputs: [Lanes; crate::MAX_AXES],
    adjoints: bool,
}

impl NullaryFnOnce for Sweeps<'_> {
    type Output = ();

    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn call(self) {
        let Pass { values, adjoints, length } = self.pass;
        *length = self.tape.instrs.len();
        plain::forward(self.tape, self.shared, &self.inputs, values);
        if self.adjoints {
            plain::reverse(self.tape, self.shared, values, adjoints);
        }
    }
}

macro_rules! lane_operators {
    ($($trait:ident $name:ident;)*) => {$(
        impl $trait for Lanes {
            type Output = Self;
            #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
            fn $name(self, b: Self) -> Self {
                self.zip(b, |x, y| x.$name(y))
            }
        }
    )*};
}
lane_operators! { Add add; Sub sub; Mul mul; Div div; }

impl Neg for Lanes {
    type Output = Self;
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn neg(self) -> Self {
        self.map(|x| -x)
    }
}

macro_rules! lane_functions {
    (one: $($one:ident)*; two: $($two:ident)*) => {
        impl Scalar for Lanes {
            #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
            fn from_f64(v: f64) -> Self {
                Self::from(Interval::from_f64(v))
            }
            $(#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
            fn $one(self) -> Self {
                self.map(|x| x.$one())
            })*
            $(#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
            fn $two(self, b: Self) -> Self {
                self.zip(b, |x, y| x.$two(y))
            })*
            #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
            fn choose(mask: Self, b: Self, c: Self) -> Self {
                mask.zip3(b, c, Interval::choose)
            }
            #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
            fn pass_if_less(self, b: Self, g: Self) -> Self {
                self.zip3(b, g, Interval::pass_if_less)
            }
        }
    };
}
lane_functions! {
    one: abs sign sqrt square exp ln sin cos tan asin acos atan floor ceil round;
    two: half_over times_ln min max pow atan2 modulo less
}
