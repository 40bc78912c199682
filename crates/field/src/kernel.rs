//! Runs tapes over batches of points: gathers blocks, calls the sweeps under the widest vectors that the machine
//! has, scatters the results. One thread; [`crate::field`] and [`crate::regions`] spread batches over threads.

use std::cell::RefCell;

use pulp::{Arch, NullaryFnOnce};

use crate::arrange::Arrange;
use crate::dual::Dual;
use crate::eval::{
    Any, Chosen, Directional, Everywhere, Full, Ignore, NO_ROW, forward, reverse, reverse_uniforms,
};
use crate::program::Program;
use crate::tape::{Uniform, UniformProgram};
use crate::{MAX_AXES, SMALL, one};

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
    fn gather<const B: usize>(&self, program: &Program, start: usize, n: usize, inputs: &mut [[f64; B]]) {
        for &number in &program.inputs {
            let k = number as usize;
            let (data, stride, offset) = if k < MAX_AXES {
                (self.points, self.stride, k)
            } else {
                (self.outputs, self.leaves, k - MAX_AXES)
            };
            let lane = &mut inputs[k];
            let rows = &data[start * stride..(start + n) * stride];
            if stride == 3 && offset < 3 {
                // The usual case, with a stride that the compiler knows.
                for (v, row) in lane[..n].iter_mut().zip(rows.as_chunks::<3>().0) {
                    *v = row[offset];
                }
            } else {
                for (v, row) in lane[..n].iter_mut().zip(rows.chunks_exact(stride)) {
                    *v = row[offset];
                }
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

/// Lends `n` numbers of working memory, with arbitrary content, from the start of a cache line: vectors that cross
/// from one line into the next take twice the time.
fn with_scratch<R>(n: usize, f: impl FnOnce(&mut [f64]) -> R) -> R {
    const LINE: usize = 64;
    SCRATCH.with_borrow_mut(|v| {
        let slack = LINE / size_of::<f64>();
        if v.len() < n + slack {
            v.resize(n + slack, 0.0);
        }
        let skip = v.as_ptr().align_offset(LINE).min(slack);
        f(&mut v[skip..skip + n])
    })
}

/// Points of a block. Shorter blocks spend their time on fetching instructions, longer ones leave the cache; every
/// further length would cost a copy of all loops.
const BLOCK: usize = 64;

/// Up to so many points, such as a few control points, are one block of this length: full blocks would mostly repeat the last.
const FEW: usize = 16;

/// What a run computes besides F.
pub(crate) enum Want<'a, 'b> {
    /// F only.
    Value,
    /// ∂F/∂x: `axes` numbers a point, and ∂F/∂(leaf outputs).
    Gradient { x: Columns<'a>, leaves: Columns<'a> },
    /// ∂F/∂x, `axes` numbers a point, without what no minimum or maximum takes in a block of points. Where that
    /// has infinite derivatives, a point's result (0 or NaN) depends on its neighbours.
    Chosen { x: Columns<'a> },
    /// Value, gradients and (∂F/∂q)·q̇, given the rates of the uniforms.
    Rate { x: Columns<'a>, leaves: Columns<'a>, rates: &'b [f64], rate: &'a mut [f64] },
    /// The same and all of ∂F/∂q.
    Parameters { x: Columns<'a>, leaves: Columns<'a>, rows: &'b Rows<'b>, q: Columns<'a> },
}

/// Which rows of adjoints belong to which uniform, and which parameter is which row.
pub(crate) struct Rows<'a> {
    /// The uniforms themselves.
    pub program: &'a [Uniform],
    /// Row of each uniform, or [`NO_ROW`].
    pub row_of: Vec<u32>,
    /// Number of rows.
    pub count: usize,
    /// (column of the result, row) for each free parameter that F depends on.
    pub columns: Vec<(usize, usize)>,
    /// Columns of free parameters that F does not depend on.
    pub absent: Vec<usize>,
}

impl<'a> Rows<'a> {
    /// `column_of[p]` is the column of parameter p in the result, or `None` if it is frozen.
    pub(crate) fn new(uniforms: &'a UniformProgram, column_of: &[Option<usize>]) -> Self {
        let mut rows = Rows {
            program: &uniforms.list,
            row_of: Vec::new(),
            count: 0,
            columns: Vec::new(),
            absent: Vec::new(),
        };
        for u in &uniforms.list {
            let active = match *u {
                Uniform::Const(_) => false,
                Uniform::Param(p) => column_of[p as usize].is_some(),
                Uniform::Op(op, args) => {
                    args[..op.arity()].iter().any(|&a| rows.row_of[a as usize] != NO_ROW)
                }
            };
            if let (true, Uniform::Param(p)) = (active, *u) {
                rows.columns.push((column_of[p as usize].unwrap_or(0), rows.count));
            }
            rows.row_of.push(if active { rows.count as u32 } else { NO_ROW });
            rows.count += usize::from(active);
        }
        rows.columns.arrange();
        let present = |column: &usize| rows.columns.binary_search_by_key(column, |c| c.0).is_ok();
        rows.absent = column_of.iter().flatten().copied().filter(|c| !present(c)).collect();
        rows
    }
}

/// Evaluates the program at all points of the batch, on this thread. `Want::Parameters` needs a program for
/// everything, `Want::Rate` too.
pub(crate) fn run(program: &Program, uniforms: &[f64], batch: Batch, value: &mut [f64], want: Want) {
    if SMALL {
        return run_once(program, uniforms, batch, value, want);
    }
    let n = batch.len();
    if n == 0 {
        return;
    }
    let lines = lines(program, batch, &want);
    let arch = Arch::new();
    match want {
        Want::Value | Want::Gradient { .. } | Want::Rate { .. } | Want::Parameters { .. } if n <= FEW => {
            with_scratch(lines * FEW, |scratch| {
                arch.dispatch(Run::<FEW, true> { program, uniforms, batch, value, want, scratch });
            })
        }
        Want::Value | Want::Gradient { .. } | Want::Chosen { .. } => with_scratch(lines * BLOCK, |scratch| {
            arch.dispatch(Run::<BLOCK, false> { program, uniforms, batch, value, want, scratch });
        }),
        _ => with_scratch(lines * BLOCK, |scratch| {
            arch.dispatch(Run::<BLOCK, true> { program, uniforms, batch, value, want, scratch });
        }),
    }
}

/// The same by the one loop for everything.
fn run_once(program: &Program, uniforms: &[f64], batch: Batch, value: &mut [f64], want: Want) {
    with_scratch(lines(program, batch, &want) * BLOCK, |scratch| {
        Arch::new().dispatch(RunAny { program, uniforms, batch, value, want, scratch });
    });
}

/// Blocks of working memory.
fn lines(program: &Program, batch: Batch, want: &Want) -> usize {
    let rows = if let Want::Parameters { rows, .. } = want { rows.count } else { 0 };
    MAX_AXES + batch.leaves + program.values + program.adjoints + rows
}

/// The loop over blocks; `Q`: with derivatives with respect to parameters.
struct Run<'a, 'b, 'c, const B: usize, const Q: bool> {
    program: &'c Program,
    uniforms: &'c [f64],
    batch: Batch<'c>,
    value: &'c mut [f64],
    want: Want<'a, 'b>,
    scratch: &'c mut [f64],
}

impl<const B: usize, const Q: bool> NullaryFnOnce for Run<'_, '_, '_, B, Q> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Run { program, uniforms, batch, value, mut want, scratch } = self;
        let (blocks, _) = scratch.as_chunks_mut::<B>();
        let (inputs, blocks) = blocks.split_at_mut(MAX_AXES + batch.leaves);
        let (registers, rest) = blocks.split_at_mut(program.values);
        let (adjoints, table) = rest.split_at_mut(program.adjoints);
        let mut touched = vec![false; table.len()];
        let chosen = matches!(want, Want::Chosen { .. });
        let mut live = vec![true; if Q { 0 } else { program.adjoints }];
        let total = batch.len();
        let mut start = 0;
        while start < total {
            let n = B.min(total - start);
            batch.gather(program, start, n, inputs);
            forward::<f64, B>(program, uniforms, inputs, registers);
            value[start..start + n].copy_from_slice(&registers[program.root as usize][..n]);
            match &mut want {
                Want::Gradient { .. } | Want::Chosen { .. } if !Q => {
                    live.fill(!chosen);
                    let mut reach = Chosen { live: &mut live, on: chosen };
                    reverse::<f64, B, _, _>(program, uniforms, registers, adjoints, &mut Ignore, &mut reach);
                    for &(_, register) in &program.input_adjoints {
                        if !live[register as usize] {
                            adjoints[register as usize] = [0.0; B];
                        }
                    }
                    if let Want::Gradient { x, leaves } = &mut want {
                        scatter(program, adjoints, batch.axes, (start, n), x, leaves);
                    } else if let Want::Chosen { x } = &mut want {
                        scatter_inputs(program, adjoints, 0, batch.axes, (start, n), x);
                    }
                }
                Want::Gradient { x, leaves } if Q => {
                    // The sink of `Want::Rate` that takes nothing, which spares another copy of all loops.
                    let mut sink = Directional { rates: &[], total: [0.0; B] };
                    reverse::<f64, B, _, _>(
                        program,
                        uniforms,
                        registers,
                        adjoints,
                        &mut sink,
                        &mut Everywhere,
                    );
                    scatter(program, adjoints, batch.axes, (start, n), x, leaves);
                }
                Want::Rate { x, leaves, rates, rate } if Q => {
                    let mut sink = Directional { rates, total: [0.0; B] };
                    reverse::<f64, B, _, _>(
                        program,
                        uniforms,
                        registers,
                        adjoints,
                        &mut sink,
                        &mut Everywhere,
                    );
                    scatter(program, adjoints, batch.axes, (start, n), x, leaves);
                    rate[start..start + n].copy_from_slice(&sink.total[..n]);
                }
                Want::Parameters { x, leaves, rows, q } if Q => {
                    touched.fill(false);
                    let mut sink = Full { row_of: &rows.row_of, rows: &mut *table, touched: &mut touched };
                    reverse::<f64, B, _, _>(
                        program,
                        uniforms,
                        registers,
                        adjoints,
                        &mut sink,
                        &mut Everywhere,
                    );
                    reverse_uniforms::<B>(rows.program, uniforms, &mut sink);
                    scatter(program, adjoints, batch.axes, (start, n), x, leaves);
                    for &(_, row) in &rows.columns {
                        if !touched[row] {
                            table[row] = [0.0; B];
                        }
                    }
                    scatter_parameters(rows, table, (start, n), q);
                }
                _ => {}
            }
            start += n;
        }
    }
}

/// The loop over blocks in one copy for everything that can be wanted, for modules that are downloaded.
struct RunAny<'a, 'b, 'c> {
    program: &'c Program,
    uniforms: &'c [f64],
    batch: Batch<'c>,
    value: &'c mut [f64],
    want: Want<'a, 'b>,
    scratch: &'c mut [f64],
}

impl NullaryFnOnce for RunAny<'_, '_, '_> {
    type Output = ();

    fn call(self) {
        const B: usize = BLOCK;
        let RunAny { program, uniforms, batch, value, mut want, scratch } = self;
        let (blocks, _) = scratch.as_chunks_mut::<B>();
        let (inputs, blocks) = blocks.split_at_mut(MAX_AXES + batch.leaves);
        let (registers, rest) = blocks.split_at_mut(program.values);
        let (adjoints, table) = rest.split_at_mut(program.adjoints);
        let mut touched = vec![false; table.len()];
        let chosen = matches!(want, Want::Chosen { .. });
        let mut live = vec![true; program.adjoints];
        let total = batch.len();
        for start in (0..total).step_by(B) {
            let n = B.min(total - start);
            let span = (start, n);
            batch.gather(program, start, n, inputs);
            forward::<f64, B>(program, uniforms, inputs, registers);
            value[start..start + n].copy_from_slice(&registers[program.root as usize][..n]);
            if matches!(want, Want::Value) {
                continue;
            }
            live.fill(!chosen);
            touched.fill(false);
            let mut reach = Chosen { live: &mut live, on: chosen };
            let mut sink = Any { rates: &[], total: [0.0; B], full: None };
            match &want {
                Want::Rate { rates, .. } => sink.rates = rates,
                Want::Parameters { rows, .. } => {
                    let row_of = &rows.row_of;
                    sink.full = Some(Full { row_of, rows: &mut *table, touched: &mut touched });
                }
                _ => {}
            }
            reverse::<f64, B, _, _>(program, uniforms, registers, adjoints, &mut sink, &mut reach);
            for &(_, register) in &program.input_adjoints {
                if !live[register as usize] {
                    adjoints[register as usize] = [0.0; B];
                }
            }
            if let (Want::Parameters { rows, .. }, Some(full)) = (&want, &mut sink.full) {
                reverse_uniforms::<B>(rows.program, uniforms, full);
            }
            let sums = sink.total;
            match &mut want {
                Want::Chosen { x } => scatter_inputs(program, adjoints, 0, batch.axes, span, x),
                Want::Gradient { x, leaves }
                | Want::Rate { x, leaves, .. }
                | Want::Parameters { x, leaves, .. } => {
                    scatter(program, adjoints, batch.axes, span, x, leaves);
                }
                Want::Value => {}
            }
            if let Want::Rate { rate, .. } = &mut want {
                rate[start..start + n].copy_from_slice(&sums[..n]);
            }
            if let Want::Parameters { rows, q, .. } = &mut want {
                for &(_, row) in &rows.columns {
                    if !touched[row] {
                        table[row] = [0.0; B];
                    }
                }
                scatter_parameters(rows, table, span, q);
            }
        }
    }
}

/// Writes the rows of adjoints, in tiles, so that each cache line is written whole.
#[inline(always)]
fn scatter_parameters<const B: usize>(
    rows: &Rows,
    table: &[[f64; B]],
    (start, n): (usize, usize),
    q: &mut Columns<'_>,
) {
    let target = &mut q.data[start * q.stride..(start + n) * q.stride];
    for tile in rows.columns.chunks(8) {
        for (j, line) in target.chunks_exact_mut(q.stride).enumerate() {
            for &(column, row) in tile {
                line[column] = table[row][j];
            }
        }
    }
    for &column in &rows.absent {
        for line in target.chunks_exact_mut(q.stride) {
            line[column] = 0.0;
        }
    }
}

/// Writes the adjoints of the coordinates and of the leaf outputs to where they are wanted.
#[inline(always)]
fn scatter<const B: usize>(
    program: &Program,
    adjoints: &[[f64; B]],
    axes: usize,
    span: (usize, usize),
    x: &mut Columns<'_>,
    leaves: &mut Columns<'_>,
) {
    scatter_inputs(program, adjoints, 0, axes, span, x);
    scatter_inputs(program, adjoints, MAX_AXES, leaves.stride, span, leaves);
}

#[inline(always)]
fn scatter_inputs<const B: usize>(
    program: &Program,
    adjoints: &[[f64; B]],
    first: usize,
    count: usize,
    (start, n): (usize, usize),
    columns: &mut Columns<'_>,
) {
    let target = &mut columns.data[start * columns.stride..(start + n) * columns.stride];
    if columns.stride == 3 && count == 3 {
        // The usual case, with a stride that the compiler knows.
        let zero = [0.0; B];
        let [x, y, z] = [0, 1, 2].map(|k| program.input_adjoint(first + k).map_or(&zero, |r| &adjoints[r]));
        for (j, point) in target.as_chunks_mut::<3>().0.iter_mut().enumerate().take(B) {
            *point = [x[j], y[j], z[j]];
        }
        return;
    }
    for k in 0..count {
        let register = program.input_adjoint(first + k);
        for (j, point) in target.chunks_exact_mut(columns.stride).enumerate() {
            point[k] = register.map_or(0.0, |r| adjoints[r][j]);
        }
    }
}

/// Second derivatives for up to three axes: `hessian[i][j]` of each point, row-major (axes × axes).
pub(crate) fn hessian(program: &Program, uniforms: &[f64], batch: Batch, out: &mut [f64]) {
    if SMALL {
        return hessian_by::<1>(program, uniforms, batch, out);
    }
    hessian_by::<8>(program, uniforms, batch, out);
}

/// The same, `B` points at a time; one by one in the little code of [`crate::one`].
fn hessian_by<const B: usize>(program: &Program, uniforms: &[f64], batch: Batch, out: &mut [f64]) {
    let axes = batch.axes;
    let wrapped: Vec<Dual<f64>> = uniforms.iter().map(|&u| dual(u)).collect();
    let zero = [dual(0.0); B];
    let mut inputs = vec![zero; MAX_AXES + batch.leaves];
    let mut registers = vec![zero; program.values];
    let mut adjoints = vec![zero; program.adjoints];
    let mut plain = vec![[0.0; B]; inputs.len()];
    let mut start = 0;
    while start < batch.len() {
        let n = B.min(batch.len() - start);
        batch.gather(program, start, n, &mut plain);
        // Three directions at a time; more axes take more passes.
        for first in (0..axes).step_by(3) {
            for (k, lanes) in plain.iter().enumerate() {
                inputs[k] = lanes.map(|v| match k.checked_sub(first) {
                    Some(d) if d < 3 && k < axes => Dual::variable(v, d),
                    _ => dual(v),
                });
            }
            if B == 1 {
                one::forward(program, &wrapped, inputs.as_flattened(), registers.as_flattened_mut());
                let (values, adjoints) = (registers.as_flattened(), adjoints.as_flattened_mut());
                one::reverse(program, &wrapped, values, adjoints);
            } else {
                forward::<Dual<f64>, B>(program, &wrapped, &inputs, &mut registers);
                reverse::<Dual<f64>, B, _, _>(
                    program,
                    &wrapped,
                    &registers,
                    &mut adjoints,
                    &mut Ignore,
                    &mut Everywhere,
                );
            }
            for i in 0..axes {
                for j in 0..n {
                    for d in 0..3.min(axes - first) {
                        let at = ((start + j) * axes + i) * axes + first + d;
                        out[at] = program.input_adjoint(i).map_or(0.0, |r| adjoints[r][j].d[d]);
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

#[cfg(test)]
mod tests;
