//! Tables and paragraphs as text, for a terminal.

use comfy_table::{CellAlignment, ContentArrangement, presets};

use crate::{Cell, Table};

impl Table {
    /// The columns side by side, broken where a line would be longer than `width` characters; what stands out has a star
    /// before it. No line ends in blanks.
    pub fn text(&self, width: u16) -> String {
        let text = |cell: &Cell| match cell.class {
            " strong" => format!("*{}", cell.text),
            _ => cell.text.clone(),
        };
        let mut table = plain(width);
        table.set_header(self.columns.iter().map(|column| &column.name));
        table.add_rows(self.rows.iter().map(|row| row.iter().map(text)));
        for (column, own) in table.column_iter_mut().zip(&self.columns) {
            column.set_padding((0, 1));
            column.set_cell_alignment(if own.class == "left" { CellAlignment::Left } else { CellAlignment::Right });
        }
        table.trim_fmt()
    }
}

/// A text in lines of at most `width` characters.
pub fn wrapped(text: &str, width: u16) -> String {
    let mut table = plain(width);
    table.add_row([text]);
    for column in table.column_iter_mut() {
        column.set_padding((0, 0));
    }
    table.trim_fmt()
}

fn plain(width: u16) -> comfy_table::Table {
    let mut table = comfy_table::Table::new();
    table.load_style(presets::NOTHING).set_content_arrangement(ContentArrangement::Dynamic).set_width(width);
    table
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
        let expected = ["way    time a step status", "direct        1.25 converged", "cg           *12.5"];
        assert_eq!(table.text(80), expected.join("\n"));
        assert!(table.text(26).lines().all(|line| line.len() <= 26 && line == line.trim_end()));
    }

    #[test]
    fn paragraphs_are_broken_between_words() {
        assert_eq!(super::wrapped("one two three\nfour", 8), "one two\nthree\nfour");
    }
}
