//! Tables of numbers behind colours.

use crate::{NumberFormat, Scale};

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
    /// How the numbers are printed.
    pub format: NumberFormat,
    /// How colours follow numbers. On a logarithmic scale a half is as far from one as two is.
    pub scale: Scale,
    /// Which colours.
    pub colours: ColourScale,
}

/// Which colours stand for numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum ColourScale {
    /// One colour, the stronger the larger.
    #[default]
    Sequential,
    /// One colour below a centre and one above it, the stronger the farther from it.
    Diverging {
        /// Where the colours meet, such as 1 for ratios.
        centre: f64,
    },
}
