//! The table of kinds.

mod about;
mod atoms;
mod blends;
mod blobs;
mod csg;
mod deformations;
mod formulas;
mod lattices;
mod polynomials;
mod reference;
mod shapes;

use std::sync::LazyLock;

use rustc_hash::FxHashMap;

pub use super::arguments::{MAX_DEGREE, coefficient_exponents, coefficient_name, monomials};
use super::kind::Kind;
pub(super) use csg::HIDDEN;
pub use reference::kinds_markdown;

static TABLE: LazyLock<Vec<Kind>> = LazyLock::new(|| {
    let parts: [&[Kind]; 10] = [
        atoms::KINDS,
        formulas::KINDS,
        shapes::KINDS,
        lattices::KINDS,
        polynomials::KINDS,
        blobs::KINDS,
        csg::KINDS,
        blends::KINDS,
        deformations::KINDS,
        about::KINDS,
    ];
    parts.concat()
});

static BY_NAME: LazyLock<FxHashMap<&'static str, &'static Kind>> = LazyLock::new(|| {
    let mut map = FxHashMap::default();
    for k in TABLE.iter() {
        for name in std::iter::once(&k.name).chain(k.aliases) {
            let twice = map.insert(*name, k).is_some();
            assert!(!twice, "two kinds are called {name}");
        }
    }
    map
});

/// All kinds, in the order of menus.
pub fn kinds() -> &'static [Kind] {
    &TABLE
}

/// The kind with this name or alias.
pub fn kind(name: &str) -> Option<&'static Kind> {
    BY_NAME.get(name).copied()
}

/// A kind that this crate itself names.
pub(crate) fn known(name: &'static str) -> &'static Kind {
    kind(name).expect("the kind is in the table")
}

/// The table as JSON: an array of objects with the fields of [`Kind`].
pub fn kinds_json() -> String {
    serde_json::to_string_pretty(kinds()).expect("names, numbers and lists are serialisable")
}
