//! Which points belong to one connected component.
//!
//! Neighbours with similar normals on one sheet are connected. What that leaves apart is joined where a walk on the
//! surface leads from one set to another: over creases, around thin rims, through necks between the points.

use rayon::prelude::*;

use isoswarm_field::arrange::Arrange;
use isoswarm_field::{FieldError, Surface};

use super::lines::Roots;
use super::trace::connected;
use crate::constraint::Walls;
use crate::neighbors::{Grid, Neighbors, Reach};
use crate::run::Run;
use crate::swarm::{Swarm, same_sheet};
use crate::vector::{V3, distance, dot, norm, sub, unit};

/// Radius within which points with similar normals are connected, in mean spacings.
const NEAR: f64 = 2.2;
/// Distance of roots that are on one spot.
const SPOT: f64 = 1e-5;
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
    run: &mut Run<'_>,
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
    // Roots on one spot are one, whatever the normals: at a singular point there are as many as there are ways to it.
    let on_spot = |i: usize, j: usize| i < j && distance(points[i], points[j]) <= SPOT * spacing;
    let lists = Neighbors::find(points, Reach::Same(NEAR * spacing), |i, j| smooth(i, j) || on_spot(i, j));
    for i in 0..n {
        lists.of(i).iter().for_each(|&j| sets.join(i as u32, j));
    }
    for round in 0..ROUNDS {
        // The last rounds look farther.
        let radius = if round < ROUNDS / 2 { NEAR } else { FAR } * spacing;
        if !join_by_walks(surface, run, walls, points, &normals, radius, &mut sets)? && round >= ROUNDS / 2 {
            break;
        }
    }
    Ok(in_order((0..n as u32).map(|i| sets.find(i)).collect()))
}

/// Tries the shortest pairs between sets; whether any were joined.
fn join_by_walks(
    surface: &dyn Surface,
    run: &mut Run<'_>,
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
    let mut shortest = Shortest::new(WALKS);
    for i in 0..points.len() {
        lists.of(i).iter().for_each(|&j| shortest.add(points, &set, i as u32, j));
    }
    shortest.walk(surface, run, walls, points, normals, sets)
}

/// A pair of points: their sets, their distance, and which they are.
type Pair = ((u32, u32), f64, (u32, u32));

/// The shortest pairs of points between each two sets.
struct Shortest {
    /// How many are wanted.
    walks: usize,
    pairs: Vec<Pair>,
    /// How many there were when those that are too long were last left out.
    kept: usize,
}

impl Shortest {
    fn new(walks: usize) -> Self {
        Self { walks, pairs: Vec::new(), kept: 0 }
    }

    fn add(&mut self, points: &[V3], set: &[u32], i: u32, j: u32) {
        let (i, j) = (i.min(j), i.max(j));
        let (a, b) = (set[i as usize], set[j as usize]);
        self.pairs.push(((a.min(b), a.max(b)), distance(points[i as usize], points[j as usize]), (i, j)));
        if self.pairs.len() > 2 * self.kept + MOST {
            self.prune();
        }
    }

    /// Leaves the shortest between each two sets, in the order of the sets.
    fn prune(&mut self) {
        self.pairs.arrange_by(|x, y| x.0.cmp(&y.0).then(x.1.total_cmp(&y.1)).then(x.2.cmp(&y.2)));
        self.pairs.dedup();
        let (mut sets, mut many) = (None, 0);
        self.pairs.retain(|p| {
            many = if sets == Some(p.0) { many + 1 } else { 1 };
            sets = Some(p.0);
            many <= self.walks
        });
        self.kept = self.pairs.len();
    }

    /// Walks between the ends of the pairs and joins the sets of those that are linked; whether there were any.
    fn walk(
        mut self,
        surface: &dyn Surface,
        run: &mut Run<'_>,
        walls: &Walls,
        points: &[V3],
        normals: &[V3],
        sets: &mut Sets,
    ) -> Result<bool, FieldError> {
        self.prune();
        self.pairs.truncate(MOST);
        let end = |k: u32| (points[k as usize], normals[k as usize]);
        let pairs: Vec<[(V3, V3); 2]> = self.pairs.iter().map(|p| [end(p.2.0), end(p.2.1)]).collect();
        let linked = connected(surface, run, walls, &pairs)?;
        for (pair, linked) in self.pairs.iter().zip(&linked) {
            if *linked {
                sets.join(pair.2.0, pair.2.1);
            }
        }
        Ok(linked.contains(&true))
    }
}

/// Radius within which floaters on one smooth sheet are connected, in square roots of the mean cell.
const ADJACENT: f64 = 1.5;
/// Floaters whose neighbours one task looks through.
const TASK: usize = 1024;
/// Fewest floaters that make a component of their own where the seeds did not see one.
const FEWEST: usize = 3;

/// The components of a swarm that is finer than the seeds were: the label of each floater, and how many there are. Sets
/// of too few floaters to tell belong to the largest one with the same label. `lists` are neighbours on one sheet, `spacing`
/// the square root of the mean cell.
pub(crate) fn divide(
    surface: &dyn Surface,
    run: &mut Run<'_>,
    walls: &Walls,
    swarm: &Swarm,
    lists: &Neighbors,
    spacing: f64,
) -> Result<(Vec<u32>, usize), FieldError> {
    let Swarm { points, normals, label, .. } = swarm;
    let n = points.len();
    let mut sets = Sets::new(n);
    let adjacent = |i: usize| {
        lists.of(i).iter().filter(move |j| **j > i as u32).filter(move |j| {
            let k = **j as usize;
            let r = sub(points[k], points[i]);
            let d = norm(r);
            let flat = dot(r, normals[i]).abs().max(dot(r, normals[k]).abs()) < 0.55 * d;
            flat && d < ADJACENT * spacing && dot(normals[i], normals[k]) > 0.4
        })
    };
    let rows: Vec<usize> = (0..n).collect();
    let pairs: Vec<Vec<(u32, u32)>> = rows
        .par_chunks(TASK)
        .map(|rows| rows.iter().flat_map(|&i| adjacent(i).map(move |&j| (i as u32, j))).collect())
        .collect();
    pairs.into_iter().flatten().for_each(|(i, j)| sets.join(i, j));
    let grid = Grid::new(points, None, NEAR * spacing);
    for round in 0..ROUNDS {
        let set: Vec<u32> = (0..n as u32).map(|i| sets.find(i)).collect();
        let largest = largest_of_labels(&set, label);
        let radius = if round < ROUNDS / 2 { NEAR } else { FAR } * spacing;
        // Most sets are single floaters in sharp places, and one walk will do.
        let mut shortest = Shortest::new(if round == 0 { 1 } else { WALKS });
        for i in (0..n).filter(|&i| largest[label[i] as usize] != set[i] && normals[i] != [0.0; 3]) {
            grid.near(points[i], radius, |j| {
                let k = j as usize;
                let apart = set[k] != set[i] && normals[k] != [0.0; 3];
                if apart && distance(points[i], points[k]) <= radius {
                    shortest.add(points, &set, i as u32, j);
                }
            });
        }
        if !shortest.walk(surface, run, walls, points, normals, &mut sets)? && round >= ROUNDS / 2 {
            break;
        }
    }
    let set: Vec<u32> = (0..n as u32).map(|i| sets.find(i)).collect();
    let largest = largest_of_labels(&set, label);
    let mut size = vec![0; n];
    set.iter().for_each(|&s| size[s as usize] += 1);
    let own = |i: usize| if size[set[i] as usize] < FEWEST { largest[label[i] as usize] } else { set[i] };
    Ok(in_order((0..n).map(own).collect()))
}

/// Labels numbered anew in the order of first appearance, and how many there are.
pub(crate) fn in_order(mut label: Vec<u32>) -> (Vec<u32>, usize) {
    let mut number = vec![u32::MAX; label.iter().max().map_or(0, |m| *m as usize + 1)];
    let mut many = 0;
    for l in &mut label {
        let own = &mut number[*l as usize];
        if *own == u32::MAX {
            *own = many;
            many += 1;
        }
        *l = *own;
    }
    (label, many as usize)
}

/// For each label its largest set (the first of several).
fn largest_of_labels(set: &[u32], label: &[u32]) -> Vec<u32> {
    let mut size = vec![0u32; set.len()];
    set.iter().for_each(|&s| size[s as usize] += 1);
    let mut largest = vec![u32::MAX; label.iter().max().map_or(0, |m| *m as usize + 1)];
    for (&s, &l) in set.iter().zip(label) {
        let best = &mut largest[l as usize];
        if *best == u32::MAX || size[s as usize] > size[*best as usize] {
            *best = s;
        }
    }
    largest
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
