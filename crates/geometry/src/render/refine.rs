//! Crossings in brackets: Newton's method for many rays side by side, bisection where it would leave the bracket.

use isoswarm_field::vector::dot;
use isoswarm_field::{CompiledPiece, Pieces};

use super::Ray;

/// A Newton step of less than this, relative to t, is the last: what it leaves is its square.
const LAST_STEP: f64 = 1e-8;

/// A bracket this narrow, relative to t, is a point.
const POINT: f64 = 4.0 * f64::EPSILON;

/// More than bisection alone needs.
const MOST: usize = 80;

/// A part of a ray whose ends are on different sides; only the sides are known, not the values.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bracket {
    pub ray: usize,
    from: f64,
    to: f64,
    /// Where F was evaluated last, or the result.
    pub t: f64,
    value: f64,
    pub gradient: [f64; 3],
    /// Whether F < 0 at `to`.
    falls: bool,
    done: bool,
}

impl Bracket {
    /// `value` is F at the far end, `rate` a guess of dF/dt if there is one: F is evaluated first where they say.
    pub(super) fn new(ray: usize, (from, to): (f64, f64), value: f64, rate: f64) -> Self {
        let guess = to - value / rate;
        let t = if from < guess && guess < to { guess } else { 0.5 * (from + to) };
        let (gradient, falls) = ([f64::NAN; 3], value < 0.0);
        Self { ray, from, to, t, value, gradient, falls, done: false }
    }
}

/// Working memory.
#[derive(Default)]
pub(super) struct Refinery {
    points: Vec<[f64; 3]>,
    value: Vec<f64>,
    gradient: Vec<[f64; 3]>,
    which: Vec<usize>,
}

impl Refinery {
    /// F and its gradient at each bracket's `t`.
    fn evaluate(&mut self, pieces: &Pieces, ready: &CompiledPiece, rays: &[Ray], brackets: &mut [Bracket]) {
        self.which.clear();
        self.which.extend((0..brackets.len()).filter(|&k| !brackets[k].done));
        let n = self.which.len();
        self.points.clear();
        self.points.extend(self.which.iter().map(|&k| rays[brackets[k].ray].at(brackets[k].t)));
        self.value.resize(n, 0.0);
        self.gradient.resize(n, [0.0; 3]);
        pieces.value_gradient(ready, &self.points, &mut self.value[..n], &mut self.gradient[..n]);
        for (j, &k) in self.which.iter().enumerate() {
            (brackets[k].value, brackets[k].gradient) = (self.value[j], self.gradient[j]);
        }
    }

    /// Moves each bracket's `t` to the crossing.
    pub(super) fn solve(
        &mut self,
        pieces: &Pieces,
        ready: &CompiledPiece,
        rays: &[Ray],
        brackets: &mut [Bracket],
    ) {
        for round in 0..MOST {
            if brackets.iter().all(|b| b.done) {
                return;
            }
            self.evaluate(pieces, ready, rays, brackets);
            for b in brackets.iter_mut().filter(|b| !b.done) {
                advance(b, &rays[b.ray], round);
            }
        }
    }
}

/// Narrows the bracket by what F is at `t`, and moves `t`.
fn advance(b: &mut Bracket, ray: &Ray, round: usize) {
    if (b.value < 0.0) == b.falls {
        b.to = b.t;
    } else {
        b.from = b.t;
    }
    let slope = dot(ray.direction, b.gradient);
    let step = -b.value / slope;
    let next = b.t + step;
    // Newton's method settles in a few rounds or not at all.
    let trusted = b.from <= next && next <= b.to && (round < 12 || round.is_multiple_of(3));
    let size = b.t.abs().max(b.to - b.from);
    if trusted && step.abs() <= LAST_STEP * size {
        (b.t, b.done) = (next, true);
    } else if b.to - b.from <= POINT * b.t.abs() {
        b.done = true;
    } else {
        b.t = if trusted { next } else { 0.5 * (b.from + b.to) };
    }
}
