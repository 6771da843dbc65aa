//! Parts of a section of the page from what differs in them, and cells in groups.

use report::{Axis, Block, Cell, Charts, Column, Conditions, Figure, LineChart, Reference, Section, Series, Table};

/// A section: its anchor, its heading and its introduction, then its blocks.
pub(crate) fn section([id, title, introduction]: [&str; 3], mut blocks: Vec<Block>) -> Section {
    blocks.insert(0, Block::Paragraph(introduction.to_owned()));
    Section { id: id.to_owned(), title: title.to_owned(), blocks }
}

/// A table: its id, its title and its caption, then headings with " | " between them, of numbers where they begin with '#'.
pub(crate) fn table(head: [&str; 3], headings: &str, rows: Vec<Vec<Cell>>, conditions: Conditions) -> Block {
    let [id, title, caption] = head.map(str::to_owned);
    let column = |heading: &str| heading.strip_prefix('#').map_or_else(|| Column::text(heading), Column::number);
    let columns = headings.split(" | ").map(column).collect();
    Block::Table(Table { id, title, caption, columns, rows, conditions })
}

/// Conditions of numbers that other pages have measured.
pub(crate) fn quoted(from: &str) -> Conditions {
    Conditions::new("from", from).with("machine and date", "in the last table")
}

/// A figure of curves: its id, its title and its caption, then its charts.
pub(crate) fn figure(head: [&str; 3], charts: Vec<LineChart>, conditions: Conditions) -> Block {
    let [id, title, caption] = head.map(str::to_owned);
    Block::Figure(Figure { id, title, caption, charts: Charts::Lines(charts), conditions })
}

/// Curves over two axes.
pub(crate) fn chart(title: &str, [x, y]: [Axis; 2], series: Vec<Series>, references: Vec<Reference>) -> LineChart {
    LineChart { title: title.to_owned(), x, y, series, references, ..LineChart::default() }
}

/// The cells of each group, groups in the order of their first cells.
pub(crate) fn groups<'a, K, V, G: PartialEq>(
    cells: &[(&'a K, &'a V)],
    group: impl Fn(&'a K) -> G,
) -> Vec<(G, Vec<(&'a K, &'a V)>)> {
    let mut groups: Vec<(G, Vec<_>)> = Vec::new();
    for &(key, value) in cells {
        let of = group(key);
        match groups.iter_mut().find(|(known, _)| *known == of) {
            Some((_, own)) => own.push((key, value)),
            None => groups.push((of, vec![(key, value)])),
        }
    }
    groups
}

/// What was measured in some cells.
pub(crate) fn values<'a, K, V>(cells: &[(&K, &'a V)]) -> Vec<&'a V> {
    cells.iter().map(|(_, value)| *value).collect()
}
