//! Numbers of a report, read back from its CSV files: what the first page and the documentation quote.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};

/// Name of a page's file.
pub(crate) const PAGE: &str = "index.html";

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

    /// The first of [`Numbers::values`].
    pub(crate) fn value(&self, having: &[(&str, &str)], wanted: &str) -> Option<f64> {
        self.values(having, wanted).first().copied()
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
    use std::collections::BTreeMap;

    use report::significant;
    use serde::Deserialize;

    use super::*;

    /// A sentence of the documentation with numbers of the report: `docs/numbers.toml`.
    #[derive(Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Quoted {
        /// The file, from the root of the repository.
        file: String,
        /// The text, with `{}` for each number.
        text: String,
        /// Where the numbers come from.
        from: Vec<Source>,
    }

    #[derive(Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Source {
        page: String,
        csv: String,
        #[serde(default, rename = "where")]
        having: BTreeMap<String, String>,
        column: String,
        /// Significant digits; as it stands where there are none.
        digits: Option<usize>,
    }

    #[derive(Deserialize)]
    #[serde(deny_unknown_fields)]
    struct All {
        numbers: Vec<Quoted>,
    }

    fn value(source: &Source) -> String {
        let Source { page, csv, having, column, digits } = source;
        let root = Path::new(crate::sources::ROOT);
        let numbers = Folder(root.join("report")).read(page, csv).unwrap();
        let numbers = numbers.unwrap_or_else(|| panic!("the report has no {page}/csv/{csv}.csv"));
        let having: Vec<_> = having.iter().map(|(name, value)| (name.as_str(), value.as_str())).collect();
        let found: Vec<_> = numbers.select(&having, [column]).collect();
        assert_eq!(found.len(), 1, "{page}/csv/{csv}.csv, {having:?}: {} rows", found.len());
        let [text] = found[0];
        match digits {
            Some(digits) => {
                let number = leading(text).unwrap_or_else(|| panic!("{text:?} of {csv} begins with no number"));
                significant(number, *digits)
            }
            None => text.to_owned(),
        }
    }

    #[test]
    fn the_documentation_quotes_the_report_as_it_stands() {
        let root = Path::new(crate::sources::ROOT);
        let read = |file: &str| std::fs::read_to_string(root.join(file)).unwrap();
        let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        let all: All = toml::from_str(&read("docs/numbers.toml")).unwrap();
        assert!(!all.numbers.is_empty());
        for Quoted { file, text, from } in &all.numbers {
            let values: Vec<String> = from.iter().map(value).collect();
            let parts: Vec<&str> = text.split("{}").collect();
            assert_eq!(parts.len(), values.len() + 1, "{text}");
            let filled: String =
                parts.iter().zip(values.iter().map(String::as_str).chain([""])).flat_map(|(a, b)| [*a, b]).collect();
            assert!(words(&read(file)).contains(&words(&filled)), "{file} must say: {filled}");
        }
    }

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
