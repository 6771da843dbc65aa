//! Pages as HTML.

use chart::{Palette, Xml, style};

use crate::evidence::Evidence;
use crate::inline::{Labels, inline};
use crate::page::evidence;
use crate::{Block, Conditions, Page, Table};

/// Anchor of the table of contents.
pub(crate) const CONTENTS: &str = "contents";

/// What all of a page has in common.
struct Context<'a> {
    palette: Palette<'a>,
    labels: Labels<'a>,
}

/// The page as HTML that is well-formed XML too.
pub(crate) fn page(page: &Page) -> String {
    let context = Context { palette: Palette::new(page.figures()), labels: labels(&page.evidence()) };
    let mut xml = Xml::default();
    xml.raw("<!DOCTYPE html>\n");
    xml.open("html", &[("lang", &"en")]);
    xml.open("head", &[]);
    xml.leaf("meta", &[("charset", &"utf-8")]);
    xml.leaf("meta", &[("name", &"viewport"), ("content", &"width=device-width, initial-scale=1")]);
    xml.element("title", &[], &page.title);
    // HTML does not resolve escapes in a style sheet: ours has nothing to escape.
    xml.raw(&format!("<style>{}</style>", style(include_str!("page.css"))));
    xml.close();
    xml.line();
    xml.open("body", &[]);
    xml.open("header", &[]);
    xml.element("h1", &[], &page.title);
    page.lead.iter().for_each(|text| paragraph(&mut xml, text, &context));
    conditions(&mut xml, &page.conditions);
    xml.close();
    contents(&mut xml, page, &context);
    xml.open("main", &[]);
    for section in &page.sections {
        xml.open("section", &[("aria-labelledby", &section.id)]);
        xml.line();
        xml.element("h2", &[("id", &section.id)], &section.title);
        xml.line();
        section.blocks.iter().for_each(|item| block(&mut xml, item, &context));
        xml.close();
    }
    xml.finish() + "\n"
}

/// "Figure 1", "Table 1" and so on, each kind counted by itself.
fn labels<'a>(evidence: &[Evidence<'a>]) -> Labels<'a> {
    let (mut figures, mut tables) = (0, 0);
    let label = |item: &Evidence<'a>| {
        let (kind, count) = match item {
            Evidence::Figure(_) => ("Figure", &mut figures),
            Evidence::Table(_) => ("Table", &mut tables),
        };
        *count += 1;
        (item.id(), format!("{kind} {count}"))
    };
    evidence.iter().map(label).collect()
}

fn contents(xml: &mut Xml, page: &Page, context: &Context<'_>) {
    xml.open("nav", &[("aria-labelledby", &CONTENTS)]);
    xml.element("h2", &[("id", &CONTENTS)], "Contents");
    xml.open("ul", &[]);
    for section in &page.sections {
        xml.open("li", &[]);
        xml.element("a", &[("href", &format!("#{}", section.id))], &section.title);
        let items = evidence(&section.blocks);
        if !items.is_empty() {
            xml.open("ul", &[]);
        }
        for [id, title, _] in items.iter().map(|item| item.words()) {
            xml.open("li", &[]);
            xml.element("a", &[("href", &format!("#{id}"))], &format!("{}. {title}", context.labels[id]));
            xml.close();
        }
        if !items.is_empty() {
            xml.close();
        }
        xml.close();
        xml.line();
    }
    xml.close();
    xml.close();
}

fn block(xml: &mut Xml, block: &Block, context: &Context<'_>) {
    match block {
        Block::Paragraph(text) => paragraph(xml, text, context),
        Block::Table(item) => shown(xml, Evidence::Table(item), context),
        Block::Figure(item) => shown(xml, Evidence::Figure(item), context),
    }
    xml.line();
}

fn paragraph(xml: &mut Xml, text: &str, context: &Context<'_>) {
    xml.open("p", &[]);
    inline(xml, text, &context.labels);
    xml.close();
}

/// A figure or a table: number, title and caption above it, below it its conditions, and where the numbers are.
fn shown(xml: &mut Xml, item: Evidence<'_>, context: &Context<'_>) {
    let [id, title, caption] = item.words();
    xml.open("figure", &[("id", &id)]);
    xml.open("figcaption", &[]);
    xml.open("h3", &[]);
    xml.element("span", &[("class", &"number")], &format!("{}.", context.labels[id]));
    xml.text(&format!(" {title}"));
    xml.close();
    if !caption.is_empty() {
        paragraph(xml, caption, context);
    }
    xml.close();
    xml.line();
    match item {
        Evidence::Figure(figure) => figure.draw(xml, &context.palette),
        Evidence::Table(item) => table(xml, item),
    }
    xml.open("div", &[("class", &"source")]);
    conditions(xml, item.conditions());
    xml.element("a", &[("href", &format!("csv/{id}.csv"))], &format!("{id}.csv"));
    xml.close();
    xml.close();
}

fn conditions(xml: &mut Xml, conditions: &Conditions) {
    xml.open("dl", &[("class", &"conditions"), ("aria-label", &"Conditions")]);
    for (key, value) in conditions.iter() {
        xml.open("div", &[]);
        xml.element("dt", &[], key);
        xml.element("dd", &[], value);
        xml.close();
        // Where a line may break.
        xml.line();
    }
    xml.close();
}

fn table(xml: &mut Xml, table: &Table) {
    // Whoever has no mouse scrolls by keys, for which the box must take the focus.
    let name = &table.title;
    xml.open("div", &[("class", &"body scroll"), ("tabindex", &"0"), ("role", &"region"), ("aria-label", name)]);
    xml.open("table", &[]);
    xml.open("thead", &[]);
    xml.open("tr", &[]);
    for column in &table.columns {
        xml.element("th", &[("scope", &"col"), ("class", &column.class)], &column.name);
    }
    xml.close();
    xml.close();
    xml.line();
    xml.open("tbody", &[]);
    for row in &table.rows {
        xml.open("tr", &[]);
        for (i, (cell, column)) in row.iter().zip(&table.columns).enumerate() {
            let (tag, scope) = if i == 0 { ("th", "row") } else { ("td", "") };
            xml.element(tag, &[("scope", &scope), ("class", &[column.class, cell.class].concat())], &cell.text);
        }
        xml.close();
        xml.line();
    }
    xml.close();
    xml.close();
    xml.close();
}
