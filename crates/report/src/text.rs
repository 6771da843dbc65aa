//! Tables as text, for a terminal.

use crate::{Cell, Table};

impl Table {
    /// The columns side by side, under headings that are broken where they are longer than what stands below; what stands
    /// out has a star before it. No line ends in blanks.
    pub fn text(&self) -> String {
        let text = |cell: &Cell| match cell.class {
            " strong" => format!("*{}", cell.text),
            _ => cell.text.clone(),
        };
        let body: Vec<Vec<String>> = self.rows.iter().map(|row| row.iter().map(text).collect()).collect();
        let widest = |k: usize| body.iter().filter_map(|row| row.get(k)).map(|text| length(text)).max().unwrap_or(0);
        let columns = self.columns.iter().enumerate();
        let headings: Vec<Vec<String>> = columns.map(|(k, column)| wrapped(&column.name, widest(k))).collect();
        let height = headings.iter().map(Vec::len).max().unwrap_or(0);
        // Headings stand on what is below them.
        let head = (0..height).map(|k| {
            let line = |heading: &Vec<String>| Some(heading[k.checked_sub(height - heading.len())?].clone());
            headings.iter().map(|heading| line(heading).unwrap_or_default()).collect()
        });
        let lines: Vec<Vec<String>> = head.chain(body.iter().cloned()).collect();
        let width = |k: usize| lines.iter().filter_map(|line| line.get(k)).map(|text| length(text)).max().unwrap_or(0);
        let widths: Vec<usize> = (0..self.columns.len()).map(width).collect();
        let aligned = |line: &Vec<String>| {
            let cells =
                line.iter().zip(&self.columns).zip(&widths).map(|((text, column), &width)| match column.class {
                    "left" => format!("{text:<width$}"),
                    _ => format!("{text:>width$}"),
                });
            cells.collect::<Vec<_>>().join(" ").trim_end().to_owned()
        };
        lines.iter().map(aligned).collect::<Vec<_>>().join("\n")
    }
}

fn length(text: &str) -> usize {
    text.chars().count()
}

/// Words of so many characters are broken at their hyphens where a line is shorter.
const LONG_WORD: usize = 8;

/// The words of a text in lines of at most `width` characters, where they are that short.
pub fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        let parts: Vec<&str> = match length(word) > width.max(LONG_WORD) {
            true => word.split_inclusive('-').collect(),
            false => vec![word],
        };
        for part in parts {
            match lines.last_mut() {
                Some(line) if length(line) + 1 + length(part) <= width => *line += &format!(" {part}"),
                _ => lines.push(part.to_owned()),
            }
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use crate::{Cell, Column, Conditions, Table};

    #[test]
    fn columns_are_aligned_and_no_line_ends_in_blanks() {
        let table = Table {
            id: "t".to_owned(),
            title: String::new(),
            caption: String::new(),
            columns: vec![Column::text("way"), Column::number("time a step"), Column::text("status")],
            rows: vec![
                vec!["direct".into(), "1.25".into(), "converged".into()],
                vec!["cg".into(), Cell::strong("12.5"), "".into()],
            ],
            conditions: Conditions::new("machine", "any"),
        };
        let expected =
            ["        time", "           a", "way     step status", "direct  1.25 converged", "cg     *12.5"];
        assert_eq!(table.text(), expected.join("\n"));
    }

    #[test]
    fn long_words_are_broken_at_hyphens_where_they_must() {
        assert_eq!(super::wrapped("block-jacobi 1e-2", 5), ["block-", "jacobi", "1e-2"]);
        assert_eq!(super::wrapped("block-jacobi 1e-2", 40), ["block-jacobi 1e-2"]);
    }
}
