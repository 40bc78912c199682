//! Outlines of the holes that triangles leave on pieces with borders.

use std::collections::{HashMap, HashSet};
use std::f64::consts::TAU;

use isoswarm_field::math::atan2;
use isoswarm_field::vector::{V3, cross, dot, sub, tangential};

/// Longest outline of a hole that is closed: what that takes grows with the cube.
const LONGEST: usize = 128;

/// What holes are looked for in.
pub(super) struct Open<'a> {
    pub(super) points: &'a [V3],
    pub(super) normals: &'a [V3],
    /// Who comes after and before a vertex on the border of its piece.
    pub(super) borders: &'a [[u32; 2]],
}

impl Open<'_> {
    /// The outlines of the holes between triangles and borders, each with the hole on its left, in the order in which `faces` and then
    /// borders come to them; without those that are too long. `ends(a, b)`: the surface ends at the edge.
    pub(super) fn outlines(&self, faces: &[[u32; 3]], ends: impl Fn(u32, u32) -> bool) -> Vec<Vec<u32>> {
        let sides = |f: &[u32; 3]| [(f[0], f[1]), (f[1], f[2]), (f[2], f[0])];
        let known: HashSet<(u32, u32)> = faces.iter().flat_map(sides).collect();
        let mut leaving: HashMap<u32, Vec<u32>> = HashMap::new();
        let mut order: Vec<(u32, u32)> = Vec::new();
        let mut add = |a: u32, b: u32| {
            leaving.entry(a).or_default().push(b);
            order.push((a, b));
        };
        for (a, b) in faces.iter().flat_map(sides) {
            if !known.contains(&(b, a)) && self.borders[a as usize][0] != b && !ends(a, b) {
                add(b, a);
            }
        }
        for (a, &[b, _]) in self.borders.iter().enumerate() {
            if b != u32::MAX && !known.contains(&(a as u32, b)) {
                add(a as u32, b);
            }
        }
        let mut out = Vec::new();
        let mut done: HashSet<(u32, u32)> = HashSet::new();
        for &(a, b) in &order {
            if done.contains(&(a, b)) {
                continue;
            }
            let (mut from, mut to) = (a, b);
            let mut outline = Vec::new();
            while done.insert((from, to)) {
                outline.push(from);
                let Some(next) = leaving.get(&to).and_then(|l| self.turn(from, to, l)) else { break };
                (from, to) = (to, next);
            }
            // Two creases with one segment each between the same corners enclose nothing.
            if (from, to) == (a, b) && (3..=LONGEST).contains(&outline.len()) {
                out.push(outline);
            }
        }
        out
    }

    /// Having come to `at` from `from`: the first of the ways on, clockwise.
    fn turn(&self, from: u32, at: u32, ways: &[u32]) -> Option<u32> {
        if let [one] = *ways {
            return Some(one);
        }
        let (p, n) = (self.points[at as usize], self.normals[at as usize]);
        let way = |v: u32| tangential(sub(self.points[v as usize], p), n);
        let back = way(from);
        let angle = |v: u32| {
            let to = way(v);
            let a = atan2(dot(cross(to, back), n), dot(to, back));
            // Back is a whole turn.
            if v == from || a <= 0.0 { a + TAU } else { a }
        };
        ways.iter().copied().min_by(|&a, &b| angle(a).total_cmp(&angle(b)).then(a.cmp(&b)))
    }
}
