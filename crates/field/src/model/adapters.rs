//! Adapters: deformations that a person drags and that hand their effect over to what they are wrapped around (HBJF02
//! section 5).
//!
//! An adapter is a node of an ordinary kind at its identity. While it is dragged its operand is frozen; the operand's
//! parameters then follow (`isoswarm_particles::control::transfer`), and the adapter is removed.

use std::sync::Arc;

use super::{Kind, Model, Param, Payload, kinds};
use crate::{Aabb, FieldError};

/// A row of the table of adapters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdapterKind {
    /// What people call it.
    pub name: &'static str,
    /// The kind of node that it is; the parameters that are free by default are the adapter's, and their defaults are its identity.
    pub node: &'static str,
    /// What it does, in a sentence.
    pub doc: &'static str,
}

/// All adapters, in the order of menus.
pub const ADAPTERS: &[AdapterKind] = &[
    AdapterKind { name: "mover", node: "translate", doc: "Moves." },
    AdapterKind { name: "rotate", node: "rotate_about", doc: "Turns about the centre." },
    AdapterKind { name: "scale", node: "scale_about", doc: "Stretches along x, y and z, about the centre." },
    AdapterKind { name: "taper", node: "taper_about", doc: "Widens along the axis." },
    AdapterKind { name: "twist", node: "twist_about", doc: "Twists about the axis." },
    AdapterKind { name: "bend", node: "bend_about", doc: "Bends about the axis." },
    AdapterKind {
        name: "lattice",
        node: "free_form",
        doc: "Deforms freely, by a lattice of control points.",
    },
];

/// The row of the table with this name.
pub fn adapter_kind(name: &str) -> Result<&'static AdapterKind, FieldError> {
    ADAPTERS.iter().find(|a| a.name == name).ok_or_else(|| {
        let known: Vec<&str> = ADAPTERS.iter().map(|a| a.name).collect();
        FieldError::Invalid(format!("there is no adapter `{name}`; there are: {}", known.join(", ")))
    })
}

/// An adapter and where it acts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adapter {
    /// What it does.
    pub kind: &'static AdapterKind,
    /// The point that stays (a mover has none).
    pub center: [f64; 3],
    /// 0: x, 1: y, 2: z, of a taper, a twist or a bend.
    pub axis: usize,
    /// Half of the size of the lattice's box, lengths above 0.
    pub half: [f64; 3],
    /// Control points of the lattice along x, y and z, 2 to 8 each.
    pub controls: [usize; 3],
}

impl Adapter {
    /// The adapter called `name` for what lies in `bounds`: its centre is the box's, a lattice reaches an eighth beyond it and has three
    /// control points along each axis. The axis is z.
    pub fn around(name: &str, bounds: &Aabb) -> Result<Self, FieldError> {
        let center = bounds.middle();
        let widest = (0..3).fold(0.0f64, |w, a| w.max(bounds.hi[a] - bounds.lo[a]));
        let half = [0, 1, 2].map(|a| 0.5 * (bounds.hi[a] - bounds.lo[a]) + 0.125 * widest);
        Ok(Self { kind: adapter_kind(name)?, center, axis: 2, half, controls: [3; 3] })
    }

    fn value(&self, name: &str) -> Option<f64> {
        let axis = |c: u8| usize::from(c - b'x');
        match *name.as_bytes() {
            [b'c', c @ b'x'..=b'z'] => Some(self.center[axis(c)]),
            [c @ b'x'..=b'z', b'0'] => Some(self.center[axis(c)] - self.half[axis(c)]),
            [b's', c @ b'x'..=b'z'] if self.kind.node == "free_form" => Some(2.0 * self.half[axis(c)]),
            [b'n', c @ b'x'..=b'z'] => Some(self.controls[axis(c)] as f64),
            _ if name == "axis" => Some(self.axis as f64),
            _ => None,
        }
    }

    /// The node's parameters at the identity: where it acts is frozen, the rest is free.
    fn params(&self, kind: &Kind) -> Vec<Param> {
        let mut params: Vec<Param> = kind.params.iter().map(Param::from_spec).collect();
        for p in &mut params {
            let name = p.name.clone();
            p.value = self.value(&name).unwrap_or(p.value);
        }
        if self.kind.node == "free_form" {
            for i in 0..self.controls.iter().product() {
                for spec in kind.group {
                    let name: Arc<str> = format!("{}{i}", spec.name).into();
                    params.push(Param { name, ..Param::from_spec(spec) });
                }
            }
        }
        params
    }
}

/// `operand` with the adapter around it, at its identity, under `name`: the same surface. Free are the adapter's own parameters and, as they
/// were, the operand's.
///
/// # Errors
/// `Invalid` where the adapter's settings are outside what the kind accepts, or `name` cannot be a name.
pub fn wrap(adapter: &Adapter, operand: &Model, name: &str) -> Result<Model, FieldError> {
    if adapter.kind.node == "free_form" && adapter.controls.iter().any(|n| !(2..=8).contains(n)) {
        return Err(FieldError::Invalid(format!(
            "controls: expected 2 to 8 along each axis, given {:?}",
            adapter.controls
        )));
    }
    let kind = kinds::known(adapter.kind.node);
    Model::new(kind, adapter.params(kind), vec![operand.clone()], Payload::None)?.named(name)
}

/// The numbers and values of the parameters that an adapter's node moves, at its identity: `(i, value)` for parameter i of
/// [`Model::params`]. `None` where the node's kind is none of an adapter.
pub fn identity(node: &Model) -> Option<Vec<(usize, f64)>> {
    ADAPTERS.iter().find(|a| a.node == node.kind().name)?;
    let kind = node.kind();
    let moved = |i: usize| kind.spec(i).filter(|s| !s.frozen && !s.discrete).map(|s| (i, s.default));
    Some((0..node.params().len()).filter_map(moved).collect())
}

/// Whether an adapter's node does nothing.
pub fn is_identity(node: &Model) -> bool {
    let still =
        |&(i, value): &(usize, f64)| node.params()[i].expr.is_none() && node.params()[i].value == value;
    identity(node).is_some_and(|all| all.iter().all(still))
}

/// D⁻¹ of an adapter's node (or of any deformation of one operand) with its present parameters: the three coordinates of the point that
/// it takes to p, as models over p. Parameters are those of the node.
pub fn inverse(node: &Model) -> Result<[Model; 3], FieldError> {
    if node.operands().len() != 1 {
        return Err(FieldError::Invalid(format!(
            "expected a deformation with one operand, given {} with {}",
            node.kind().name,
            node.operands().len()
        )));
    }
    let coordinate =
        |a| Model::new(node.kind(), node.params().to_vec(), vec![Model::axis(a)], node.payload().clone());
    Ok([coordinate(0)?, coordinate(1)?, coordinate(2)?])
}
