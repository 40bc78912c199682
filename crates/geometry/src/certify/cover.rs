//! The surface inside a union of boxes: pieces that lie in different parts of it are different components.

use isoswarm_field::vector::{along, scale};
use isoswarm_field::{Aabb, FieldError, Regularity};
use rayon::prelude::*;

use super::Budget;
use super::critical::{Critical, touch};
use super::system::{System, at, centre, excludes, inner};

/// A lattice of boxes over the bounds, `cells` along each axis.
#[derive(Clone, Copy)]
struct Lattice {
    bounds: Aabb,
    cells: [u32; 3],
}

type Cell = [u32; 3];

impl Lattice {
    fn new(bounds: &Aabb) -> Self {
        let width = |a: usize| bounds.hi[a] - bounds.lo[a];
        let least = (0..3).map(width).fold(f64::INFINITY, f64::min);
        Self { bounds: *bounds, cells: [0, 1, 2].map(|a| (width(a) / least).round().clamp(1.0, 64.0) as u32) }
    }

    fn finer(&self) -> Self {
        Self { cells: self.cells.map(|n| 2 * n), ..*self }
    }

    /// Faces of neighbours are the same numbers, and those on the bounds are the bounds.
    fn face(&self, a: usize, i: u32) -> f64 {
        let part = f64::from(i) / f64::from(self.cells[a]);
        if i == self.cells[a] {
            self.bounds.hi[a]
        } else {
            self.bounds.lo[a] + (self.bounds.hi[a] - self.bounds.lo[a]) * part
        }
    }

    fn cell(&self, i: Cell) -> Aabb {
        Aabb::new([0, 1, 2].map(|a| self.face(a, i[a])), [0, 1, 2].map(|a| self.face(a, i[a] + 1)))
    }

    fn all(&self) -> Vec<Cell> {
        let [l, m, n] = self.cells;
        (0..l).flat_map(|i| (0..m).flat_map(move |j| (0..n).map(move |k| [i, j, k]))).collect()
    }
}

/// A component of the surface: its critical points, and boxes that contain it.
pub(super) struct Piece {
    pub(super) points: Vec<usize>,
    pub(super) boxes: Vec<Aabb>,
}

/// Separates components: each class of critical points is known to lie on one component. `None` where that takes more
/// boxes than there are.
pub(super) fn separate(
    system: &System<'_>,
    bounds: &Aabb,
    points: &[Critical],
    class: &[Option<usize>],
    budget: &mut Budget<'_>,
) -> Result<Option<Vec<Piece>>, FieldError> {
    let mut lattice = Lattice::new(bounds);
    let mut cells = lattice.all();
    let mut pieces = Vec::new();
    while !cells.is_empty() {
        lattice = lattice.finer();
        let parts: Vec<Cell> = cells
            .iter()
            .flat_map(|c| (0..8u32).map(move |k| [0, 1, 2].map(|a| 2 * c[a] + (k >> a & 1))))
            .collect();
        if !budget.spend(parts.len()) {
            return Ok(None);
        }
        let kept: Vec<bool> = parts
            .par_iter()
            .with_min_len(64)
            .map(|c| excludes(system, &lattice.cell(*c)).map(|e| !e))
            .collect::<Result<_, FieldError>>()?;
        let mut level: Vec<Cell> = parts.into_iter().zip(kept).filter(|(_, k)| *k).map(|(c, _)| c).collect();
        level.sort_unstable();
        let label = clusters(&level);
        let mut of_cluster: Vec<(Vec<Cell>, Vec<usize>)> = Vec::new();
        for (c, &l) in level.iter().zip(&label) {
            of_cluster.resize_with(of_cluster.len().max(l + 1), Default::default);
            of_cluster[l].0.push(*c);
        }
        for (i, p) in points.iter().enumerate() {
            // All boxes that touch it touch each other.
            if let Some(k) = level.iter().position(|c| touch(&lattice.cell(*c), &p.at)) {
                of_cluster[label[k]].1.push(i);
            }
        }
        cells.clear();
        for (boxes, points) in of_cluster {
            let mut classes: Vec<usize> = points.iter().filter_map(|&i| class[i]).collect();
            classes.sort_unstable();
            classes.dedup();
            match classes.len() {
                // Every component has a minimum.
                0 => {}
                1 => pieces.push(Piece { points, boxes: boxes.iter().map(|c| lattice.cell(*c)).collect() }),
                _ => cells.extend(boxes),
            }
        }
    }
    pieces.sort_by_key(|p| p.points.first().copied());
    Ok(Some(pieces))
}

/// The cluster of each cell: those that touch belong together. Cells are sorted.
fn clusters(cells: &[Cell]) -> Vec<usize> {
    let mut parent: Vec<usize> = (0..cells.len()).collect();
    fn root(parent: &mut [usize], mut i: usize) -> usize {
        while parent[i] != i {
            parent[i] = parent[parent[i]];
            i = parent[i];
        }
        i
    }
    for (i, c) in cells.iter().enumerate() {
        for k in 0..27u32 {
            let step = [k % 3, k / 3 % 3, k / 9];
            if (0..3).any(|a| c[a] + step[a] == 0) {
                continue;
            }
            let other = [0, 1, 2].map(|a| c[a] + step[a] - 1);
            if other > *c
                && let Ok(j) = cells.binary_search(&other)
            {
                let (a, b) = (root(&mut parent, i), root(&mut parent, j));
                parent[a.max(b)] = a.min(b);
            }
        }
    }
    let mut number = vec![usize::MAX; cells.len()];
    let mut next = 0;
    (0..cells.len())
        .map(|i| {
            let r = root(&mut parent, i);
            if number[r] == usize::MAX {
                number[r] = next;
                next += 1;
            }
            number[r]
        })
        .collect()
}

/// Pieces that the ray from a piece's lowest point down to the bounds meets an odd number of times: those around it.
/// `None` where that cannot be told.
pub(super) fn around(
    system: &System<'_>,
    bounds: &Aabb,
    points: &[Critical],
    pieces: &[Piece],
    own: usize,
) -> Result<Option<Vec<usize>>, FieldError> {
    let height = |p: &Critical| isoswarm_field::vector::dot(centre(&p.at), system.h);
    let lowest =
        pieces[own].points.iter().min_by(|&&i, &&j| height(&points[i]).total_cmp(&height(&points[j])));
    let Some(&lowest) = lowest else { return Ok(None) };
    let start = centre(&points[lowest].at);
    let size = bounds.diagonal();
    let way = scale(system.h, -1.0);
    let on = |t: f64| along(start, t, way);
    let owner = |a: f64, b: f64| -> Result<usize, bool> {
        let (p, q) = (on(a), on(b));
        let hull = Aabb::new([0, 1, 2].map(|k| p[k].min(q[k])), [0, 1, 2].map(|k| p[k].max(q[k])));
        let mut owners = (0..pieces.len()).filter(|&k| pieces[k].boxes.iter().any(|b| touch(b, &hull)));
        match (owners.next(), owners.next()) {
            (Some(k), None) => Ok(k),
            (None, _) => Err(true),
            _ => Err(false),
        }
    };
    let begin = 1e-6 * size;
    if owner(0.0, begin) != Ok(own) {
        return Ok(None);
    }
    let mut crossings = vec![0usize; pieces.len()];
    let mut open = vec![(begin, 1.01 * size)];
    let mut looked = 0;
    while let Some((a, b)) = open.pop() {
        looked += 1;
        if looked > 10_000 {
            return Ok(None);
        }
        let (p, q) = (on(a), on(b));
        let hull = Aabb::new([0, 1, 2].map(|k| p[k].min(q[k])), [0, 1, 2].map(|k| p[k].max(q[k])));
        if excludes(system, &hull)? {
            continue;
        }
        let owned = owner(a, b);
        if owned == Err(true) || owned == Ok(own) {
            // No piece is here, or its own, which the ray does not meet.
            continue;
        }
        let broken = system.regularity(&hull)? == Regularity::Broken;
        if let (Ok(k), false) = (owned, broken) {
            let slope = inner(way, &system.gradient(&hull)?);
            let (f, g) = (system.value(&at(p))?, system.value(&at(q))?);
            if !slope.has_zero() && !f.has_zero() && !g.has_zero() {
                crossings[k] += usize::from((f.lo > 0.0) != (g.lo > 0.0));
                continue;
            }
        }
        let middle = 0.5 * (a + b);
        open.extend([(a, middle), (middle, b)]);
    }
    Ok(Some((0..pieces.len()).filter(|&k| crossings[k] % 2 == 1).collect()))
}
