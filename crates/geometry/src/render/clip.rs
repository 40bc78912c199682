//! The convex region in which the surface is looked at: a box and planes, and where rays enter and leave it.

use isoswarm_field::Aabb;
use isoswarm_field::vector::dot;

use super::Ray;

/// The half-space normal · x ≤ offset is kept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Any length but zero; points out of what is kept.
    pub normal: [f64; 3],
    /// Of the plane normal · x = offset.
    pub offset: f64,
}

/// A box and planes that cut it.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    /// Outside nothing is looked for.
    pub bounds: Aabb,
    /// Section planes.
    pub planes: Vec<Plane>,
}

impl Clip {
    /// Faces of the box come first: low x, high x, low y, …; then the planes.
    pub const BOX_FACES: u16 = 6;

    /// A box without planes.
    pub fn new(bounds: Aabb) -> Self {
        Self { bounds, planes: Vec::new() }
    }

    /// Outward normal of a face.
    pub fn normal(&self, face: u16) -> [f64; 3] {
        if face >= Self::BOX_FACES {
            return self.planes[usize::from(face - Self::BOX_FACES)].normal;
        }
        let mut n = [0.0; 3];
        n[usize::from(face / 2)] = if face.is_multiple_of(2) { -1.0 } else { 1.0 };
        n
    }

    /// The part of a ray beyond `near` that lies in the region.
    pub fn ray(&self, origin: [f64; 3], direction: [f64; 3], near: f64) -> Ray {
        let mut r = Ray { origin, direction, near, far: f64::INFINITY, face: None };
        for face in 0..Self::BOX_FACES + self.planes.len() as u16 {
            let (a, high) = (usize::from(face / 2), face % 2 == 1);
            let (rate, gap) = match face {
                0..Self::BOX_FACES if high => (direction[a], self.bounds.hi[a] - origin[a]),
                0..Self::BOX_FACES => (-direction[a], origin[a] - self.bounds.lo[a]),
                _ => {
                    let p = &self.planes[usize::from(face - Self::BOX_FACES)];
                    (dot(p.normal, direction), p.offset - dot(p.normal, origin))
                }
            };
            // Kept is rate · t ≤ gap.
            if rate > 0.0 {
                r.far = r.far.min(gap / rate);
            } else if rate < 0.0 {
                if gap / rate > r.near {
                    (r.near, r.face) = (gap / rate, Some(face));
                }
            } else if gap < 0.0 {
                r.far = f64::NEG_INFINITY;
            }
        }
        r
    }
}
