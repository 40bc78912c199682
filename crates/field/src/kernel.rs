//! Runs tapes over batches of points: gathers blocks, calls the sweeps under the widest vectors that the machine
//! has, scatters the results. One thread; [`crate::field`] and [`crate::regions`] spread batches over threads.

use std::cell::RefCell;

use pulp::{Arch, NullaryFnOnce};

use crate::MAX_AXES;
use crate::dual::Dual;
use crate::eval::{Directional, Full, Ignore, NO_ROW, Sink, forward, reverse, reverse_uniforms};
use crate::tape::{Tape, Uniform};

/// Points to evaluate at: coordinates, and the outputs of opaque leaves there.
#[derive(Clone, Copy)]
pub(crate) struct Batch<'a> {
    /// Coordinates, `stride` numbers a point.
    pub points: &'a [f64],
    pub stride: usize,
    pub axes: usize,
    /// Leaf outputs, `leaves` numbers a point.
    pub outputs: &'a [f64],
    pub leaves: usize,
}

impl<'a> Batch<'a> {
    pub(crate) fn of_points(points: &'a [[f64; 3]], axes: usize) -> Self {
        Self { points: points.as_flattened(), stride: 3, axes, outputs: &[], leaves: 0 }
    }

    pub(crate) fn len(&self) -> usize {
        self.points.len() / self.stride
    }

    /// The points from `start` on, `n` of them.
    pub(crate) fn slice(&self, start: usize, n: usize) -> Batch<'a> {
        Batch {
            points: &self.points[start * self.stride..(start + n) * self.stride],
            outputs: &self.outputs[start * self.leaves..(start + n) * self.leaves],
            ..*self
        }
    }

    /// Fills the inputs that the tape uses; lanes beyond the last point repeat it.
    #[inline(always)]
    fn gather<const B: usize>(&self, tape: &Tape, start: usize, n: usize, inputs: &mut [[f64; B]]) {
        for &(number, _) in &tape.inputs {
            let k = number as usize;
            let (data, stride, offset) = if k < MAX_AXES {
                (self.points, self.stride, k)
            } else {
                (self.outputs, self.leaves, k - MAX_AXES)
            };
            let lane = &mut inputs[k];
            for j in 0..n {
                lane[j] = data[(start + j) * stride + offset];
            }
            let last = lane[n - 1];
            lane[n..].fill(last);
        }
    }
}

/// A column of results, `stride` numbers a point.
pub(crate) struct Columns<'a> {
    pub data: &'a mut [f64],
    pub stride: usize,
}

thread_local! {
    static SCRATCH: RefCell<Vec<f64>> = const { RefCell::new(Vec::new()) };
}

/// Lends at least `n` numbers of working memory, with arbitrary content.
fn with_scratch<R>(n: usize, f: impl FnOnce(&mut [f64]) -> R) -> R {
    SCRATCH.with_borrow_mut(|v| {
        if v.len() < n {
            v.resize(n, 0.0);
        }
        f(&mut v[..n])
    })
}

/// Blocks that fit the second-level cache: long tapes run in short blocks.
const LONG: usize = 64;
const SHORT: usize = 16;
fn long_blocks(tape: &Tape, copies: usize, points: usize) -> bool {
    points > SHORT && tape.len() * copies * LONG * size_of::<f64>() <= 256 * 1024
}

/// What a run computes besides F.
pub(crate) enum Want<'a, 'b> {
    /// F only.
    Value,
    /// ∂F/∂x: `axes` numbers a point, and ∂F/∂(leaf outputs).
    Gradient { x: Columns<'a>, leaves: Columns<'a> },
    /// The same and (∂F/∂q)·q̇, given the rates of the uniforms.
    Rate { x: Columns<'a>, leaves: Columns<'a>, rates: &'b [f64], rate: &'a mut [f64] },
    /// The same and all of ∂F/∂q.
    Parameters { x: Columns<'a>, leaves: Columns<'a>, rows: &'b Rows, q: Columns<'a> },
}

/// Which rows of adjoints belong to which uniform, and which parameter is which row.
pub(crate) struct Rows {
    /// Row of each uniform, or [`NO_ROW`].
    pub row_of: Vec<u32>,
    /// Number of rows.
    pub count: usize,
    /// (column of the result, row) for each free parameter that F depends on.
    pub columns: Vec<(usize, usize)>,
}

impl Rows {
    /// `column_of[p]` is the column of parameter p in the result, or `None` if it is frozen.
    pub(crate) fn new(tape: &Tape, column_of: &[Option<usize>]) -> Rows {
        let mut rows = Rows { row_of: Vec::new(), count: 0, columns: Vec::new() };
        for u in &tape.program.list {
            let active = match *u {
                Uniform::Const(_) => false,
                Uniform::Param(p) => column_of[p as usize].is_some(),
                Uniform::Op(op, args) => args[..op.arity()].iter().any(|&a| rows.row_of[a as usize] != NO_ROW),
            };
            if let (true, Uniform::Param(p)) = (active, *u) {
                rows.columns.push((column_of[p as usize].unwrap_or(0), rows.count));
            }
            rows.row_of.push(if active { rows.count as u32 } else { NO_ROW });
            rows.count += usize::from(active);
        }
        rows
    }
}

/// Evaluates the tape at all points of the batch, on this thread.
pub(crate) fn run(tape: &Tape, uniforms: &[f64], batch: Batch, value: &mut [f64], want: Want) {
    let n = batch.len();
    if n == 0 {
        return;
    }
    let (copies, rows) = match &want {
        Want::Value => (1, 0),
        Want::Parameters { rows, .. } => (2, rows.count),
        _ => (2, 0),
    };
    let inputs = MAX_AXES + batch.leaves;
    let numbers = |b: usize| (inputs + tape.len() * copies + rows) * b;
    if long_blocks(tape, copies, n) && rows == 0 {
        with_scratch(numbers(LONG), |scratch| {
            Arch::new().dispatch(Run::<LONG> { tape, uniforms, batch, value, want, scratch });
        });
    } else {
        with_scratch(numbers(SHORT), |scratch| {
            Arch::new().dispatch(Run::<SHORT> { tape, uniforms, batch, value, want, scratch });
        });
    }
}

struct Run<'a, 'b, 'c, const B: usize> {
    tape: &'c Tape,
    uniforms: &'c [f64],
    batch: Batch<'c>,
    value: &'c mut [f64],
    want: Want<'a, 'b>,
    scratch: &'c mut [f64],
}

impl<const B: usize> NullaryFnOnce for Run<'_, '_, '_, B> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Run { tape, uniforms, batch, value, mut want, scratch } = self;
        let (blocks, _) = scratch.as_chunks_mut::<B>();
        let (inputs, blocks) = blocks.split_at_mut(MAX_AXES + batch.leaves);
        let (slots, rest) = blocks.split_at_mut(tape.len());
        let total = batch.len();
        let mut start = 0;
        while start < total {
            let n = B.min(total - start);
            batch.gather(tape, start, n, inputs);
            forward::<f64, B>(tape, uniforms, inputs, slots);
            value[start..start + n].copy_from_slice(&slots[tape.len() - 1][..n]);
            match &mut want {
                Want::Value => {}
                Want::Gradient { x, leaves } => {
                    sweep(tape, uniforms, slots, rest, &mut Ignore, batch.axes, (start, n), x, leaves);
                }
                Want::Rate { x, leaves, rates, rate } => {
                    let mut sink = Directional { rates, total: [0.0; B] };
                    sweep(tape, uniforms, slots, rest, &mut sink, batch.axes, (start, n), x, leaves);
                    rate[start..start + n].copy_from_slice(&sink.total[..n]);
                }
                Want::Parameters { x, leaves, rows, q } => {
                    let (adjoints, table) = rest.split_at_mut(tape.len());
                    table.fill([0.0; B]);
                    let mut sink = Full { row_of: &rows.row_of, rows: table };
                    sweep(tape, uniforms, slots, adjoints, &mut sink, batch.axes, (start, n), x, leaves);
                    reverse_uniforms::<f64, B>(&tape.program.list, uniforms, &rows.row_of, table);
                    // A point's row is written from end to end, so that each cache line is touched once.
                    for j in 0..n {
                        let at = (start + j) * q.stride;
                        let line = &mut q.data[at..at + q.stride];
                        for &(column, row) in &rows.columns {
                            line[column] = table[row][j];
                        }
                    }
                }
            }
            start += n;
        }
    }
}

/// The reverse sweep of one block, and its scatter.
#[inline(always)]
fn sweep<const B: usize, S: Sink<f64, B>>(
    tape: &Tape,
    uniforms: &[f64],
    slots: &[[f64; B]],
    adjoints: &mut [[f64; B]],
    sink: &mut S,
    axes: usize,
    (start, n): (usize, usize),
    x: &mut Columns<'_>,
    leaves: &mut Columns<'_>,
) {
    reverse::<f64, B, S>(tape, uniforms, slots, adjoints, sink);
    scatter(tape, adjoints, 0, axes, (start, n), x);
    scatter(tape, adjoints, MAX_AXES, leaves.stride, (start, n), leaves);
}

/// Writes the adjoints of `count` inputs from number `first` on.
#[inline(always)]
fn scatter<const B: usize>(
    tape: &Tape,
    adjoints: &[[f64; B]],
    first: usize,
    count: usize,
    (start, n): (usize, usize),
    columns: &mut Columns<'_>,
) {
    let target = &mut columns.data[start * columns.stride..(start + n) * columns.stride];
    for k in 0..count {
        let slot = tape.input_slot(first + k);
        for (j, point) in target.chunks_exact_mut(columns.stride).enumerate() {
            point[k] = slot.map_or(0.0, |slot| adjoints[slot][j]);
        }
    }
}

/// Second derivatives for up to three axes: `hessian[i][j]` of each point, row-major (axes × axes).
pub(crate) fn hessian(tape: &Tape, uniforms: &[f64], batch: Batch, out: &mut [f64]) {
    const B: usize = 8;
    let axes = batch.axes;
    let wrapped: Vec<Dual<f64>> = uniforms.iter().map(|&u| dual(u)).collect();
    let zero = [dual(0.0); B];
    let mut inputs = vec![zero; MAX_AXES + batch.leaves];
    let mut slots = vec![zero; tape.len()];
    let mut adjoints = vec![zero; tape.len()];
    let mut plain = vec![[0.0; B]; inputs.len()];
    let mut start = 0;
    while start < batch.len() {
        let n = B.min(batch.len() - start);
        batch.gather(tape, start, n, &mut plain);
        // Three directions at a time; more axes take more passes.
        for first in (0..axes).step_by(3) {
            for (k, lanes) in plain.iter().enumerate() {
                inputs[k] = lanes.map(|v| match k.checked_sub(first) {
                    Some(d) if d < 3 && k < axes => Dual::variable(v, d),
                    _ => dual(v),
                });
            }
            forward::<Dual<f64>, B>(tape, &wrapped, &inputs, &mut slots);
            reverse::<Dual<f64>, B, _>(tape, &wrapped, &slots, &mut adjoints, &mut Ignore);
            for i in 0..axes {
                for j in 0..n {
                    for d in 0..3.min(axes - first) {
                        let at = ((start + j) * axes + i) * axes + first + d;
                        out[at] = tape.input_slot(i).map_or(0.0, |slot| adjoints[slot][j].d[d]);
                    }
                }
            }
        }
        start += n;
    }
}

fn dual(v: f64) -> Dual<f64> {
    Dual { v, d: [0.0; 3] }
}
