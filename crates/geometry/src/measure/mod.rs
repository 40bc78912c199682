//! Measures of a surface: area, volume, moments, curvature integrals, and whatever the user integrates.
//!
//! The triangles of a mesh are bent onto F = 0 ([`curved`]) and integrated by Gauss rules of degree 6; the rule of degree 8
//! says how far that is off. A triangle whose rules differ too much is divided. The patches cover the surface once as
//! long as the mesh has its topology, so that only the rules are in error: the signed measure n · (∂y/∂u × ∂y/∂v) even
//! makes up for patches that fold over.

mod curved;
mod directions;
mod divide;
mod gaps;
mod integrals;
mod result;
mod rules;
mod weights;

use isoswarm_field::vector::V3;
use isoswarm_field::{Aabb, Surface};

use crate::GeometryError;
use crate::mesh::Mesh;
use curved::{Flat, Leaf, Nodes};
use divide::Divided;
use integrals::{AREA, OfLeaf, Sums, VOLUME};
use rules::{NODES, REPORTED};
use weights::{Frame, Moments};

pub use result::{Estimate, Measures, Moment};

/// Leaves whose nodes are on their way at a time.
const BLOCK: usize = 4096;
/// A triangle is divided by four no more often.
const DEEPEST: u8 = 8;
/// Triangles that are added where normals turn, at most so many times their number.
const MOST_TURNING: usize = 4;
/// Places in doubt that are returned.
const MOST_PLACES: usize = 1000;

/// A function to integrate: fills `value[i]` from a point on the surface and the outward unit normal there. Called on
/// the calling thread for many points at once; a message stops the work.
pub type Integrand<'a> = dyn Fn(&[[f64; 3]], &[[f64; 3]], &mut [f64]) -> Result<(), String> + 'a;

/// How [`measure`] goes about it.
pub struct MeasureOptions<'a> {
    /// Relative error of area and volume above which triangles are divided. Default: 1e-9.
    pub tolerance: f64,
    /// Parts that triangles may be divided into, altogether, in multiples of their number. Default: 16.
    pub most: usize,
    /// The box that clips the surface: boundaries of the mesh on its faces stay on them.
    pub bounds: Option<Aabb>,
    /// Whether to integrate curvatures, which needs second derivatives. Default: yes.
    pub curvature: bool,
    /// Whether to make weights of the vertices. Default: yes.
    pub weights: bool,
    /// The user's functions.
    pub integrands: Vec<&'a Integrand<'a>>,
    /// Called between blocks of work with the part that is done; `false` stops it.
    pub goes_on: Option<&'a mut dyn FnMut(f64) -> bool>,
}

impl Default for MeasureOptions<'_> {
    fn default() -> Self {
        Self {
            tolerance: 1e-9,
            most: 16,
            bounds: None,
            curvature: true,
            weights: true,
            integrands: Vec::new(),
            goes_on: None,
        }
    }
}

/// Measures the surface F = 0 that `mesh` triangulates: a manifold, oriented, with vertices near the surface and edges
/// shorter than its radii of curvature.
///
/// # Errors
/// A mesh without triangles or with vertices that are not finite, options that make no sense, a function of the user's
/// that fails, and whatever the field reports. What the surface is to blame for (an open mesh, creases, singular points)
/// is no error: the result says what it does not guarantee, and where.
///
/// ```
/// use isoswarm_field::{Field, text};
/// use isoswarm_geometry::{Mesh, MeasureOptions, measure};
/// let ball = Field::new(&text::parse("x^2 + y^2 + z^2 - 1", &[])?)?;
/// // An octahedron is a poor ball; its triangles are divided until they fit.
/// let points = vec![[1., 0., 0.], [0., 1., 0.], [-1., 0., 0.], [0., -1., 0.], [0., 0., 1.], [0., 0., -1.]];
/// let up = (0..4).map(|k| [k, (k + 1) % 4, 4]);
/// let down = (0..4).map(|k| [(k + 1) % 4, k, 5]);
/// let mesh = Mesh::new(points, up.chain(down).collect());
/// let found = measure(&ball, &mesh, MeasureOptions { most: 1000, ..Default::default() })?;
/// let volume = found.volume.unwrap();
/// assert!((volume.value - 4.0 / 3.0 * std::f64::consts::PI).abs() < volume.error && volume.error < 1e-7);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn measure(
    surface: &dyn Surface,
    mesh: &Mesh,
    options: MeasureOptions<'_>,
) -> Result<Measures, GeometryError> {
    check(surface, mesh, &options)?;
    let topology = mesh.topology();
    let directions = directions::directions(surface, mesh, &topology, options.bounds.as_ref())?;
    let room = options.most.min(MOST_TURNING) * mesh.faces.len();
    let divided = Divided::new(surface, mesh, &directions.at, room)?;
    let mut work = Work::new(surface, mesh, &divided, options);
    work.run()?;
    let weights = if work.moments.is_empty() {
        Vec::new()
    } else {
        weights::weights(mesh, &directions.normals, &work.moments)
    };
    let has_curvature = work.has_curvature && work.options.curvature;
    let places = std::mem::take(&mut work.places);
    let gaps = gaps::gaps(mesh, &topology, work.options.bounds.as_ref());
    let over = result::Over { mesh, topology: &topology, gaps };
    Ok(result::collect(&work.sums, &over, work.origin, has_curvature, weights, places))
}

fn check(surface: &dyn Surface, mesh: &Mesh, options: &MeasureOptions<'_>) -> Result<(), GeometryError> {
    let wrong = |name, expected, given: String| Err(GeometryError::Option { name, expected, given });
    if surface.axes() != 3 {
        return wrong(
            "field",
            "a surface in space: a function of x, y and z",
            format!("{} axes", surface.axes()),
        );
    }
    if mesh.faces.is_empty() {
        return wrong("mesh", "at least one triangle", "none".into());
    }
    if let Some(f) = mesh.faces.iter().flatten().find(|v| **v as usize >= mesh.points.len()) {
        let given = format!("vertex {f} of {}", mesh.points.len());
        return wrong("mesh", "triangles over vertices that are there", given);
    }
    if let Some(row) = mesh.points.iter().position(|p| p.iter().any(|v| !v.is_finite())) {
        return Err(GeometryError::NotFinite { column: "points", row, value: f64::NAN });
    }
    if !(options.tolerance > 0.0 && options.tolerance.is_finite()) {
        return wrong("tolerance", "a relative error above 0", options.tolerance.to_string());
    }
    Ok(())
}

/// The integration under way.
struct Work<'w, 'a> {
    surface: &'w dyn Surface,
    /// The mesh, for the moments of its triangles.
    whole: &'w Mesh,
    /// The triangles that are integrated over.
    divided: &'w Divided,
    options: MeasureOptions<'a>,
    origin: V3,
    sums: Sums,
    /// Differences of the rules for area and volume above which a leaf is divided.
    limits: [f64; 2],
    moments: Vec<Moments>,
    has_curvature: bool,
    places: Vec<V3>,
    /// Leaves looked at.
    done: usize,
}

impl<'w, 'a> Work<'w, 'a> {
    fn new(
        surface: &'w dyn Surface,
        whole: &'w Mesh,
        divided: &'w Divided,
        options: MeasureOptions<'a>,
    ) -> Self {
        let mesh = &divided.mesh;
        let bounds = Aabb::around(&mesh.points).unwrap_or(Aabb::new([0.0; 3], [0.0; 3]));
        let origin = bounds.middle();
        // Errors of the triangles are as good as independent: so much each makes the tolerance altogether.
        let share = options.tolerance / (mesh.faces.len() as f64).sqrt();
        let (area, volume) = (mesh.area(), mesh.volume().abs());
        // The volume of an open surface means nothing.
        let volume = volume.max(1e-3 * area * bounds.diagonal());
        let moments = if options.weights { vec![[0.0; 9]; whole.faces.len()] } else { Vec::new() };
        Self {
            surface,
            whole,
            divided,
            origin,
            sums: Sums::new(options.integrands.len()),
            limits: [share * area, share * volume],
            moments,
            has_curvature: true,
            places: Vec::new(),
            done: 0,
            options,
        }
    }

    fn run(&mut self) -> Result<(), GeometryError> {
        let mut level: Vec<Leaf> = (0..self.divided.mesh.faces.len() as u32).map(Leaf::whole).collect();
        let mut room = self.options.most.saturating_mul(level.len());
        while !level.is_empty() {
            let mut next = Vec::new();
            for block in level.chunks(BLOCK) {
                self.block(block, &mut room, &mut next)?;
                self.done += block.len();
                let part = self.done as f64 / (self.done + next.len() + level.len()) as f64;
                if self.options.goes_on.as_mut().is_some_and(|go| !go(part)) {
                    return Err(GeometryError::Cancelled);
                }
            }
            level = next;
        }
        Ok(())
    }

    fn block(
        &mut self,
        leaves: &[Leaf],
        room: &mut usize,
        next: &mut Vec<Leaf>,
    ) -> Result<(), GeometryError> {
        let flat = |f: u32| Flat {
            p: self.divided.mesh.corners(f as usize),
            d: self.divided.mesh.faces[f as usize].map(|v| self.divided.directions[v as usize]),
        };
        let nodes = Nodes::place(self.surface, leaves, flat, self.options.curvature)?;
        self.has_curvature &= !nodes.hessian.is_empty();
        let user = self.user(&nodes)?;
        for (k, leaf) in leaves.iter().enumerate() {
            let of_leaf = OfLeaf::new(&nodes, k, self.origin, &user);
            let off =
                of_leaf.lost || of_leaf.off(AREA) > self.limits[0] || of_leaf.off(VOLUME) > self.limits[1];
            if off && leaf.depth < DEEPEST && *room >= 4 {
                *room -= 4;
                next.extend(leaf.quarters());
                continue;
            }
            self.sums.add(&of_leaf, off);
            if off && self.places.len() < MOST_PLACES {
                self.places.push(nodes.points[k * NODES]);
            }
            if !self.moments.is_empty() {
                let (face, corners) = self.divided.part_of[leaf.face as usize];
                let (moments, frame) =
                    (&mut self.moments[face as usize], Frame::new(self.whole.corners(face as usize)));
                for i in k * NODES..k * NODES + REPORTED {
                    let b = nodes.bary[i];
                    let bary = [0, 1, 2].map(|a| (0..3).map(|c| b[c] * corners[c][a]).sum());
                    frame.add(moments, nodes.points[i], bary, nodes.measure[i]);
                }
            }
        }
        Ok(())
    }

    /// The user's functions at all nodes.
    fn user(&self, nodes: &Nodes) -> Result<Vec<Vec<f64>>, GeometryError> {
        let one = |f: &&Integrand<'_>| {
            let mut value = vec![0.0; nodes.points.len()];
            f(&nodes.points, &nodes.normals, &mut value).map_err(GeometryError::Integrand)?;
            match value.iter().position(|v| !v.is_finite()) {
                None => Ok(value),
                Some(i) => Err(GeometryError::Integrand(format!(
                    "expected finite numbers, but at {:?} it gave {}",
                    nodes.points[i], value[i]
                ))),
            }
        };
        self.options.integrands.iter().map(one).collect()
    }
}
