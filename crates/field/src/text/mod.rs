//! Formulas as people write them.

mod suggest;

pub(crate) use suggest::suggestion;
