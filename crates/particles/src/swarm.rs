//! The floaters of the default method, as columns, and which of them see each other.

use crate::neighbors::{Neighbors, Reach, spatial_order};
use crate::vector::{V3, dot, sub};

/// Floaters as columns of equal length.
#[derive(Clone, Debug, Default)]
pub(crate) struct Swarm {
    /// Positions.
    pub(crate) points: Vec<V3>,
    /// Outward unit normals; zero where the gradient vanishes.
    pub(crate) normals: Vec<V3>,
    /// Displacement of the last step.
    pub(crate) velocity: Vec<V3>,
    /// Connected component of the seeds that each descends from.
    pub(crate) label: Vec<u32>,
    /// Relative size of each floater's share, density^(-1/2) (density^(-1) on curves); empty where all are equal.
    pub(crate) size: Vec<f64>,
    /// Numbers of the points of creases that floaters stand for, which stay where they are; [`FREE`] for all others.
    /// Empty where there are none.
    pub(crate) held: Vec<u32>,
}

/// Not held: see [`Swarm::held`].
pub(crate) const FREE: u32 = u32::MAX;

impl Swarm {
    pub(crate) fn len(&self) -> usize {
        self.points.len()
    }

    /// The floaters `order[0]`, `order[1]`, ... (some may be left out or come twice).
    pub(crate) fn pick(&self, order: &[u32]) -> Self {
        fn take<T: Copy>(column: &[T], order: &[u32]) -> Vec<T> {
            if column.is_empty() { Vec::new() } else { order.iter().map(|&i| column[i as usize]).collect() }
        }
        Self {
            points: take(&self.points, order),
            normals: take(&self.normals, order),
            velocity: take(&self.velocity, order),
            label: take(&self.label, order),
            size: take(&self.size, order),
            held: take(&self.held, order),
        }
    }

    /// Puts floater `from` in the place of floater `to`.
    pub(crate) fn overwrite(&mut self, to: usize, from: usize) {
        self.points[to] = self.points[from];
        self.normals[to] = self.normals[from];
        self.velocity[to] = self.velocity[from];
        self.label[to] = self.label[from];
        if !self.size.is_empty() {
            self.size[to] = self.size[from];
        }
        if !self.held.is_empty() {
            self.held[to] = self.held[from];
        }
    }

    /// Keeps the first `n`.
    pub(crate) fn truncate(&mut self, n: usize) {
        self.points.truncate(n);
        self.normals.truncate(n);
        self.velocity.truncate(n);
        self.label.truncate(n);
        self.size.truncate(n);
        self.held.truncate(n);
    }

    /// Whether floater `i` stays where it is.
    #[inline(always)]
    pub(crate) fn is_held(&self, i: usize) -> bool {
        self.held.get(i).is_some_and(|h| *h != FREE)
    }

    /// Adds a floater that stays where it is.
    pub(crate) fn hold(&mut self, point: V3, normal: V3, label: u32, size: Option<f64>, number: u32) {
        self.held.resize(self.points.len(), FREE);
        self.push(point, normal, label, size);
        self.held.truncate(self.points.len() - 1);
        self.held.push(number);
    }

    /// Sorted along a Morton curve with cells of the given side.
    pub(crate) fn sorted(&self, cell: f64) -> Self {
        self.pick(&spatial_order(&self.points, cell))
    }

    /// Adds one floater at rest.
    pub(crate) fn push(&mut self, point: V3, normal: V3, label: u32, size: Option<f64>) {
        self.points.push(point);
        self.normals.push(normal);
        self.velocity.push([0.0; 3]);
        self.label.push(label);
        self.size.extend(size);
        if !self.held.is_empty() {
            self.held.push(FREE);
        }
    }

    /// Number of floaters of each component.
    pub(crate) fn per_label(&self) -> Vec<u32> {
        let mut counts = vec![0; self.label.iter().max().map_or(0, |&m| m as usize + 1)];
        self.label.iter().for_each(|&l| counts[l as usize] += 1);
        counts
    }

    /// Everybody within `radius` times the root mean square of the two sizes, and maybe others, who may be on the same sheet soon; pairs for which
    /// that is in doubt, as [`share`] tells, are marked.
    pub(crate) fn surroundings(&self, radius: f64) -> Neighbors {
        if self.size.is_empty() {
            Neighbors::on_sheets(&self.points, &self.normals, Reach::Same(radius))
        } else {
            let reach: Vec<f64> = self.size.iter().map(|s| s * radius).collect();
            Neighbors::on_sheets_between(&self.points, &self.normals, Reach::Each(&reach))
        }
    }

    pub(crate) fn neighbors(&self, radius: f64) -> Neighbors {
        let keep =
            |i: usize, j: usize| same_sheet(self.points[i], self.points[j], self.normals[i], self.normals[j]);
        if self.size.is_empty() {
            Neighbors::find(&self.points, Reach::Same(radius), keep)
        } else {
            let reach: Vec<f64> = self.size.iter().map(|s| s * radius).collect();
            Neighbors::find(&self.points, Reach::Each(&reach), keep)
        }
    }
}

/// How much two floaters count as neighbours on one sheet, 0 to 1: a smooth version of [`same_sheet`]. A pair that
/// counted in full from one step to the next would be thrown apart, turn away, be forgotten, and come back.
#[inline(always)]
pub(crate) fn share(p: V3, q: V3, n: V3, m: V3) -> f64 {
    let smooth = |t: f64| {
        let t = t.clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    };
    let c = dot(n, m);
    if c < STACKED {
        return smooth((c - OPPOSING) / (LEVEL - OPPOSING));
    }
    let r = sub(p, q);
    let (a, b, d2) = (dot(r, n), dot(r, m), dot(r, r));
    smooth(3.0 - 5.0 * (a * a).min(b * b) / d2.max(f64::MIN_POSITIVE))
}

/// Whether [`share`] may differ from 1 after some more steps; `None` where it stays 0.
#[inline(always)]
pub(crate) fn doubt(p: V3, q: V3, n: V3, m: V3) -> Option<bool> {
    let c = dot(n, m);
    if c < FORGOTTEN {
        return None;
    }
    let r = sub(p, q);
    let (a, b) = (dot(r, n), dot(r, m));
    Some(c < DOUBTFUL || (a * a).min(b * b) > LEANING * dot(r, r))
}

/// Cosine between normals from which on down two floaters lie on different sheets.
const OPPOSING: f64 = -0.5;
/// The same from which on up they lie on one sheet, or on two that are stacked.
const STACKED: f64 = 0.5;
/// The same from which on down they count less and less.
const LEVEL: f64 = -0.25;
/// Below this cosine two floaters will not lie on one sheet soon,
pub(crate) const FORGOTTEN: f64 = OPPOSING - 0.2;
/// and below this one they may cease to, as they may
pub(crate) const DOUBTFUL: f64 = LEVEL + 0.5;
/// where the squared cosines between the segment and both normals are larger.
pub(crate) const LEANING: f64 = 0.25;

/// Whether two floaters lie on the same sheet of the surface, as far as their normals tell. Neighbours through a thin
/// sheet have opposing normals; those two sheets further have parallel normals and a segment along them. A floater
/// without a normal belongs to every sheet.
#[inline(always)]
pub fn same_sheet(p: V3, q: V3, n: V3, m: V3) -> bool {
    let c = dot(n, m);
    if c < OPPOSING {
        return false;
    }
    if c < STACKED {
        return true;
    }
    let r = sub(p, q);
    let (a, b, d2) = (dot(r, n), dot(r, m), dot(r, r));
    !(a * a > 0.5 * d2 && b * b > 0.5 * d2)
}

#[cfg(test)]
mod tests {
    use super::same_sheet;

    #[test]
    fn sheets_are_told_apart_by_normals() {
        let up = [0.0, 0.0, 1.0];
        let down = [0.0, 0.0, -1.0];
        let side = [1.0, 0.0, 0.0];
        assert!(same_sheet([0.0; 3], [1.0, 0.0, 0.1], up, up));
        assert!(!same_sheet([0.0; 3], [1.0, 0.0, -0.1], up, down), "the faces of a pancake");
        assert!(!same_sheet([0.0; 3], [0.1, 0.0, -1.0], up, up), "every other shell");
        assert!(same_sheet([0.0, 0.0, 1.0], [0.5, 0.0, 0.5], up, side), "over the edge of a cube");
        assert!(same_sheet([0.0; 3], [0.0, 0.0, 1.0], [0.0; 3], up), "next to an apex");
    }
}
