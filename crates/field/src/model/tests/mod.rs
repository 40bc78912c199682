//! Tests of the table, of shapes and operators, of parameters, and of limits.

mod adapters;
mod limits;
mod operators;
mod parameters;
pub(crate) mod samples;
mod shapes;
mod table;

use std::sync::Arc;

use super::kinds::monomials;
use super::{Layout, Lowered, Model, Payload, Value, kinds};
use crate::FieldError;
use crate::graph::Expr;
use samples::*;
