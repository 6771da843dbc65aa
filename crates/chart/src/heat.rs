//! Tables of numbers behind colours.

/// Numbers in rows and columns, printed in cells whose colours follow them.
#[derive(Clone, Debug, Default)]
pub struct HeatMap {
    /// A short title, or none.
    pub title: String,
    /// What the rows are.
    pub row_label: String,
    /// What the columns are.
    pub column_label: String,
    /// What the numbers are, with their unit.
    pub value_label: String,
    /// The rows' names, from above.
    pub rows: Vec<String>,
    /// The columns' names, from the left.
    pub columns: Vec<String>,
    /// The numbers, a list for each row; none where nothing was measured.
    pub values: Vec<Vec<Option<f64>>>,
    /// Where two colours meet, such as 1 for ratios: one for less and one for more, the stronger the farther away. If
    /// none, there is one colour, the stronger the larger.
    pub centre: Option<f64>,
}
