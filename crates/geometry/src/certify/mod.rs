//! Proofs of the topology of F = 0 from interval arithmetic alone.
//!
//! The Euler characteristic is the sum of (-1)^index over the critical points of a height function on the surface (Morse),
//! all of which are isolated ([`critical`]); paths along the surface join its minima ([`path`]), and a cover by boxes tells
//! apart what they do not join ([`cover`]).

mod cover;
mod critical;
mod path;
mod system;

use std::fmt;

use isoswarm_field::vector::unit;
use isoswarm_field::{Aabb, Field};
use rayon::prelude::*;

use crate::GeometryError;
use crate::mesh::{MeshReport, Topology};
use critical::Critical;
use system::System;

/// Heights that are tried, one after the other: directions that no model is likely to be aligned with.
const DIRECTIONS: [[f64; 3]; 4] = [
    [0.3147, 0.5321, 0.7861],
    [0.8213, -0.2341, 0.5202],
    [-0.4411, 0.8017, 0.4031],
    [0.1213, 0.2719, -0.9547],
];
/// Boxes in doubt that are returned.
const MOST_DOUBTFUL: usize = 1000;
/// Part of the boxes that may go to one face of the bounds.
const FACE_SHARE: usize = 50;

/// How far [`certify`] may go.
pub struct CertifyOptions<'a> {
    /// Most boxes that are looked at. Default: 2 million, half a minute or so for a short formula.
    pub boxes: usize,
    /// Called between steps with the number of boxes looked at; `false` ends the work, and what is known is returned.
    pub goes_on: Option<&'a mut dyn FnMut(usize) -> bool>,
}

impl Default for CertifyOptions<'_> {
    fn default() -> Self {
        Self { boxes: 2_000_000, goes_on: None }
    }
}

/// A connected component of a surface whose topology is proven.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Component {
    /// Euler characteristic.
    pub euler: i64,
    /// Genus: number of handles.
    pub genus: i64,
    /// The components that it lies inside of, by number; `None` where that could not be told.
    pub inside: Option<Vec<usize>>,
}

/// What is proven of a surface. Proofs hold for F as interval arithmetic evaluates it, where it is defined.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Certificate {
    /// Whether all is: the surface in the bounds is closed, without singular points, and `euler` and `components` are right.
    /// Creases may run where the height of the proof has no critical points.
    pub proven: bool,
    /// Euler characteristic of the whole; proven where it is there.
    pub euler: Option<i64>,
    /// The components, in the order of their lowest critical points; empty where their number is not proven.
    pub components: Vec<Component>,
    /// Minima, saddles and maxima of the height that the proof goes by.
    pub critical: [usize; 3],
    /// Boxes looked at.
    pub boxes: usize,
    /// Where the proof fails: at most 1000 boxes.
    pub doubtful: Vec<Aabb>,
    /// Why it fails; empty where it does not.
    pub reason: String,
}

impl Certificate {
    /// Whether a mesh has the proven topology; `None` where nothing is proven. See [`Certificate::difference`].
    pub fn agrees(&self, mesh: &Topology) -> Option<bool> {
        self.proven.then(|| self.difference(mesh).is_none())
    }

    /// What a mesh has that the surface has not, in words; `None` where there is no difference, or no proof.
    pub fn difference(&self, mesh: &Topology) -> Option<String> {
        if !self.proven {
            return None;
        }
        if !mesh.is_closed() {
            return Some("the surface is closed, the mesh is not a closed manifold".into());
        }
        let sorted = |mut v: Vec<i64>| {
            v.sort_unstable();
            v
        };
        let (own, other) =
            (sorted(self.components.iter().map(|c| c.euler).collect()), sorted(mesh.euler.clone()));
        if own.len() != other.len() {
            return Some(format!("the surface has {} components, the mesh {}", own.len(), other.len()));
        }
        (own != other).then(|| {
            format!("the components' Euler characteristics are {own:?}, those of the mesh {other:?}")
        })
    }
}

impl MeshReport {
    /// Compares the mesh with what is proven of the surface; a difference becomes a warning.
    pub fn certify(&mut self, certificate: &Certificate) {
        self.certified = certificate.agrees(&self.topology);
        self.warnings.extend(
            certificate.difference(&self.topology).map(|d| format!("wrong topology, as is proven: {d}")),
        );
    }
}

impl fmt::Display for Certificate {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.proven {
            return write!(out, "not proven: {}", self.reason);
        }
        if self.components.is_empty() {
            return out.write_str("proven: there is no surface in the bounds");
        }
        let genus: Vec<String> = self.components.iter().map(|c| c.genus.to_string()).collect();
        write!(
            out,
            "proven: closed, {} component{} of genus {}",
            genus.len(),
            if genus.len() == 1 { "" } else { "s" },
            genus.join(", ")
        )
    }
}

/// Boxes that may still be looked at.
struct Budget<'a> {
    left: usize,
    spent: usize,
    goes_on: Option<&'a mut dyn FnMut(usize) -> bool>,
}

impl Budget<'_> {
    /// Takes so many boxes; whether there were as many, and the work is to go on.
    fn spend(&mut self, boxes: usize) -> bool {
        if boxes > self.left {
            self.left = 0;
            return false;
        }
        self.left -= boxes;
        self.spent += boxes;
        if self.goes_on.as_mut().is_some_and(|go| !go(self.spent)) {
            self.left = 0;
            return false;
        }
        true
    }
}

/// Proves the topology of the surface F = 0 in `bounds`, as far as that goes: it must not reach the bounds, be smooth
/// there (no kinks where the height has critical points, no singular points), and not be too intricate for the budget.
///
/// # Errors
/// A field with opaque parts, which has no intervals, in the plane, or with several equations; bounds that are no box.
/// A proof that fails is no error: the certificate says why and where.
///
/// ```
/// use isoswarm_field::{Aabb, Field, text};
/// use isoswarm_geometry::{CertifyOptions, certify};
/// let torus = Field::new(&text::parse("(x^2 + y^2 + z^2 + 0.84)^2 - 4*(x^2 + y^2)", &[])?)?;
/// let found = certify(&torus, &Aabb::new([-2.0; 3], [2.0; 3]), CertifyOptions::default())?;
/// assert!(found.proven && found.euler == Some(0) && found.components[0].genus == 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn certify(
    field: &Field,
    bounds: &Aabb,
    options: CertifyOptions<'_>,
) -> Result<Certificate, GeometryError> {
    check(field, bounds)?;
    let mut budget = Budget { left: options.boxes, spent: 0, goes_on: options.goes_on };
    let first = System::new(field, unit(DIRECTIONS[0]), bounds)?;
    let doubtful = faces(&first, bounds, &mut budget)?;
    let mut out = Certificate { doubtful, ..Certificate::default() };
    if !out.doubtful.is_empty() {
        out.reason =
            "the surface reaches the bounds, or comes too close to them to tell: it is not closed there; \
                      pass larger bounds if it ends"
                .into();
        return Ok(finished(out, &budget));
    }
    let mut exhausted = false;
    for (k, direction) in DIRECTIONS.into_iter().enumerate() {
        let system = System::new(field, unit(direction), bounds)?;
        let most = budget.left / (DIRECTIONS.len() - k);
        let found = critical::search(&system, bounds, most, &mut budget)?;
        if found.doubtful.is_empty() {
            return by_critical_points(&system, bounds, found.points, budget);
        }
        // The direction that leaves fewest doubts tells most.
        if out.doubtful.is_empty() || found.doubtful.len() < out.doubtful.len() {
            (out.doubtful, exhausted) = (found.doubtful, found.exhausted);
        }
        if budget.left == 0 {
            break;
        }
    }
    out.reason = if exhausted {
        "the budget of boxes was used up before all critical points were isolated; allow more, or look there for singular \
         points, creases or very thin parts"
            .into()
    } else {
        "the surface is singular, creased or nearly so where critical points could not be isolated".into()
    };
    Ok(finished(out, &budget))
}

fn finished(mut out: Certificate, budget: &Budget<'_>) -> Certificate {
    out.boxes = budget.spent;
    out.doubtful.truncate(MOST_DOUBTFUL);
    out
}

fn check(field: &Field, bounds: &Aabb) -> Result<(), GeometryError> {
    let wrong = |name, expected, given: String| Err(GeometryError::Option { name, expected, given });
    if field.axes() != 3 {
        return wrong(
            "field",
            "a surface in space: a function of x, y and z",
            format!("{} axes", field.axes()),
        );
    }
    if field.components() != 1 {
        return wrong("field", "one equation", field.components().to_string());
    }
    let fine = |a: usize| bounds.lo[a].is_finite() && bounds.hi[a].is_finite() && bounds.lo[a] < bounds.hi[a];
    if !(0..3).all(fine) {
        return wrong("bounds", "finite corners with lo < hi on every axis", format!("{bounds:?}"));
    }
    field.interval(&bounds.lo, &bounds.hi)?;
    Ok(())
}

/// Boxes on the faces of the bounds that may meet the surface.
fn faces(system: &System<'_>, bounds: &Aabb, budget: &mut Budget<'_>) -> Result<Vec<Aabb>, GeometryError> {
    let most = budget.left / FACE_SHARE;
    let narrowest = 1e-5 * bounds.diagonal();
    let mut out = Vec::new();
    for k in 0..6 {
        let (a, mut face) = (k / 2, *bounds);
        let end = if k % 2 == 0 { bounds.lo[a] } else { bounds.hi[a] };
        (face.lo[a], face.hi[a]) = (end, end);
        let mut level = vec![face];
        let mut looked = 0;
        while !level.is_empty() {
            looked += level.len();
            let width = |b: &Aabb, a: usize| b.hi[a] - b.lo[a];
            let narrow = level[0].diagonal() < narrowest;
            if looked > most || narrow || !budget.spend(level.len()) {
                out.extend(level);
                break;
            }
            let met: Vec<bool> = level
                .par_iter()
                .with_min_len(64)
                .map(|b| system::excludes(system, b).map(|e| !e))
                .collect::<Result<_, _>>()?;
            let halves = |b: &Aabb| {
                let axis = (0..3).max_by(|&i, &j| width(b, i).total_cmp(&width(b, j))).unwrap_or(0);
                let middle = 0.5 * b.lo[axis] + 0.5 * b.hi[axis];
                let (mut low, mut high) = (*b, *b);
                low.hi[axis] = middle;
                high.lo[axis] = middle;
                [low, high]
            };
            level = level.iter().zip(met).filter(|(_, m)| *m).flat_map(|(b, _)| halves(b)).collect();
        }
    }
    Ok(out)
}

/// The certificate from all critical points of a height.
fn by_critical_points(
    system: &System<'_>,
    bounds: &Aabb,
    points: Vec<Critical>,
    mut budget: Budget<'_>,
) -> Result<Certificate, GeometryError> {
    let mut out =
        Certificate { euler: Some(points.iter().map(Critical::sign).sum()), ..Certificate::default() };
    points.iter().for_each(|p| out.critical[p.index as usize] += 1);
    let class = classes(system, bounds, &points)?;
    let joined = class.iter().flatten().max().map_or(0, |m| m + 1);
    if points.is_empty() {
        out.proven = true;
        return Ok(finished(out, &budget));
    }
    if joined <= 1 || out.critical[2] == 1 {
        // One minimum, or minima that are joined, or one maximum: one component.
        out.components.extend(out.euler.map(|euler| component(euler, Some(Vec::new()))));
        out.proven = true;
        return Ok(finished(out, &budget));
    }
    let Some(pieces) = cover::separate(system, bounds, &points, &class, &mut budget)? else {
        out.reason = format!(
            "the Euler characteristic is proven, the number of components is not: the budget of boxes was used up before \
             up to {joined} were told apart"
        );
        out.doubtful = points.iter().filter(|p| p.index == 0).map(|p| p.at).collect();
        return Ok(finished(out, &budget));
    };
    for own in 0..pieces.len() {
        let euler = pieces[own].points.iter().map(|&i| points[i].sign()).sum();
        let inside = cover::around(system, bounds, &points, &pieces, own)?;
        out.components.push(component(euler, inside));
    }
    out.proven = true;
    Ok(finished(out, &budget))
}

fn component(euler: i64, inside: Option<Vec<usize>>) -> Component {
    Component { euler, genus: 1 - euler / 2, inside }
}

/// For each minimum the number of its class: minima that are joined by proven paths lie on one component. `None` for
/// other points.
fn classes(
    system: &System<'_>,
    bounds: &Aabb,
    points: &[Critical],
) -> Result<Vec<Option<usize>>, GeometryError> {
    let minima: Vec<usize> = (0..points.len()).filter(|&i| points[i].index == 0).collect();
    let lowest: Vec<&Critical> = minima.iter().map(|&i| &points[i]).collect();
    let mut parent: Vec<usize> = (0..minima.len()).collect();
    let saddles: Vec<&Critical> = points.iter().filter(|p| p.index == 1).collect();
    if minima.len() > 1 {
        let ends: Vec<Option<[usize; 2]>> = saddles
            .par_iter()
            .map(|s| joined(system, bounds, s, &lowest))
            .collect::<Result<_, GeometryError>>()?;
        for [a, b] in ends.into_iter().flatten() {
            let root = |parent: &[usize], mut i: usize| {
                while parent[i] != i {
                    i = parent[i];
                }
                i
            };
            let (a, b) = (root(&parent, a), root(&parent, b));
            parent[a.max(b)] = a.min(b);
        }
    }
    let mut number = vec![usize::MAX; minima.len()];
    let mut next = 0;
    let mut class = vec![None; points.len()];
    for (k, &i) in minima.iter().enumerate() {
        let mut r = k;
        while parent[r] != r {
            r = parent[r];
        }
        if number[r] == usize::MAX {
            number[r] = next;
            next += 1;
        }
        class[i] = Some(number[r]);
    }
    Ok(class)
}

/// The two minima that a saddle joins, where the paths are proven.
fn joined(
    system: &System<'_>,
    bounds: &Aabb,
    saddle: &Critical,
    minima: &[&Critical],
) -> Result<Option<[usize; 2]>, GeometryError> {
    let mut ends = [0; 2];
    for (k, sign) in [1.0, -1.0].into_iter().enumerate() {
        let mut end = None;
        for fine in [1.0, 0.3, 0.1] {
            let found = path::descend(system, saddle, sign, minima, bounds.diagonal(), fine)?;
            if let Some((path, m)) = found
                && path::proven(system, &path, &saddle.at, &minima[m].at)?
            {
                end = Some(m);
                break;
            }
        }
        let Some(m) = end else { return Ok(None) };
        ends[k] = m;
    }
    Ok(Some(ends))
}
