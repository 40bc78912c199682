//! ∂F/∂q where a model is local: only what occurs near a point.

use std::cell::RefCell;

use rayon::prelude::*;

use super::Field;
use crate::arrange::Arrange;
use crate::bumps::{Sum, Terms};
use crate::closed::{Closer, Source};
use crate::kernel::{Batch, Columns, Want, run};
use crate::regions::{Leaf, RegionOptions, Whole};
use crate::surface::{Aabb, Parametric, Surface};
use crate::{FieldError, SparseRows};

/// Up to so many parameters all of ∂F/∂q is cheaper.
const FEW: usize = 256;
/// Most points that share a pruned tape. Pins are few and far from each other: what two of them need is far more than what each
/// does.
const LEAF: usize = 1;
/// Points that one task handles.
const CHUNK: usize = 16;
/// Cells of the curve along which points are put in order, for each axis.
const CELLS: f64 = 1024.0;

/// Marks parameters without a column.
const NONE: u32 = u32::MAX;

/// Where parameters go.
struct Table {
    values: Vec<f64>,
    /// The column of each parameter, or [`NONE`].
    columns: Vec<u32>,
    freedom: usize,
}

impl Table {
    fn new(field: &Field) -> Self {
        let (mut values, mut columns) = (Vec::new(), Vec::new());
        let mut freedom = 0;
        for p in &field.params {
            values.push(p.value);
            columns.push(if p.is_free() { freedom as u32 } else { NONE });
            freedom += usize::from(p.is_free());
        }
        Self { values, columns, freedom }
    }

    /// The column of a source.
    #[inline(always)]
    fn column(&self, source: Source) -> Option<u32> {
        let Source::Param(p) = source else { return None };
        Some(self.columns[p as usize]).filter(|&c| c != NONE)
    }
}

impl Field {
    /// See [`Parametric::sparse_parameter_gradient`]; `None` where all of ∂F/∂q is as cheap.
    pub(super) fn local_rows(
        &self,
        points: &[[f64; 3]],
        value: &mut [f64],
        gradient: &mut [[f64; 3]],
    ) -> Result<Option<SparseRows>, FieldError> {
        if self.components() != 1 || self.is_opaque() || points.is_empty() || self.freedom() <= FEW {
            return Ok(None);
        }
        if let Some(rows) = self.bump_rows(points, value, gradient)? {
            return Ok(Some(rows));
        }
        let tail = self.tail(points)?;
        Ok(Some(self.pruned_rows(points, tail, value, gradient)))
    }

    /// The rows of a sum of bumps, if it is one.
    pub(crate) fn bump_rows(
        &self,
        points: &[[f64; 3]],
        value: &mut [f64],
        gradient: &mut [[f64; 3]],
    ) -> Result<Option<SparseRows>, FieldError> {
        let (Some(sum), Some(terms)) = (self.bumps(), self.terms()) else { return Ok(None) };
        sum.value_gradient(points, value, gradient)?;
        Ok(Some(of_bumps(sum, terms, &Table::new(self), points)))
    }

    /// The rows by pruning; `tail` as in [`RegionOptions`].
    pub(crate) fn pruned_rows(
        &self,
        points: &[[f64; 3]],
        tail: f64,
        value: &mut [f64],
        gradient: &mut [[f64; 3]],
    ) -> SparseRows {
        of_regions(&self.whole(), &Table::new(self), points, tail, value, gradient)
    }

    /// The terms of the first component, if it is a sum.
    fn terms(&self) -> Option<&Terms> {
        self.compiled.terms.get_or_init(|| Terms::of(self.tape(0))).as_ref()
    }
}

/// The order of points along a Morton curve.
fn spatial_order(points: &[[f64; 3]]) -> Vec<u32> {
    let spread = |v: u64| (0..10).fold(0u64, |s, bit| s | (v >> bit & 1) << (3 * bit));
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    let Some(b) = Aabb::around(points) else { return order };
    let longest = (0..3).map(|a| b.hi[a] - b.lo[a]).fold(0.0, f64::max);
    let inverse = if longest > 0.0 { (CELLS - 1.0) / longest } else { 0.0 };
    let key = |p: &[f64; 3]| {
        // The cast saturates, and makes 0 of what is no number.
        (0..3).fold(0, |k, a| k | spread((((p[a] - b.lo[a]) * inverse) as u64).min(CELLS as u64 - 1)) << a)
    };
    let keys: Vec<u64> = points.iter().map(key).collect();
    order.arrange_by_key(|&i| keys[i as usize]);
    order
}

/// With tapes that are pruned around a few points each, and closed: what is left of the parameters are their inputs.
fn of_regions(
    whole: &Whole,
    table: &Table,
    points: &[[f64; 3]],
    tail: f64,
    value: &mut [f64],
    gradient: &mut [[f64; 3]],
) -> SparseRows {
    let order = spatial_order(points);
    let sorted: Vec<[f64; 3]> = order.iter().map(|&i| points[i as usize]).collect();
    let leaves = whole.tapes(&sorted, RegionOptions { leaf: LEAF, tail });
    let one = |leaf: &Leaf| {
        let part = &sorted[leaf.start..leaf.end];
        let n = part.len();
        let tape = leaf.tape.as_ref().unwrap_or(whole.tape);
        let all: Vec<u32> = (0..tape.len() as u32).collect();
        let piece = Closer::new(tape).close(&all, &[]);
        let count = piece.sources.len();
        let outputs: Vec<f64> =
            (0..n).flat_map(|_| piece.sources.iter().map(|s| s.value(&table.values))).collect();
        let batch = Batch { outputs: &outputs, leaves: count, ..Batch::of_points(part, whole.axes) };
        let (mut f, mut g, mut slopes) = (vec![0.0; n], vec![[0.0; 3]; n], vec![0.0; n * count]);
        let x = Columns { data: g.as_flattened_mut(), stride: 3 };
        let leaves = Columns { data: &mut slopes, stride: count };
        run(&piece.program(), &[], batch, &mut f, Want::Gradient { x, leaves });
        let columns: Vec<(usize, u32)> =
            piece.sources.iter().enumerate().filter_map(|(k, s)| Some((k, table.column(*s)?))).collect();
        let mut rows = SparseRows::new(table.freedom);
        if columns.is_empty() {
            (0..n).for_each(|_| rows.push_block(&[], &[]));
        } else {
            let list: Vec<u32> = columns.iter().map(|c| c.1).collect();
            let values: Vec<f64> = (0..n)
                .flat_map(|i| columns.iter().map(move |c| (i, c.0)))
                .map(|(i, k)| slopes[i * count + k])
                .collect();
            rows.push_block(&list, &values);
        }
        (rows, f, g)
    };
    let parts: Vec<(SparseRows, Vec<f64>, Vec<[f64; 3]>)> = leaves.par_iter().map(one).collect();
    let mut rows = SparseRows::new(table.freedom);
    let mut at = 0;
    for (part, f, g) in &parts {
        rows.append(part);
        for (f, g) in f.iter().zip(g) {
            let i = order[at] as usize;
            (value[i], gradient[i]) = (*f, *g);
            at += 1;
        }
    }
    rows.placed(&order)
}

/// From the bumps that count at each point.
fn of_bumps(sum: &Sum, terms: &Terms, table: &Table, points: &[[f64; 3]]) -> SparseRows {
    thread_local! {
        static WORK: RefCell<Pairs> = RefCell::new(Pairs::default());
    }
    let one = |points: &[[f64; 3]]| {
        let mut rows = SparseRows::new(table.freedom);
        WORK.with_borrow_mut(|work| {
            sum.exps(points, |start, end, exps| {
                let near = exps.iter().filter_map(|&e| terms.term(e)).chain(terms.everywhere.iter().copied());
                work.add_rows(terms, table, &points[start..end], near, &mut rows);
            });
        });
        rows
    };
    let parts: Vec<SparseRows> = points.par_chunks(CHUNK).map(one).collect();
    let mut rows = SparseRows::new(table.freedom);
    parts.iter().for_each(|p| rows.append(p));
    rows
}

/// Working memory for pairs of points and terms.
#[derive(Default)]
struct Pairs {
    /// Place of each column among those of the present run.
    place: Vec<u32>,
    columns: Vec<u32>,
    /// Terms in the order of their shapes.
    near: Vec<(u32, u32)>,
    points: Vec<[f64; 3]>,
    outputs: Vec<f64>,
    slopes: Vec<f64>,
    value: Vec<f64>,
    gradient: Vec<[f64; 3]>,
    values: Vec<f64>,
}

impl Pairs {
    /// Adds the rows of some points at which these terms count.
    fn add_rows(
        &mut self,
        terms: &Terms,
        table: &Table,
        points: &[[f64; 3]],
        near: impl Iterator<Item = u32>,
        rows: &mut SparseRows,
    ) {
        if self.place.len() < table.freedom {
            self.place.resize(table.freedom, NONE);
        }
        self.near.clear();
        self.near.extend(near.map(|t| (terms.shape(t) as u32, t)));
        self.near.arrange_by_key(|n| n.0);
        self.columns.clear();
        for &(_, term) in &self.near {
            for column in terms.sources(term).iter().filter_map(|s| table.column(*s)) {
                let place = &mut self.place[column as usize];
                if *place == NONE {
                    *place = self.columns.len() as u32;
                    self.columns.push(column);
                }
            }
        }
        self.values.clear();
        self.values.resize(points.len() * self.columns.len(), 0.0);
        let near = std::mem::take(&mut self.near);
        for same in near.chunk_by(|a, b| a.0 == b.0) {
            self.run(terms, table, points, same);
        }
        self.near = near;
        if self.columns.is_empty() {
            points.iter().for_each(|_| rows.push_block(&[], &[]));
        } else {
            rows.push_block(&self.columns, &self.values);
        }
        self.columns.iter().for_each(|&c| self.place[c as usize] = NONE);
    }

    /// Terms of one shape at all of the points.
    fn run(&mut self, terms: &Terms, table: &Table, points: &[[f64; 3]], same: &[(u32, u32)]) {
        let (program, count) = &terms.shapes[same[0].0 as usize];
        let pairs = points.len() * same.len();
        self.points.clear();
        self.outputs.clear();
        for &p in points {
            for &(_, term) in same {
                self.points.push(p);
                self.outputs.extend(terms.sources(term).iter().map(|s| s.value(&table.values)));
            }
        }
        self.value.resize(pairs, 0.0);
        self.gradient.resize(pairs, [0.0; 3]);
        self.slopes.resize(pairs * count, 0.0);
        let batch = Batch { outputs: &self.outputs, leaves: *count, ..Batch::of_points(&self.points, 3) };
        let x = Columns { data: self.gradient[..pairs].as_flattened_mut(), stride: 3 };
        let leaves = Columns { data: &mut self.slopes[..pairs * count], stride: *count };
        run(program, &[], batch, &mut self.value[..pairs], Want::Gradient { x, leaves });
        let width = self.columns.len();
        let mut slopes = self.slopes.chunks_exact((*count).max(1));
        for row in self.values.chunks_exact_mut(width.max(1)) {
            for (&(_, term), slopes) in same.iter().zip(&mut slopes) {
                for (source, slope) in terms.sources(term).iter().zip(slopes) {
                    if let Some(column) = table.column(*source) {
                        row[self.place[column as usize] as usize] += slope;
                    }
                }
            }
        }
    }
}
