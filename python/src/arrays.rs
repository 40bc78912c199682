//! NumPy arrays to and from the core's columns. Inputs are copied, so that Python may change them meanwhile.

use std::ops::Range;

use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// An (n, 3) array as the core's points.
pub fn points(what: &str, array: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<[f64; 3]>> {
    rows::<3>(what, array)
}

/// How many points an (n, 3) array holds.
pub fn count(what: &str, array: &PyReadonlyArray2<'_, f64>) -> PyResult<usize> {
    columns(what, 3, array.as_array().dim())
}

/// The first `axes` coordinates of some of the points, one after another, in place of what `out` holds.
pub fn some_points(array: &PyReadonlyArray2<'_, f64>, rows: Range<usize>, axes: usize, out: &mut Vec<f64>) {
    let view = array.as_array();
    out.clear();
    match view.to_slice().filter(|_| axes == view.ncols()) {
        Some(all) => out.extend_from_slice(&all[axes * rows.start..axes * rows.end]),
        None => rows.for_each(|i| out.extend((0..axes).map(|a| view[(i, a)]))),
    }
}

/// An (n, K) array as rows.
pub fn rows<const K: usize>(what: &str, array: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<[f64; K]>> {
    table(what, array)
}

/// An (f, 3) array of vertex numbers as the core's triangles.
pub fn faces(array: &PyReadonlyArray2<'_, i64>) -> PyResult<Vec<[u32; 3]>> {
    let rows = table::<3, i64>("faces", array)?;
    let wrong = |row: &[i64; 3]| {
        PyValueError::new_err(format!("faces: expected vertex numbers from 0 to 4294967295, given {row:?}"))
    };
    let number = |row: &[i64; 3]| {
        let [a, b, c] = row.map(u32::try_from);
        a.and_then(|a| Ok([a, b?, c?])).map_err(|_| wrong(row))
    };
    rows.iter().map(number).collect()
}

fn table<const K: usize, T: numpy::Element + Copy>(
    what: &str,
    array: &PyReadonlyArray2<'_, T>,
) -> PyResult<Vec<[T; K]>> {
    let view = array.as_array();
    columns(what, K, view.dim())?;
    Ok(view.rows().into_iter().map(|row| std::array::from_fn(|a| row[a])).collect())
}

/// The rows of an array, if it has so many columns.
fn columns(what: &str, wanted: usize, given: (usize, usize)) -> PyResult<usize> {
    if given.1 == wanted {
        return Ok(given.0);
    }
    Err(PyValueError::new_err(format!("{what}: expected shape (n, {wanted}), given {given:?}")))
}

/// An (n,) array as a column.
pub fn column<T: numpy::Element + Copy>(array: &PyReadonlyArray1<'_, T>) -> Vec<T> {
    array.as_array().iter().copied().collect()
}

/// Rows as an (n, K) array, without a copy.
pub fn from_rows<const K: usize>(py: Python<'_>, rows: Vec<[f64; K]>) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let n = rows.len();
    rows.into_flattened().into_pyarray(py).reshape([n, K])
}

/// A column as an (n,) array, without a copy.
pub fn from_column(py: Python<'_>, values: Vec<f64>) -> Bound<'_, PyArray1<f64>> {
    values.into_pyarray(py)
}

/// Numbers as an (n, m) array, without a copy; m may be 0.
pub fn matrix(py: Python<'_>, values: Vec<f64>, n: usize, m: usize) -> PyResult<Bound<'_, PyArray2<f64>>> {
    values.into_pyarray(py).reshape([n, m])
}

/// Nine numbers a point as an (n, 3, 3) array, without a copy.
pub fn cube(py: Python<'_>, values: Vec<f64>) -> PyResult<Bound<'_, PyArray3<f64>>> {
    let n = values.len() / 9;
    values.into_pyarray(py).reshape([n, 3, 3])
}
