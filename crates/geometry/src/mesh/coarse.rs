//! Meshes made coarse to fine: few samples, stitched, and every triangle made four until there are as many as asked for.
//!
//! Few samples cost little to spread and to stitch, and what is done to their mesh (repair, valences, smoothing) costs little too. Its
//! children inherit its topology and have no new vertices of other than six triangles; a few rounds of smoothing round off what is left of their
//! parents' edges. That is right where the coarse mesh resolves the surface; where it does not, or does not show that it does,
//! more samples are tried, and at last as many as there are to be vertices.

use isoswarm_field::vector::{V3, cross, dot, norm, sub};
use isoswarm_field::{Aabb, FieldError, Surface};
use isoswarm_particles as particles;
use isoswarm_particles::{Amount, Error, Options, ProgressFn, Samples, Status};

use super::build::{Draft, Meshed, Resolution, finish, improve};
use super::crease::Segments;
use super::subdivide::subdivide;

/// Fewest samples.
const FEWEST: usize = 500;
/// Most subdivisions.
const LEVELS: u32 = 3;
/// Turn of the normal within the spacing, radians, up to which a coarse mesh resolves the surface.
const TURN: f64 = 0.6;
/// Cosine between the normals at the ends of an edge, at least.
const LEVEL: f64 = 0.8;
/// The same between a triangle of the result and its corners' normals.
const FLAT: f64 = 0.9;
/// Rounds of smoothing after each subdivision.
const ROUNDS: usize = 6;

/// What [`mesh`] is asked for.
pub(super) struct Wish {
    pub(super) resolution: Resolution,
    pub(super) creases: bool,
    pub(super) smoothing: usize,
    pub(super) intersections: bool,
    pub(super) seed: u64,
    pub(super) most: usize,
}

/// A mesh from few samples; `None` where few do not resolve the surface.
pub(super) fn mesh(
    surface: &dyn Surface,
    bounds: &Aabb,
    wish: &Wish,
    progress: &mut ProgressFn<'_>,
) -> Result<Option<Meshed>, Error> {
    let Resolution::Count(n) = wish.resolution else { return Ok(None) };
    let mut evaluations = 0;
    let mut level = LEVELS.min((n / FEWEST).checked_ilog(4).unwrap_or(0));
    while level > 0 {
        let few = n.div_ceil(1 << (2 * level));
        let options = Options {
            amount: Amount::Count(few),
            creases: wish.creases,
            seed: wish.seed,
            most: wish.most,
            progress: Some(&mut *progress),
            ..Options::default()
        };
        let samples = match particles::sample(surface, bounds, options) {
            Err(Error::TooFew { .. }) => {
                level -= 1;
                continue;
            }
            other => other?,
        };
        evaluations += samples.report.evaluations;
        let Some(most) = turn(&samples) else { return Ok(None) };
        if most <= TURN
            && let Some(mut made) = refine(surface, bounds, &samples, level, wish)?
        {
            made.report.evaluations += evaluations - samples.report.evaluations;
            return Ok(Some(made));
        }
        // Each level halves the turn.
        level -= 1;
        while level > 0 && 0.5 * most > TURN {
            level -= 1;
        }
    }
    Ok(None)
}

/// Largest turn of the normal within the spacing; `None` where more samples of this kind are of no use.
fn turn(samples: &Samples) -> Option<f64> {
    if samples.points.is_empty() || samples.creases.is_some() || samples.report.status != Status::Converged {
        return None;
    }
    let one = |i: usize| 2.0 * samples.radii[i] * samples.curvatures[i][0].abs();
    let mut turns = (0..samples.points.len()).map(one);
    turns.try_fold(0.0f64, |m, t| t.is_finite().then(|| m.max(t)))
}

/// Stitches samples and subdivides the triangles; `None` where the mesh is not in order at any stage.
fn refine(
    surface: &dyn Surface,
    bounds: &Aabb,
    samples: &Samples,
    level: u32,
    wish: &Wish,
) -> Result<Option<Meshed>, FieldError> {
    let Draft { mut triangles, mut vertices, mut held, mut report } =
        Draft::stitch(surface, bounds, samples)?;
    if !report.doubtful.is_empty() || !report.warnings.is_empty() {
        return Ok(None);
    }
    let segments = Segments::default();
    improve(surface, wish.smoothing, &segments, &mut triangles, &mut vertices, &mut held, &mut report)?;
    if !faces_outwards(&triangles.faces, &vertices.points, &vertices.normals, LEVEL) {
        return Ok(None);
    }
    for _ in 0..level {
        let Some(finer) = subdivide(surface, &triangles, &mut vertices)? else { return Ok(None) };
        triangles = finer;
        held.resize(vertices.len(), false);
        improve(surface, ROUNDS, &segments, &mut triangles, &mut vertices, &mut held, &mut report)?;
    }
    if !faces_outwards(&triangles.faces, &vertices.points, &vertices.normals, FLAT) {
        return Ok(None);
    }
    Ok(Some(finish(surface, samples, wish.intersections, true, vertices, triangles.faces, report)?))
}

/// Whether every triangle lies along the surface at its corners: the cosine between them is above `least`.
fn faces_outwards(faces: &[[u32; 3]], points: &[V3], normals: &[V3], least: f64) -> bool {
    faces.iter().all(|f| {
        let [a, b, c] = f.map(|v| points[v as usize]);
        let front = cross(sub(b, a), sub(c, a));
        let length = norm(front);
        f.iter().all(|&v| dot(front, normals[v as usize]) > least * length)
    })
}
