//! Control points.

use crate::Error;
use crate::vector::{dot, norm, tangential};

/// How a control point may give way.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Guide {
    /// It stays where it is held.
    #[default]
    Free,
    /// It may slide along a line of this direction (a unit vector), and is dragged along it only.
    Line([f64; 3]),
    /// It may slide in the plane of this normal (a unit vector), and is dragged in it only.
    Plane([f64; 3]),
}

impl Guide {
    /// The part of a displacement that the guide allows.
    pub fn allowed(self, d: [f64; 3]) -> [f64; 3] {
        match self {
            Guide::Free => d,
            Guide::Line(u) => u.map(|c| c * dot(d, u)),
            Guide::Plane(n) => tangential(d, n),
        }
    }
}

/// A control point: the surface passes through it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pin {
    /// Where it is held (model units).
    pub at: [f64; 3],
    /// Where it is being dragged, if it is.
    pub target: Option<[f64; 3]>,
    /// What it counts beside pins that contradict it, above 0; 1 by default. It acts squared: the sum of w² s² over distances s is
    /// made small.
    pub weight: f64,
    /// 0: the surface passes through it exactly, if it can. Above 0: it may be missed; missing it by a length s
    /// costs as much as moving the surface by s/softness everywhere.
    pub softness: f64,
    /// Along what it may give way.
    pub guide: Guide,
}

impl Pin {
    /// A point that is held.
    pub fn new(at: [f64; 3]) -> Self {
        Self { at, target: None, weight: 1.0, softness: 0.0, guide: Guide::Free }
    }

    /// Points that are held come first, then those that are dragged, then soft ones: a drag never tears a held point off.
    pub(crate) fn precedence(&self) -> u8 {
        match (self.softness > 0.0, self.target) {
            (true, _) => 2,
            (false, Some(_)) => 1,
            (false, None) => 0,
        }
    }

    /// Whether all its numbers make sense.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let finite = |p: [f64; 3]| p.iter().all(|v| v.is_finite());
        let wrong = |name, expected: &str, given: String| {
            Err(Error::Option { name, expected: expected.into(), given })
        };
        if !finite(self.at) {
            return wrong("pin", "a point with finite coordinates", format!("{:?}", self.at));
        }
        if let Some(t) = self.target.filter(|&t| !finite(t)) {
            return wrong("target", "a point with finite coordinates", format!("{t:?}"));
        }
        if !(self.weight.is_finite() && self.weight > 0.0) {
            return wrong("weight", "a finite number above 0", self.weight.to_string());
        }
        if !(self.softness.is_finite() && self.softness >= 0.0) {
            return wrong("softness", "a finite number from 0 up", self.softness.to_string());
        }
        if let Guide::Line(u) | Guide::Plane(u) = self.guide
            && (!finite(u) || (norm(u) - 1.0).abs() > 1e-9)
        {
            return wrong("guide", "a direction of length 1", format!("{u:?}"));
        }
        Ok(())
    }
}
