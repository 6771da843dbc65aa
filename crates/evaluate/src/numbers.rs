//! Numbers of a report, read back from its CSV files: what the first page and the documentation quote.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};

/// A CSV file of a report.
pub(crate) struct Numbers {
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
}

/// Where a report lies.
pub(crate) struct Folder(pub(crate) PathBuf);

impl Folder {
    /// The file `PAGE/csv/NAME.csv`; `None` where the report does not have it.
    pub(crate) fn read(&self, page: &str, name: &str) -> Result<Option<Numbers>> {
        let path = self.0.join(page).join("csv").join(format!("{name}.csv"));
        if path.is_file() { Numbers::read(&path).map(Some) } else { Ok(None) }
    }
}

impl Numbers {
    fn read(path: &Path) -> Result<Self> {
        let read = || -> Result<Self, csv::Error> {
            let mut reader = csv::Reader::from_path(path)?;
            let list = |record: &csv::StringRecord| record.iter().map(str::to_owned).collect();
            let columns = list(reader.headers()?);
            let rows = reader.records().map(|record| Ok(list(&record?))).collect::<Result<_, csv::Error>>()?;
            Ok(Self { columns, rows })
        };
        read().with_context(|| format!("cannot read {}", path.display()))
    }

    /// Place of the column that is called so, the first if there are several.
    fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column == name)
    }

    /// The rows whose columns have these values, and of each what stands in the `wanted` columns.
    pub(crate) fn select<'a, const N: usize>(
        &'a self,
        having: &[(&str, &str)],
        wanted: [&str; N],
    ) -> impl Iterator<Item = [&'a str; N]> {
        let having: Vec<_> = having.iter().map(|(name, value)| (self.column(name), (*value).to_owned())).collect();
        let wanted = wanted.map(|name| self.column(name));
        let holds = move |row: &&Vec<String>| {
            having.iter().all(|(column, value)| column.is_some_and(|column| row[column] == *value))
        };
        self.rows
            .iter()
            .filter(holds)
            .map(move |row| wanted.map(|column| column.map_or("", |column| row[column].as_str())))
    }

    /// Numbers with which the texts of a column begin, of the rows whose columns have these values.
    pub(crate) fn values(&self, having: &[(&str, &str)], wanted: &str) -> Vec<f64> {
        self.select(having, [wanted]).filter_map(|[text]| leading(text)).collect()
    }

    /// The points of a curve: of the `series` of the `chart`.
    pub(crate) fn curve(&self, chart: &str, series: &str) -> Vec<[f64; 2]> {
        let number = |text: &str| text.parse::<f64>().ok();
        let having = [("chart", chart), ("series", series)];
        self.select(&having, ["x", "y"]).filter_map(|[x, y]| Some([number(x)?, number(y)?])).collect()
    }

    /// The different texts of a column, in their order.
    pub(crate) fn distinct(&self, name: &str) -> Vec<&str> {
        let mut texts = Vec::new();
        for [text] in self.select(&[], [name]) {
            if !texts.contains(&text) {
                texts.push(text);
            }
        }
        texts
    }
}

/// The number with which a text begins, such as 0.564 of "0.564 (-0.322 to 0.694)".
fn leading(text: &str) -> Option<f64> {
    text.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_found_by_their_values() {
        let folder = tempfile::tempdir().unwrap();
        let csv = folder.path().join("page/csv");
        std::fs::create_dir_all(&csv).unwrap();
        std::fs::write(csv.join("a.csv"), "chart,series,x,y\nc,s,1,2\nc,s,3,4.5 (4 to 5)\nc,t,5,6\n").unwrap();
        let folder = Folder(folder.path().to_owned());
        assert!(folder.read("page", "b").unwrap().is_none());
        let numbers = folder.read("page", "a").unwrap().unwrap();
        assert_eq!(numbers.values(&[("series", "s")], "y"), [2.0, 4.5]);
        assert_eq!(numbers.curve("c", "t"), [[5.0, 6.0]]);
        assert_eq!(numbers.distinct("series"), ["s", "t"]);
        assert!(numbers.values(&[("no column", "s")], "y").is_empty());
    }
}
