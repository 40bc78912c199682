//! Which points belong to one connected component.
//!
//! Neighbours with similar normals on one sheet are connected. What that leaves apart is joined where a walk on the
//! surface leads from one set to another: over creases, around thin rims, through necks between the points.

use std::collections::BTreeMap;

use isoswarm_field::{FieldError, Surface};

use super::lines::Roots;
use super::trace::connected;
use crate::constraint::Walls;
use crate::neighbors::{Neighbors, Reach};
use crate::swarm::same_sheet;
use crate::vector::{V3, distance, dot, norm, unit};

/// Radius within which points with similar normals are connected, in mean spacings.
const NEAR: f64 = 2.2;
/// Radius within which sets are tried for a way on the surface.
const FAR: f64 = 5.0;
/// Walks for each pair of sets in a round.
const WALKS: usize = 4;
/// Most walks in a round.
const MOST: usize = 4096;
/// Rounds: each joins sets that the last one left apart.
const ROUNDS: usize = 4;

struct Sets {
    parent: Vec<u32>,
}

impl Sets {
    fn new(n: usize) -> Self {
        Self { parent: (0..n as u32).collect() }
    }

    fn find(&mut self, i: u32) -> u32 {
        let mut root = i;
        while self.parent[root as usize] != root {
            root = self.parent[root as usize];
        }
        let mut at = i;
        while self.parent[at as usize] != root {
            at = std::mem::replace(&mut self.parent[at as usize], root);
        }
        root
    }

    /// The smaller index becomes the root, so that the result does not depend on the order.
    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }
}

/// The component of each root, numbered in the order of first roots, and the number of components.
pub(crate) fn label(
    surface: &dyn Surface,
    count: &mut u64,
    walls: &Walls,
    roots: &Roots,
    area: f64,
    least: f64,
) -> Result<(Vec<u32>, usize), FieldError> {
    let points = &roots.points;
    let normals: Vec<V3> =
        roots.gradients.iter().map(|&g| if norm(g) > least { unit(g) } else { [0.0; 3] }).collect();
    let n = points.len();
    let per = area / roots.kept().max(1) as f64;
    let spacing = if walls.axes == 2 { per } else { per.sqrt() };
    let mut sets = Sets::new(n);
    let smooth = |i: usize, j: usize| {
        i < j
            && dot(normals[i], normals[j]) >= 0.5
            && same_sheet(points[i], points[j], normals[i], normals[j])
    };
    let lists = Neighbors::find(points, Reach::Same(NEAR * spacing), smooth);
    for i in 0..n {
        lists.of(i).iter().for_each(|&j| sets.join(i as u32, j));
    }
    for round in 0..ROUNDS {
        // The last rounds look farther.
        let radius = if round < ROUNDS / 2 { NEAR } else { FAR } * spacing;
        if !join_by_walks(surface, count, walls, points, &normals, radius, &mut sets)? && round >= ROUNDS / 2
        {
            break;
        }
    }
    let mut number = BTreeMap::new();
    let label = (0..n as u32)
        .map(|i| {
            let next = number.len() as u32;
            *number.entry(sets.find(i)).or_insert(next)
        })
        .collect();
    Ok((label, number.len()))
}

/// Tries the shortest pairs between sets; whether any were joined.
fn join_by_walks(
    surface: &dyn Surface,
    count: &mut u64,
    walls: &Walls,
    points: &[V3],
    normals: &[V3],
    radius: f64,
    sets: &mut Sets,
) -> Result<bool, FieldError> {
    let set: Vec<u32> = (0..points.len() as u32).map(|i| sets.find(i)).collect();
    if set.iter().all(|&s| s == set[0]) {
        return Ok(false);
    }
    let apart =
        |i: usize, j: usize| i < j && set[i] != set[j] && normals[i] != [0.0; 3] && normals[j] != [0.0; 3];
    let lists = Neighbors::find(points, Reach::Same(radius), apart);
    let mut shortest: BTreeMap<(u32, u32), Vec<(f64, u32, u32)>> = BTreeMap::new();
    for i in 0..points.len() {
        for &j in lists.of(i) {
            let (a, b) = (set[i].min(set[j as usize]), set[i].max(set[j as usize]));
            let row = shortest.entry((a, b)).or_default();
            row.push((distance(points[i], points[j as usize]), i as u32, j));
            if row.len() > 8 * WALKS {
                row.sort_unstable_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
                row.truncate(WALKS);
            }
        }
    }
    let mut ends = Vec::new();
    for row in shortest.values_mut() {
        row.sort_unstable_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
        ends.extend(row.iter().take(WALKS).map(|&(_, i, j)| (i, j)));
    }
    ends.truncate(MOST);
    let pairs: Vec<[(V3, V3); 2]> =
        ends.iter().map(|&(i, j)| [i, j].map(|k| (points[k as usize], normals[k as usize]))).collect();
    let linked = connected(surface, count, walls, &pairs)?;
    for (k, (i, j)) in ends.into_iter().enumerate() {
        if linked[k] {
            sets.join(i, j);
        }
    }
    Ok(linked.contains(&true))
}

#[cfg(test)]
mod tests {
    use super::Sets;

    #[test]
    fn joined_sets_have_their_smallest_member_as_root() {
        let mut s = Sets::new(6);
        s.join(5, 3);
        s.join(4, 5);
        s.join(1, 2);
        assert_eq!((0..6).map(|i| s.find(i)).collect::<Vec<_>>(), [0, 1, 1, 3, 3, 3]);
    }
}
