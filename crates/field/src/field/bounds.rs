//! The search for a box around the whole surface.

use super::Field;
use super::cells::excludes;
use super::minorant::minorant;
use crate::model::{Model, Payload, guarded};
use crate::regions::Whole;
use crate::surface::{Aabb, Surface};

/// Cubes of half-side 2^FIRST to 2^LAST are tried,
const FIRST: i32 = -20;
const LAST: i32 = 40;
/// and where half-spaces are, which is quick, 2^SMALLEST to 2^LARGEST: squares and cubes of these are numbers still.
const SMALLEST: i32 = -500;
const LARGEST: i32 = 340;
/// Where nothing is known of infinity, this many doublings without a zero count as the end of the surface.
const EMPTY_SHELLS: i32 = 6;
/// Most rounds over the axes in which half-spaces are taken off.
const ROUNDS: usize = 4;

/// A box that contains every zero of F; `None` where the search finds no end, or the field is opaque and its
/// functions state no bounds.
pub(super) fn find(field: &Field) -> Option<Aabb> {
    if field.is_opaque() {
        return of_tree(&field.current_model().ok()?);
    }
    if field.components() != 1 {
        return None;
    }
    let whole = field.whole();
    if let Some(half) = by_half_spaces(&whole) {
        return tightened(field, cube(&whole, half));
    }
    let within = contracted(&whole);
    if (0..whole.axes).all(|a| within.lo[a].is_finite() && within.hi[a].is_finite()) {
        return tightened(field, within);
    }
    if let Some(b) = below_zero(field) {
        return tightened(field, common(&b, &within));
    }
    let half = by_shells(&whole, &within)?;
    tightened(field, common(&cube(&whole, half), &within))
}

/// A box outside which a function that is nowhere above F is positive.
fn below_zero(field: &Field) -> Option<Aabb> {
    let least = Field::new(&minorant(&field.current_model().ok()?)?).ok()?;
    let found = find(&least)?;
    // Without zeros outside it has one sign there.
    let far: Vec<f64> =
        (0..least.axes()).map(|a| 2.0 * found.hi[a].abs().max(found.lo[a].abs()) + 1.0).collect();
    let mut value = [0.0];
    least.value(&far, &mut value).ok()?;
    (value[0] > 0.0).then_some(found)
}

/// What both boxes contain.
fn common(a: &Aabb, b: &Aabb) -> Aabb {
    Aabb::new([0, 1, 2].map(|k| a.lo[k].max(b.lo[k])), [0, 1, 2].map(|k| a.hi[k].min(b.hi[k])))
}

/// A box, infinite along some axes perhaps, that contains all zeros: half-spaces are taken off, one axis after the other, each
/// within what the others have left. A twist, taper or bend keeps the height along its axis; once that is bounded so are its
/// angles and factors.
fn contracted(whole: &Whole) -> Aabb {
    let mut b = cube(whole, f64::INFINITY);
    for _ in 0..ROUNDS {
        let before = b;
        for (axis, upper) in (0..whole.axes).flat_map(|a| [(a, true), (a, false)]) {
            let free = |power: i32| {
                let (mut part, half) = (b, 2f64.powi(power));
                if upper {
                    part.lo[axis] = part.lo[axis].max(half)
                } else {
                    part.hi[axis] = part.hi[axis].min(-half)
                }
                part.lo[axis] >= part.hi[axis] || excludes(whole, &part)
            };
            let Some(half) = smallest(free) else { continue };
            if upper { b.hi[axis] = b.hi[axis].min(half) } else { b.lo[axis] = b.lo[axis].max(-half) }
        }
        if b == before {
            break;
        }
    }
    b
}

/// From what opaque functions state of themselves, through the operators around them; `None` for operators that
/// are not among these.
fn of_tree(model: &Model) -> Option<Aabb> {
    let (model, operands) = model.shown();
    if let Payload::Callback(f) = model.payload() {
        return f.bounds();
    }
    let has_function =
        |m: &Model| m.nodes().iter().any(|n| matches!(n.model().payload(), Payload::Callback(_)));
    if !has_function(model) {
        // One within a formula is none of the operators.
        return Field::new(model).ok().filter(|f| !f.is_opaque()).and_then(|f| find(&f));
    }
    let value = |name: &str| {
        let p = model.params().iter().find(|p| *p.name == *name)?;
        p.expr.is_none().then_some(p.value)
    };
    let mut parts = operands.into_iter().map(|m| guarded(|| of_tree(m)));
    match model.kind().name {
        "union" => {
            let all: Option<Vec<Aabb>> = parts.collect();
            Aabb::around(&all?.iter().flat_map(|b| [b.lo, b.hi]).collect::<Vec<_>>())
        }
        // One that is known is enough.
        "intersection" => parts.flatten().next(),
        "difference" | "complement" => parts.next()?,
        "planar" => {
            let b = parts.next()??;
            Some(Aabb::new([b.lo[0], b.lo[1], 0.0], [b.hi[0], b.hi[1], 0.0]))
        }
        "translate" => {
            let (b, by) = (parts.next()??, [value("x")?, value("y")?, value("z")?]);
            Some(Aabb::new([0, 1, 2].map(|a| b.lo[a] + by[a]), [0, 1, 2].map(|a| b.hi[a] + by[a])))
        }
        "scale" => {
            let (b, by) = (parts.next()??, model.params().first().filter(|p| p.expr.is_none())?.value);
            let ends = |a: usize| [b.lo[a] * by, b.hi[a] * by];
            let (lo, hi) = (
                [0, 1, 2].map(|a| ends(a)[0].min(ends(a)[1])),
                [0, 1, 2].map(|a| ends(a)[0].max(ends(a)[1])),
            );
            Some(Aabb::new(lo, hi))
        }
        "rotate" | "rotate_euler" => {
            let b = parts.next()??;
            let far: f64 = (0..3).map(|a| b.lo[a].abs().max(b.hi[a].abs()).powi(2)).sum();
            let r = far.sqrt();
            Some(Aabb::new([-r; 3], [r; 3]))
        }
        _ => None,
    }
}

fn cube(whole: &Whole, half: f64) -> Aabb {
    let side = |v: f64| std::array::from_fn(|a| if a < whole.axes { v } else { 0.0 });
    Aabb::new(side(-half), side(half))
}

/// The smallest cube outside which intervals with infinite ends exclude zeros: a proof.
fn by_half_spaces(whole: &Whole) -> Option<f64> {
    let outside_is_free = |half: f64| {
        (0..whole.axes).all(|axis| {
            [(half, f64::INFINITY), (f64::NEG_INFINITY, -half)].into_iter().all(|(lo, hi)| {
                let Aabb { lo: mut from, hi: mut to } = cube(whole, f64::INFINITY);
                (from[axis], to[axis]) = (lo, hi);
                excludes(whole, &Aabb::new(from, to))
            })
        })
    };
    smallest(|power| outside_is_free(2f64.powi(power)))
}

/// The smallest power of two that is `free`, where all larger ones are too.
fn smallest(free: impl Fn(i32) -> bool) -> Option<f64> {
    // Where the largest overflow.
    let mut high = [LAST, LARGEST].into_iter().find(|power| free(*power))?;
    let mut low = SMALLEST;
    while low < high {
        let middle = (low + high).div_euclid(2);
        if free(middle) { high = middle } else { low = middle + 1 }
    }
    Some(2f64.powi(high))
}

/// The cube before a run of shells in which finite boxes exclude zeros: evidence, not a proof. No zero is outside `within`.
fn by_shells(whole: &Whole, within: &Aabb) -> Option<f64> {
    // Long tapes get fewer boxes, so that the search stays within a fraction of a second.
    let mut budget = (100_000_000 / whole.tape.len().max(1)).clamp(2_000, 200_000);
    let mut empty = 0;
    let mut inner_has_any = false;
    for k in FIRST / 2..=LAST / 2 {
        let half = 2f64.powi(k);
        match shell_is_free(whole, half, within, &mut budget) {
            true => empty += 1,
            false => {
                empty = 0;
                inner_has_any = true;
            }
        }
        if budget == 0 {
            return None;
        }
        if inner_has_any && empty == EMPTY_SHELLS {
            return Some(2f64.powi(k - EMPTY_SHELLS + 1));
        }
    }
    None
}

/// Whether F has no zero between the cubes of half-side `half` and `2 half`.
fn shell_is_free(whole: &Whole, half: f64, within: &Aabb, budget: &mut usize) -> bool {
    let mut open = Vec::new();
    let parts = 4usize.pow(whole.axes as u32);
    for i in 0..parts {
        let at = |a: usize| i / 4usize.pow(a as u32) % 4;
        if (0..whole.axes).all(|a| (1..=2).contains(&at(a))) {
            continue;
        }
        let from = |offset: f64| {
            std::array::from_fn(|a| if a < whole.axes { (at(a) as f64 - 2.0 + offset) * half } else { 0.0 })
        };
        let part = common(&Aabb::new(from(0.0), from(1.0)), within);
        if (0..whole.axes).all(|a| part.lo[a] <= part.hi[a]) {
            open.push((part, 0));
        }
    }
    while let Some((b, depth)) = open.pop() {
        if *budget == 0 {
            return false;
        }
        *budget -= 1;
        if excludes(whole, &b) {
            continue;
        }
        if depth == 4 {
            return false;
        }
        for i in 0..1usize << whole.axes {
            let mut part = b;
            for a in 0..whole.axes {
                let middle = 0.5 * (b.lo[a] + b.hi[a]);
                if i >> a & 1 == 0 { part.hi[a] = middle } else { part.lo[a] = middle }
            }
            open.push((part, depth + 1));
        }
    }
    true
}

/// The hull of the boxes that may contain zeros, found again at ever finer scale, with a small margin.
fn tightened(field: &Field, mut bounds: Aabb) -> Option<Aabb> {
    for _ in 0..24 {
        let side = (0..3).map(|a| bounds.hi[a] - bounds.lo[a]).fold(0.0, f64::max);
        let cells = field.cells(&bounds, side / 32.0, 1 << 14)?;
        let corners: Vec<[f64; 3]> = cells.boxes.iter().flat_map(|b| [b.lo, b.hi]).collect();
        // Nothing left: the surface is empty, and any box contains it; one that a person can read.
        let Some(hull) = Aabb::around(&corners) else { return Some(cube(&field.whole(), 1.0)) };
        let done = hull.diagonal() > 0.8 * bounds.diagonal();
        bounds = hull;
        if done {
            break;
        }
    }
    let mut grown = bounds.grown(0.01 * bounds.diagonal());
    if field.axes() == 2 {
        (grown.lo[2], grown.hi[2]) = (0.0, 0.0);
    }
    Some(grown)
}
