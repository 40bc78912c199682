//! A field cut to regions of space, for programs that walk through space by boxes of their own: ray casters, meshers.

use std::cell::RefCell;
use std::sync::Arc;

use super::Field;
use crate::bumps::{Near, Sum};
use crate::interval::Interval;
use crate::kernel::{Batch, Columns, Want, run};
use crate::lanes::LANES;
use crate::program::{Program, Purpose};
use crate::prune::Scratch;
use crate::regions::Whole;
use crate::surface::Aabb;
use crate::tape::Tape;

/// Tapes up to this length are not worth pruning further.
const SHORT: usize = 16;

/// What of F matters in a region: a pruned tape, or the bumps of a sum that reach into it. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Piece(Kind);

#[derive(Clone, Debug)]
enum Kind {
    Tape(Arc<Tape>),
    Bumps(Arc<Near>),
}

/// A piece made ready for points.
#[derive(Clone, Debug)]
pub struct CompiledPiece(Ready);

#[derive(Clone, Debug)]
enum Ready {
    Program(Program),
    Bumps(Arc<Near>),
}

/// Ranges of F and of its gradient in a box.
#[derive(Clone, Copy, Debug)]
pub struct Ranges {
    /// Range of F.
    pub value: Interval,
    /// Ranges of ∂F/∂x; everything where they were not asked for.
    pub gradient: [Interval; 3],
}

/// F by regions: see [`Field::pieces`].
pub struct Pieces<'a> {
    whole: Whole<'a>,
    sum: Option<&'a Sum>,
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::new(Scratch::default());
}

impl Field {
    /// F by regions of space: its ranges in boxes and what is left of it there. `None` where a part is an opaque function,
    /// or for fields of several equations or other than three coordinates.
    ///
    /// ```
    /// use isoswarm_field::{Aabb, Field, text};
    /// let field = Field::new(&text::parse("min(x, y^2 + z^2 - 1)", &[])?)?;
    /// let pieces = field.pieces().unwrap();
    /// let b = Aabb::new([3.0, -1.0, -1.0], [4.0, 1.0, 1.0]);
    /// let (ranges, parts) = pieces.divide(&pieces.whole(), &[b], false);
    /// assert!(ranges[0].value.contains(-1.0) && ranges[0].value.contains(1.0) && ranges[0].value.hi < 1.1);
    /// let mut value = [0.0];
    /// pieces.value(&pieces.compiled(&parts[0]), &[[3.5, 1.0, 0.5]], &mut value);
    /// assert_eq!(value, [0.25]);
    /// # Ok::<(), isoswarm_field::FieldError>(())
    /// ```
    pub fn pieces(&self) -> Option<Pieces<'_>> {
        let plain = !self.is_opaque() && self.components() == 1 && self.axes() == 3;
        plain.then(|| Pieces { whole: self.whole(), sum: self.bumps() })
    }
}

impl Pieces<'_> {
    /// Most boxes that [`Pieces::divide`] takes at once.
    pub const MOST: usize = LANES;

    /// All of F.
    pub fn whole(&self) -> Piece {
        match self.sum {
            Some(sum) => Piece(Kind::Bumps(Arc::new(sum.everything()))),
            None => Piece(Kind::Tape(Arc::new(self.whole.tape.clone()))),
        }
    }

    /// The ranges of F in up to [`Pieces::MOST`] boxes inside the piece's region, with those of its gradient where `slopes`,
    /// and what is left of the piece in each box that may contain a zero (elsewhere the piece itself).
    ///
    /// Values of what is left are those of F to the last bit.
    pub fn divide(&self, piece: &Piece, boxes: &[Aabb], slopes: bool) -> (Vec<Ranges>, Vec<Piece>) {
        let boxes = &boxes[..boxes.len().min(LANES)];
        match (&piece.0, self.sum) {
            (Kind::Bumps(near), Some(sum)) => self.divide_sum(sum, near, boxes, slopes),
            (Kind::Tape(tape), _) => SCRATCH.with_borrow_mut(|s| self.divide_tape(tape, boxes, slopes, s)),
            _ => (Vec::new(), Vec::new()),
        }
    }

    /// The ranges that [`Pieces::divide`] gives, alone.
    pub fn ranges(&self, piece: &Piece, boxes: &[Aabb], slopes: bool) -> Vec<Ranges> {
        let boxes = &boxes[..boxes.len().min(LANES)];
        match (&piece.0, self.sum) {
            (Kind::Bumps(near), Some(sum)) => {
                let one = |b| sum.ranges(near, b, slopes);
                boxes.iter().map(one).map(|(value, gradient)| Ranges { value, gradient }).collect()
            }
            (Kind::Tape(tape), _) => SCRATCH.with_borrow_mut(|s| self.ranges_tape(tape, boxes, slopes, s)),
            _ => Vec::new(),
        }
    }

    fn ranges_tape(&self, tape: &Tape, boxes: &[Aabb], slopes: bool, scratch: &mut Scratch) -> Vec<Ranges> {
        let spans = &self.whole.spans;
        if boxes.is_empty() {
            return Vec::new();
        }
        scratch.pass.run(tape, spans, boxes, self.whole.axes, slopes);
        let inputs = [0, 1, 2].map(|a| tape.input(a));
        let one = |lane: usize| Ranges {
            value: scratch.pass.result(lane),
            gradient: inputs.map(|at| match at {
                _ if !slopes => Interval::ENTIRE,
                Some(at) => scratch.pass.adjoint(at, lane),
                None => Interval::ZERO,
            }),
        };
        (0..boxes.len()).map(one).collect()
    }

    fn divide_tape(
        &self,
        tape: &Arc<Tape>,
        boxes: &[Aabb],
        slopes: bool,
        scratch: &mut Scratch,
    ) -> (Vec<Ranges>, Vec<Piece>) {
        let spans = &self.whole.spans;
        let ranges = self.ranges_tape(tape, boxes, slopes, scratch);
        let same = || Piece(Kind::Tape(tape.clone()));
        if tape.len() <= SHORT || !ranges.iter().any(|r| r.value.has_zero()) {
            return (ranges, (0..boxes.len()).map(|_| same()).collect());
        }
        tape.decide(spans, 0.0, boxes.len(), scratch);
        let left = |lane: usize| {
            if !ranges[lane].value.has_zero() {
                return same();
            }
            // One that is hardly shorter is not worth its memory.
            if scratch.kept(lane).len() * 10 >= tape.len() * 9 {
                return same();
            }
            Piece(Kind::Tape(Arc::new(tape.pruned(spans, lane, scratch))))
        };
        let parts = (0..boxes.len()).map(left).collect();
        (ranges, parts)
    }

    fn divide_sum(&self, sum: &Sum, near: &Near, boxes: &[Aabb], slopes: bool) -> (Vec<Ranges>, Vec<Piece>) {
        let one = |b: &Aabb| {
            let part = sum.nearer(near, b);
            let (value, gradient) = sum.ranges(&part, b, slopes);
            (Ranges { value, gradient }, Piece(Kind::Bumps(Arc::new(part))))
        };
        boxes.iter().map(one).unzip()
    }

    /// The piece made ready for points.
    pub fn compiled(&self, piece: &Piece) -> CompiledPiece {
        CompiledPiece(match &piece.0 {
            Kind::Tape(tape) => Ready::Program(Program::new(tape, Purpose::Inputs)),
            Kind::Bumps(near) => Ready::Bumps(near.clone()),
        })
    }

    /// F at points of the piece's region, on this thread.
    pub fn value(&self, piece: &CompiledPiece, points: &[[f64; 3]], value: &mut [f64]) {
        match (&piece.0, self.sum) {
            (Ready::Bumps(near), Some(sum)) => sum.value_near(near, points, value),
            (Ready::Program(p), _) => {
                run(p, self.whole.uniforms, Batch::of_points(points, 3), value, Want::Value)
            }
            _ => {}
        }
    }

    /// F and ∂F/∂x at points of the piece's region, on this thread.
    pub fn value_gradient(
        &self,
        piece: &CompiledPiece,
        points: &[[f64; 3]],
        value: &mut [f64],
        gradient: &mut [[f64; 3]],
    ) {
        match (&piece.0, self.sum) {
            (Ready::Bumps(near), Some(sum)) => sum.gradient_near(near, points, value, gradient),
            (Ready::Program(p), _) => {
                let x = Columns { data: gradient.as_flattened_mut(), stride: 3 };
                run(p, self.whole.uniforms, Batch::of_points(points, 3), value, Want::Chosen { x });
            }
            _ => {}
        }
    }
}

impl Piece {
    /// Whether F may jump in the region (a floor, a selection, an angle's cut): then the ranges of its gradient say nothing
    /// of how it changes.
    pub fn jumps(&self) -> bool {
        match &self.0 {
            Kind::Tape(tape) => tape.jumps(),
            Kind::Bumps(_) => false,
        }
    }

    /// Operations carried out for a point; for a sum, its bumps.
    pub fn operations(&self) -> usize {
        match &self.0 {
            Kind::Tape(tape) => tape.len(),
            Kind::Bumps(near) => near.len(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::text;

    const MODELS: [&str; 4] = [
        "min(sqrt(x^2 + y^2 + z^2) - 1, max(abs(x) - 0.5, abs(y - 0.3) - 0.7, z))",
        "sin(3*x)*cos(2*y) + sin(3*y)*cos(2*z) + x*z^3",
        "1 - exp(2 - 2*((x-0.3)^2 + y^2 + z^2)) - exp(2 - 3*((x+0.5)^2 + (y-0.2)^2 + z^2)) - exp(1 - x^2 - y^2 - 2*z^2)",
        "x^4 + y^4 + z^4 - 2*x*y*z - 1",
    ];

    /// Numbers that are spread over 0 to 1.
    fn spread(k: usize) -> f64 {
        (k as f64 * 0.618_033_988_749_895).fract()
    }

    #[test]
    fn ranges_hold_and_what_is_left_has_the_same_values() {
        for model in MODELS {
            let field = Field::new(&text::parse(model, &[]).unwrap()).unwrap();
            let pieces = field.pieces().unwrap();
            let first = Aabb::new([-1.0; 3], [1.0; 3]);
            let (_, parts) = pieces.divide(&pieces.whole(), &[first], false);
            for k in 0..50 {
                let lo = [0, 1, 2].map(|a| 1.6 * spread(3 * k + a + 1) - 0.8);
                let b = Aabb::new(lo, lo.map(|v| v + 0.2 * spread(k)));
                let (ranges, inner) = pieces.divide(&parts[0], &[b], true);
                let ready = pieces.compiled(&inner[0]);
                let points: Vec<[f64; 3]> = (0..20)
                    .map(|j| [0, 1, 2].map(|a| b.lo[a] + (b.hi[a] - b.lo[a]) * spread(5 * j + 7 * a + k)))
                    .collect();
                let (mut value, mut gradient) = (vec![0.0; 20], vec![[0.0; 3]; 20]);
                pieces.value_gradient(&ready, &points, &mut value, &mut gradient);
                let mut alone = vec![0.0; 20];
                pieces.value(&ready, &points, &mut alone);
                assert_eq!(value, alone);
                let mut whole = vec![0.0; 20];
                field.value(points.as_flattened(), &mut whole).unwrap();
                for j in 0..20 {
                    assert!((value[j] - whole[j]).abs() <= 1e-13, "{model}");
                    assert!(ranges[0].value.contains(value[j]), "{model}");
                    for a in 0..3 {
                        assert!(ranges[0].gradient[a].contains(gradient[j][a]), "{model}");
                    }
                }
                assert_eq!(pieces.ranges(&parts[0], &[b], true)[0].value, ranges[0].value);
            }
        }
    }

    #[test]
    fn opaque_and_flat_fields_have_no_pieces() {
        let field = Field::new(&text::parse("floor(x) + y", &[]).unwrap()).unwrap();
        assert!(field.pieces().unwrap().whole().jumps());
        let field = Field::new(&text::parse("x + y", &[]).unwrap()).unwrap();
        assert!(!field.pieces().unwrap().whole().jumps());
    }
}
