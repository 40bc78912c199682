//! Rows of a matrix of which most entries are nothing.

/// Where a row's columns and values lie.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Row {
    columns: usize,
    values: usize,
    count: usize,
}

/// ∂F/∂q at some points, one row a point: only the columns that occur there. Neighbouring rows share their lists of columns.
///
/// ```
/// use isoswarm_field::SparseRows;
/// let mut rows = SparseRows::new(5);
/// rows.push_block(&[3, 1], &[2.0, 4.0, 6.0, 8.0]);
/// assert_eq!(rows.row(1), (&[3, 1][..], &[6.0, 8.0][..]));
/// assert_eq!(rows.to_dense(), [0.0, 4.0, 0.0, 2.0, 0.0, 0.0, 8.0, 0.0, 6.0, 0.0]);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SparseRows {
    width: usize,
    rows: Vec<Row>,
    columns: Vec<u32>,
    values: Vec<f64>,
}

impl SparseRows {
    /// No rows yet, of `width` columns.
    pub fn new(width: usize) -> Self {
        Self { width, ..Self::default() }
    }

    /// `count` rows with all their entries, row-major.
    ///
    /// # Panics
    /// Where there are not as many `values`.
    pub fn all(width: usize, count: usize, values: Vec<f64>) -> Self {
        assert_eq!(count * width, values.len(), "{count} rows of {width} numbers");
        let rows = (0..count).map(|i| Row { columns: 0, values: i * width, count: width }).collect();
        Self { width, rows, columns: (0..width as u32).collect(), values }
    }

    /// Adds rows that share their columns, each of which occurs once; `values` are row-major. With no columns at all, adds
    /// one row.
    pub fn push_block(&mut self, columns: &[u32], values: &[f64]) {
        debug_assert!(columns.iter().all(|&c| (c as usize) < self.width));
        let (first, count) = (self.columns.len(), columns.len());
        self.columns.extend_from_slice(columns);
        let begin = self.values.len();
        self.values.extend_from_slice(values);
        let rows = values.len().checked_div(count).unwrap_or(1);
        self.rows.extend((0..rows).map(|i| Row { columns: first, values: begin + i * count, count }));
    }

    /// Adds the rows of another.
    pub fn append(&mut self, other: &Self) {
        let (columns, values) = (self.columns.len(), self.values.len());
        self.columns.extend_from_slice(&other.columns);
        self.values.extend_from_slice(&other.values);
        self.rows.extend(other.rows.iter().map(|r| Row {
            columns: r.columns + columns,
            values: r.values + values,
            ..*r
        }));
    }

    /// Row k becomes row `place[k]`.
    pub(crate) fn placed(mut self, place: &[u32]) -> Self {
        let mut rows = self.rows.clone();
        for (row, &at) in self.rows.iter().zip(place) {
            rows[at as usize] = *row;
        }
        self.rows = rows;
        self
    }

    /// Number of columns, those that occur nowhere included.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Number of entries that are stored.
    pub fn entries(&self) -> usize {
        self.rows.iter().map(|r| r.count).sum()
    }

    /// The columns of row `i`, in no particular order, and its values there; all others are 0.
    #[inline(always)]
    pub fn row(&self, i: usize) -> (&[u32], &[f64]) {
        let Row { columns, values, count } = self.rows[i];
        (&self.columns[columns..columns + count], &self.values[values..values + count])
    }

    /// The entries of row `i`: columns and values.
    #[inline(always)]
    pub fn entries_of(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let (columns, values) = self.row(i);
        columns.iter().zip(values).map(|(&c, &v)| (c as usize, v))
    }

    /// All entries, row-major.
    pub fn to_dense(&self) -> Vec<f64> {
        let mut out = vec![0.0; self.len() * self.width];
        for (i, row) in out.chunks_exact_mut(self.width.max(1)).enumerate() {
            self.entries_of(i).for_each(|(c, v)| row[c] = v);
        }
        out
    }
}
