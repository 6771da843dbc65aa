//! Pages as HTML.

use chart::{Palette, Xml, style};

use crate::inline::{Labels, inline};
use crate::page::Evidence;
use crate::{Block, Cell, Column, Conditions, Page, Section, Table};

/// Anchor of the table of contents.
pub(crate) const CONTENTS: &str = "contents";

const META: &str = r#"<meta charset="utf-8"/><meta name="viewport" content="width=device-width, initial-scale=1"/>"#;

/// The page as HTML that is well-formed XML too.
pub(crate) fn page(page: &Page) -> String {
    let (palette, labels) = (Palette::new(page.figures()), labels(page));
    // HTML does not resolve escapes in a style sheet: ours has nothing to escape.
    let sheet = Xml::raw(format!("<style>{}</style>", style(include_str!("page.css"))));
    let head = Xml::nest("head", &[], [Xml::raw(META), Xml::element("title", &[], &page.title), sheet]);
    let lead = page.lead.iter().map(|text| paragraph(text, &labels));
    let header = [Xml::element("h1", &[], &page.title)].into_iter().chain(lead);
    let sections = page.sections.iter().map(|section| {
        let title = Xml::element("h2", &[("id", &section.id)], &section.title);
        let blocks = section.blocks.iter().filter_map(|block| match block {
            Block::Paragraph(text) => Some(paragraph(text, &labels)),
            _ => block.evidence().map(|item| evidence(item, &palette, &labels)),
        });
        Xml::nest("section", &[("aria-labelledby", &section.id)], [title].into_iter().chain(blocks))
    });
    let footer = Xml::nest("footer", &[], [conditions(&page.conditions)]);
    let parts = [Xml::nest("header", &[], header), contents(page, &labels), Xml::nest("main", &[], sections), footer];
    let html = Xml::nest("html", &[("lang", &"en")], [head, Xml::nest("body", &[], parts)]);
    format!("<!DOCTYPE html>\n{html}\n")
}

/// "Figure 1", "Table 1" and so on, each kind counted by itself.
fn labels(page: &Page) -> Labels<'_> {
    let (mut figures, mut tables) = (0, 0);
    let numbered = page.evidence().map(|item| {
        let (kind, count) = match item.block {
            Block::Figure(_) => ("Figure", &mut figures),
            _ => ("Table", &mut tables),
        };
        *count += 1;
        (item.id, format!("{kind} {count}"))
    });
    numbered.collect()
}

fn contents(page: &Page, labels: &Labels<'_>) -> Xml {
    let entry = |id: &str, title: &str, below: Option<Xml>| {
        let link = Xml::element("a", &[("href", &format!("#{id}"))], title);
        Xml::nest("li", &[], [link].into_iter().chain(below))
    };
    let section = |section: &Section| {
        let items = section.blocks.iter().filter_map(Block::evidence);
        let mut items =
            items.map(|item| entry(item.id, &format!("{}. {}", labels[item.id], item.title), None)).peekable();
        // Folded, so that a page with a hundred figures still begins with what it says.
        let below = items.peek().is_some().then(|| {
            let summary = Xml::element("summary", &[], "figures and tables");
            Xml::nest("details", &[], [summary, Xml::nest("ul", &[], items)])
        });
        entry(&section.id, &section.title, below)
    };
    let list = Xml::nest("ul", &[], page.sections.iter().map(section));
    let title = Xml::element("h2", &[("id", &CONTENTS)], "Contents");
    Xml::nest("nav", &[("aria-labelledby", &CONTENTS)], [title, list])
}

fn paragraph(text: &str, labels: &Labels<'_>) -> Xml {
    Xml::nest("p", &[], [inline(text, labels)])
}

/// A figure or a table: number, title and caption above it, below it its conditions, and where the numbers are.
fn evidence(item: Evidence<'_>, palette: &Palette<'_>, labels: &Labels<'_>) -> Xml {
    let Evidence { id, title, caption, .. } = item;
    let number = Xml::element("span", &[("class", &"number")], &format!("{}.", labels[id]));
    let title = Xml::nest("h3", &[], [number, Xml::text(&format!(" {title}"))]);
    let caption = (!caption.is_empty()).then(|| paragraph(caption, labels));
    let body = match item.block {
        Block::Paragraph(_) => Xml::default(),
        Block::Figure(figure) => figure.draw(palette),
        Block::Table(item) => table(item),
    };
    let link = Xml::element("a", &[("href", &format!("csv/{id}.csv"))], &format!("{id}.csv"));
    let source = Xml::nest("div", &[("class", &"source")], [conditions(item.conditions), link]);
    let above = Xml::nest("figcaption", &[], [title].into_iter().chain(caption));
    Xml::nest("figure", &[("id", &id)], [above, body, source])
}

fn conditions(conditions: &Conditions) -> Xml {
    let pair = |(key, value): (&str, &str)| {
        Xml::nest("div", &[], [Xml::element("dt", &[], key), Xml::element("dd", &[], value)])
    };
    Xml::nest("dl", &[("class", &"conditions"), ("aria-label", &"Conditions")], conditions.iter().map(pair))
}

fn table(table: &Table) -> Xml {
    let head = |column: &Column| Xml::element("th", &[("scope", &"col"), ("class", &column.class)], &column.name);
    let row = |row: &Vec<Cell>| {
        let cells = row.iter().zip(&table.columns).enumerate().map(|(i, (cell, column))| {
            let (tag, scope) = if i == 0 { ("th", "row") } else { ("td", "") };
            Xml::element(tag, &[("scope", &scope), ("class", &[column.class, cell.class].concat())], &cell.text)
        });
        Xml::nest("tr", &[], cells)
    };
    let head = Xml::nest("thead", &[], [Xml::nest("tr", &[], table.columns.iter().map(head))]);
    let body = Xml::nest("tbody", &[], table.rows.iter().map(row));
    // Whoever has no mouse scrolls by keys, for which the box must take the focus.
    let name = &table.title;
    let focus =
        [("class", &"body scroll" as _), ("tabindex", &"0" as _), ("role", &"region" as _), ("aria-label", name as _)];
    Xml::nest("div", &focus, [Xml::nest("table", &[], [head, body])])
}
