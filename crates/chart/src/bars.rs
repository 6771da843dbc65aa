//! Stacked bars.

/// Level bars, each the sum of the same parts: what a scene costs, stage by stage.
#[derive(Clone, Debug, Default)]
pub struct BarChart {
    /// A short title, or none.
    pub title: String,
    /// What the lengths are, with their unit.
    pub label: String,
    /// The parts' names, from the left.
    pub parts: Vec<String>,
    /// The bars, from above.
    pub bars: Vec<Bar>,
}

/// A bar.
#[derive(Clone, Debug)]
pub struct Bar {
    /// Its name.
    pub name: String,
    /// The length of each part. What is not finite or negative is not drawn, and stays in the CSV file.
    pub values: Vec<f64>,
}
