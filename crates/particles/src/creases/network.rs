//! From boxes that may hold creases to whole curves and the corners where they meet.

use isoswarm_field::FieldError;
use isoswarm_field::switches::{Desk, SwitchBox};
use rayon::prelude::*;
use std::collections::HashMap;

use super::sides;
use super::solve::{Condition, OnCurve, Search};
use super::trace::{End, Knot, Tracer};
use crate::neighbors::Grid;
use crate::vector::{V3, along, distance, dot, norm, sub, unit};

/// Boxes that one task starts from.
const TASK: usize = 8;
/// Half the sides of a box by which it is grown for the search in it.
const MARGIN: f64 = 0.5;
/// Where points of creases are looked for from, in sides of a box from its middle: both sides of a thin part may be creases of one switch.
const STARTS: [V3; 5] =
    [[0.0; 3], [0.25, 0.25, 0.25], [0.25, -0.25, -0.25], [-0.25, 0.25, -0.25], [-0.25, -0.25, 0.25]];
/// Distance between such points, in sides of a box, up to which one is enough.
const NEAR: f64 = 0.1;
/// Distance between corners, in longest steps, up to which they are one.
const ONE_CORNER: f64 = 1e-6;
/// The same for an end that no other line shares.
const LOOSE: f64 = 1e-3;
/// Distance from a corner, in longest steps, at which creases that start there are looked for.
const SPROUT: f64 = 2e-3;

/// A crease from end to end, or a closed one, which does not repeat its first knot.
#[derive(Clone, Debug)]
pub(super) struct Line {
    /// The switch that it is the crease of.
    pub(super) switch: u32,
    pub(super) knots: Vec<Knot>,
    /// How it begins and ends; `None` where it is closed.
    pub(super) ends: Option<[End; 2]>,
}

/// All creases.
#[derive(Default)]
pub(super) struct Network {
    pub(super) lines: Vec<Line>,
    /// Places where the search gave up.
    pub(super) doubts: usize,
    /// Traced segments by the cell of their middle: line and number of the knot they begin at.
    index: HashMap<[i64; 3], Vec<(u32, u32)>>,
}

/// What comes of a seed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Growth {
    /// It is on a crease that is known, or on none.
    None,
    /// A line.
    Line,
    /// It is on a crease that could not be followed to its ends.
    Lost,
}

/// Points where F and all squares under a root are 0, each once.
pub(super) fn tips(tracer: &mut Tracer<'_>, boxes: &[SwitchBox]) -> Result<Vec<V3>, FieldError> {
    let mut found: Vec<V3> = Vec::new();
    for b in boxes {
        let grown = b.bounds.grown(MARGIN * b.bounds.diagonal());
        let middle = b.bounds.middle();
        for &root in &b.tips {
            let squares = tracer.solver.switches.squares(root);
            let conditions: Vec<Condition> = squares.into_iter().map(Condition::Switch).collect();
            let search = Search { route: &tracer.solver.everywhere, reach: grown.diagonal() };
            let Some((p, _)) = tracer.solver.solve(&search, middle, &conditions, 3, &mut tracer.desk) else {
                continue;
            };
            let near = |q: &V3| distance(*q, p) <= ONE_CORNER * tracer.step;
            if !grown.contains(p) || !tracer.bounds.contains(p) || found.iter().any(near) {
                continue;
            }
            if sides::is_tip(tracer.surface, &mut tracer.evaluations, p, tracer.radius, tracer.least)? {
                found.push(p);
            }
        }
    }
    Ok(found)
}

/// A point to trace from.
struct Seed {
    switch: u32,
    at: OnCurve,
}

/// Points of F = G = 0 from every box, in the order of the boxes.
fn seeds(tracer: &Tracer<'_>, boxes: &[SwitchBox]) -> Vec<Seed> {
    let start = |chunk: &[SwitchBox]| -> Vec<Seed> {
        let grown: Vec<_> = chunk
            .iter()
            .map(|b| {
                let side = (0..3).map(|a| b.bounds.hi[a] - b.bounds.lo[a]).fold(0.0, f64::max);
                b.bounds.grown(MARGIN * side)
            })
            .collect();
        let routes = tracer.solver.switches.routes(&grown);
        let (mut desk, mut found) = (Desk::default(), Vec::new());
        for ((b, grown), route) in chunk.iter().zip(&grown).zip(&routes) {
            let middle = b.bounds.middle();
            let search = Search { route, reach: 0.5 * grown.diagonal() };
            let side = [0, 1, 2].map(|a| b.bounds.hi[a] - b.bounds.lo[a]);
            for &switch in &b.switches {
                let first = found.len();
                for start in STARTS {
                    let from = [0, 1, 2].map(|a| middle[a] + start[a] * side[a]);
                    let Some(at) = tracer.solver.on_curve(&search, from, switch, &mut desk) else { continue };
                    let known = |s: &Seed| distance(s.at.p, at.p) <= NEAR * side[0];
                    let there = grown.contains(at.p) && tracer.bounds.contains(at.p);
                    if there && !found[first..].iter().any(known) {
                        found.push(Seed { switch, at });
                    }
                }
            }
        }
        found
    };
    let parts: Vec<Vec<Seed>> = boxes.par_chunks(TASK).map(start).collect();
    parts.into_iter().flatten().collect()
}

/// Finds and follows all creases that pass through the boxes.
pub(super) fn find(
    tracer: &mut Tracer<'_>,
    boxes: &[SwitchBox],
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<Option<Network>, FieldError> {
    let mut network = Network::default();
    let seeds = seeds(tracer, boxes);
    // Of the switches that are equal on a crease some may coincide with F on one side of it, where it cannot be followed by
    // them: first those that lead to its ends.
    let mut late = Vec::new();
    for (k, seed) in seeds.iter().enumerate() {
        if k % 64 == 0 && !go_on(k as f64 / seeds.len() as f64) {
            return Ok(None);
        }
        if network.grow(tracer, seed, true)? == Growth::Lost {
            late.push(seed);
        }
    }
    network.sprout(tracer, true)?;
    for seed in late {
        network.grow(tracer, seed, false)?;
    }
    network.sprout(tracer, false)?;
    Ok(Some(network))
}

impl Network {
    /// Follows the crease that a seed is on, unless it is known already; `whole`: and adds it only if it could be followed to
    /// its ends.
    fn grow(&mut self, tracer: &mut Tracer<'_>, seed: &Seed, whole: bool) -> Result<Growth, FieldError> {
        let Seed { switch, at } = seed;
        if self.explains(at.p, at.t, tracer.step) || tracer.is_special(at, *switch) {
            return Ok(Growth::None);
        }
        let Some(first) = tracer.knot(at.p, at.t)? else { return Ok(Growth::None) };
        let there = tracer.follow(at, &first, *switch)?;
        if whole && there.end == Some(End::Lost) {
            return Ok(Growth::Lost);
        }
        let Some(end) = there.end else {
            let mut knots = vec![first];
            knots.extend(there.knots);
            self.add(Line { switch: *switch, knots, ends: None }, tracer.step);
            return Ok(Growth::Line);
        };
        let back = OnCurve { t: at.t.map(|c| -c), ..at.clone() };
        let here = tracer.follow(&back, &first.reversed(), *switch)?;
        let begin = here.end.unwrap_or(End::Lost);
        if whole && begin == End::Lost {
            return Ok(Growth::Lost);
        }
        let mut knots: Vec<Knot> = here.knots.iter().rev().map(Knot::reversed).collect();
        knots.push(first);
        knots.extend(there.knots);
        // A lone point is none: switches may be equal in a point, as at a tip.
        if knots.len() > 1 {
            self.doubts += usize::from(begin == End::Lost) + usize::from(end == End::Lost);
            self.add(Line { switch: *switch, knots, ends: Some([begin, end]) }, tracer.step);
        }
        Ok(Growth::Line)
    }

    /// Drops short pieces that lead nowhere next to tips, or from one back to it, where switches are equal in one point, too.
    pub(super) fn drop_around(&mut self, tips: &[V3], step: f64) {
        let mut doubts = 0;
        self.lines.retain(|line| {
            let lost = line.ends.map_or(0, |e| e.iter().filter(|e| **e == End::Lost).count());
            let near = |k: &Knot| tips.iter().any(|t| distance(*t, k.p) < 2.0 * step);
            let ends = [line.knots.first(), line.knots.last()];
            let back = tips.iter().any(|t| ends.iter().flatten().all(|k| k.p == *t));
            let drop = line.knots.iter().all(near) && (lost > 0 || line.ends.is_none() || back);
            doubts += if drop { lost } else { 0 };
            !drop
        });
        self.doubts -= doubts;
    }

    fn add(&mut self, line: Line, step: f64) {
        let number = self.lines.len() as u32;
        let n = line.knots.len();
        for k in 0..if line.ends.is_none() { n } else { n - 1 } {
            let (p, q) = (line.knots[k].p, line.knots[(k + 1) % n].p);
            let middle = along(p, 0.5, sub(q, p));
            self.index.entry(cell(middle, step)).or_default().push((number, k as u32));
        }
        self.lines.push(line);
    }

    /// Whether a point of F = G = 0 with tangent `t` lies on a line that is known.
    fn explains(&self, p: V3, t: V3, step: f64) -> bool {
        let c = cell(p, step);
        (0..27).any(|k| {
            let near = [c[0] + k % 3 - 1, c[1] + k / 3 % 3 - 1, c[2] + k / 9 - 1];
            self.index.get(&near).is_some_and(|list| list.iter().any(|&(l, i)| self.passes(l, i, p, t, step)))
        })
    }

    /// Whether a segment passes through `p` with tangent ±`t`.
    fn passes(&self, line: u32, i: u32, p: V3, t: V3, step: f64) -> bool {
        let knots = &self.lines[line as usize].knots;
        let (a, b) = (&knots[i as usize], &knots[(i as usize + 1) % knots.len()]);
        let chord = sub(b.p, a.p);
        let length = norm(chord);
        if length == 0.0 {
            return false;
        }
        let part = dot(sub(p, a.p), chord) / (length * length);
        if !(-0.01..=1.01).contains(&part) {
            return false;
        }
        let aside = distance(p, along(a.p, part, chord));
        // What lies between a chord and its arc.
        let sagitta = 0.25 * length * distance(a.t, b.t);
        aside <= sagitta + 1e-6 * step && dot(t, unit(chord)).abs() > 0.9
    }

    /// The corners: all ends at corners and walls, each once, and for each line the numbers of its ends.
    pub(super) fn corners(&self, step: f64) -> (Vec<V3>, Vec<[usize; 2]>) {
        let (mut corners, mut ends) = self.ends(step);
        // What ends at the bounds stays there.
        let mut may_move = vec![false; corners.len()];
        for (line, numbers) in self.lines.iter().zip(&ends) {
            for (end, &number) in line.ends.iter().flatten().zip(numbers) {
                may_move[number] |= *end != End::Wall;
            }
        }
        join_loose(&mut corners, &mut ends, &may_move, LOOSE * step);
        (corners, ends)
    }

    /// The ends of lines, those at one place once, and for each line the numbers of its ends.
    fn ends(&self, step: f64) -> (Vec<V3>, Vec<[usize; 2]>) {
        let mut corners: Vec<V3> = Vec::new();
        let mut table: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
        let side = 4.0 * ONE_CORNER * step;
        let mut number = |p: V3| {
            let c = cell(p, side);
            for k in 0..27 {
                let near = [c[0] + k % 3 - 1, c[1] + k / 3 % 3 - 1, c[2] + k / 9 - 1];
                let known = table.get(&near).into_iter().flatten();
                let mut known =
                    known.copied().filter(|&i: &usize| distance(corners[i], p) <= ONE_CORNER * step);
                if let Some(i) = known.next() {
                    return i;
                }
            }
            corners.push(p);
            table.entry(c).or_default().push(corners.len() - 1);
            corners.len() - 1
        };
        let ends = self
            .lines
            .iter()
            .map(|line| match (line.ends, line.knots.first(), line.knots.last()) {
                (Some(_), Some(a), Some(b)) => [number(a.p), number(b.p)],
                _ => [usize::MAX; 2],
            })
            .collect();
        (corners, ends)
    }

    /// Looks for creases that start at corners and are not known yet, until there are none.
    fn sprout(&mut self, tracer: &mut Tracer<'_>, whole: bool) -> Result<(), FieldError> {
        let mut done = 0;
        for _ in 0..100 {
            let (corners, _) = self.ends(tracer.step);
            if done == corners.len() {
                break;
            }
            for &c in &corners[done..] {
                self.sprout_at(tracer, c, whole)?;
            }
            done = corners.len();
        }
        Ok(())
    }

    fn sprout_at(&mut self, tracer: &mut Tracer<'_>, c: V3, whole: bool) -> Result<(), FieldError> {
        let local = tracer.solver.local(&tracer.solver.everywhere, c, &mut tracer.desk);
        let off = SPROUT * tracer.step;
        let tied: Vec<u32> = local
            .switches
            .iter()
            .filter(|d| d.value.abs() <= 1e3 * tracer.solver.tie() * norm(d.gradient))
            .map(|d| d.switch)
            .collect();
        for switch in tied {
            for k in 0..26 {
                let k = if k < 13 { k } else { k + 1 };
                let way = unit([f64::from(k % 3 - 1), f64::from(k / 3 % 3 - 1), f64::from(k / 9 - 1)]);
                let Some(at) = tracer.near(along(c, off, way), switch, off) else { continue };
                if distance(at.p, c) > 0.2 * off && tracer.bounds.contains(at.p) {
                    self.grow(tracer, &Seed { switch, at }, whole)?;
                }
            }
        }
        Ok(())
    }
}

/// Ends that no other line shares and that may be moved become the corner within `reach` that is nearest: where pieces meet at small angles
/// corners are found less exactly from one side than from the other.
fn join_loose(corners: &mut Vec<V3>, ends: &mut [[usize; 2]], may_move: &[bool], reach: f64) {
    let mut lines = vec![0; corners.len()];
    let known = |e: &&usize| **e != usize::MAX;
    ends.iter().flatten().filter(known).for_each(|&e| lines[e] += 1);
    let shared: Vec<u32> = (0..corners.len() as u32).filter(|&c| lines[c as usize] > 1).collect();
    let grid = Grid::new(corners, Some(shared), reach.max(f64::MIN_POSITIVE));
    let mut now: Vec<usize> = (0..corners.len()).collect();
    for c in (0..corners.len()).filter(|&c| lines[c] == 1 && may_move[c]) {
        let mut nearest = (reach, usize::MAX);
        grid.near(corners[c], reach, |d| {
            let found = (distance(corners[d as usize], corners[c]), d as usize);
            if found <= nearest {
                nearest = found;
            }
        });
        if nearest.1 != usize::MAX {
            now[c] = nearest.1;
        }
    }
    let kept: Vec<usize> = (0..corners.len()).filter(|&c| now[c] == c).collect();
    let mut place = vec![0; corners.len()];
    kept.iter().enumerate().for_each(|(k, &c)| place[c] = k);
    ends.iter_mut().flatten().filter(|e| **e != usize::MAX).for_each(|e| *e = place[now[*e]]);
    *corners = kept.iter().map(|&c| corners[c]).collect();
}

fn cell(p: V3, side: f64) -> [i64; 3] {
    p.map(|v| (v / side).floor() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loose_ends_join_the_nearest_shared_one_but_not_off_a_wall() {
        let at = |x: f64| [x, 0.0, 0.0];
        // Two shared corners, a loose end next to both, one on a wall, one too far away.
        let mut corners = vec![at(0.0), at(1.0), at(0.6), at(0.1), at(9.0)];
        let mut ends = [[0, 1], [0, 1], [2, 3], [4, 0], [usize::MAX; 2]];
        join_loose(&mut corners, &mut ends, &[true, true, true, false, true], 1.0);
        assert_eq!(corners, [at(0.0), at(1.0), at(0.1), at(9.0)]);
        assert_eq!(ends, [[0, 1], [0, 1], [1, 2], [3, 0], [usize::MAX; 2]]);
    }
}
