//! Pages as HTML.

use crate::draw::{self, Drawing};
use crate::inline::{Labels, inline};
use crate::page::{Evidence, evidence};
use crate::palette::Palette;
use crate::xml::{Px, Xml};
use crate::{Align, Block, Cell, Conditions, Emphasis, Figure, Page, Table, theme};

/// Anchor of the table of contents.
pub(crate) const CONTENTS: &str = "contents";
/// Smallest text of a chart on a narrow screen \[px\]; below it, the chart scrolls.
const SMALLEST_TEXT: f64 = 9.4;

/// What all of a page has in common.
struct Context<'a> {
    palette: Palette<'a>,
    labels: Labels<'a>,
}

/// The page as HTML that is well-formed XML too.
pub(crate) fn page(page: &Page) -> String {
    let evidence = page.evidence();
    let figures = evidence.iter().filter_map(|item| match item {
        Evidence::Figure(figure) => Some(*figure),
        Evidence::Table(_) => None,
    });
    let context = Context { palette: Palette::new(figures), labels: labels(&evidence) };
    let mut xml = Xml::default();
    xml.raw("<!DOCTYPE html>\n");
    xml.open("html", &[("lang", &"en")]);
    head(&mut xml, &page.title);
    xml.open("body", &[]);
    xml.open("header", &[]);
    xml.element("h1", &[], &page.title);
    for text in &page.lead {
        paragraph(&mut xml, text, &context);
    }
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

fn head(xml: &mut Xml, title: &str) {
    xml.open("head", &[]);
    xml.leaf("meta", &[("charset", &"utf-8")]);
    xml.leaf("meta", &[("name", &"viewport"), ("content", &"width=device-width, initial-scale=1")]);
    xml.element("title", &[], title);
    xml.open("style", &[]);
    // HTML does not resolve escapes in a style sheet: ours has nothing to escape.
    xml.raw(&theme::page_style());
    xml.close();
    xml.close();
    xml.line();
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
            for item in items {
                xml.open("li", &[]);
                let text = format!("{}. {}", context.labels[item.id()], item.title());
                xml.element("a", &[("href", &format!("#{}", item.id()))], &text);
                xml.close();
            }
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
        Block::Table(item) => table(xml, item, context),
        Block::Figure(item) => figure(xml, item, context),
        Block::Details(details) => {
            xml.open("details", &[]);
            xml.element("summary", &[], &details.summary);
            details.blocks.iter().for_each(|item| self::block(xml, item, context));
            xml.close();
        }
    }
    xml.line();
}

fn paragraph(xml: &mut Xml, text: &str, context: &Context<'_>) {
    xml.open("p", &[]);
    inline(xml, text, &context.labels);
    xml.close();
}

/// Number, title and caption.
fn caption(xml: &mut Xml, item: Evidence<'_>, caption: &str, context: &Context<'_>) {
    xml.open("figcaption", &[]);
    xml.open("h3", &[]);
    xml.element("span", &[("class", &"number")], &format!("{}.", context.labels[item.id()]));
    xml.text(" ");
    xml.text(item.title());
    xml.close();
    if !caption.is_empty() {
        paragraph(xml, caption, context);
    }
    xml.close();
    xml.line();
}

/// Conditions, and where the numbers are.
fn source(xml: &mut Xml, id: &str, list: &Conditions) {
    xml.open("div", &[("class", &"source")]);
    conditions(xml, list);
    xml.element("a", &[("href", &format!("csv/{id}.csv"))], &format!("{id}.csv"));
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

fn figure(xml: &mut Xml, figure: &Figure, context: &Context<'_>) {
    xml.open("figure", &[("id", &figure.id)]);
    caption(xml, Evidence::Figure(figure), &figure.caption, context);
    let drawings = draw::charts(&figure.charts, &context.palette);
    let class = if drawings.len() > 1 { "body wide" } else { "body" };
    xml.open("div", &[("class", &class)]);
    xml.open("div", &[("class", &"charts")]);
    drawings.iter().for_each(|drawing| chart(xml, drawing));
    xml.close();
    let entries = draw::entries(&figure.charts, &context.palette);
    if !entries.is_empty() {
        draw::list(xml, &entries);
    }
    xml.close();
    source(xml, &figure.id, &figure.conditions);
    xml.close();
}

fn chart(xml: &mut Xml, drawing: &Drawing) {
    let Drawing { width, height, font, label, body } = drawing;
    xml.open("div", &[("class", &"scroll")]);
    let narrowest = (width * SMALLEST_TEXT / font).ceil();
    xml.open(
        "svg",
        &[
            ("class", &"chart"),
            ("role", &"img"),
            ("aria-label", label),
            ("width", &Px(*width)),
            ("height", &Px(*height)),
            ("viewBox", &format!("0 0 {} {}", Px(*width), Px(*height))),
            ("font-size", font),
            ("style", &format!("min-width:{narrowest}px")),
        ],
    );
    xml.raw(body);
    xml.close();
    xml.close();
    xml.line();
}

fn table(xml: &mut Xml, table: &Table, context: &Context<'_>) {
    xml.open("figure", &[("id", &table.id)]);
    caption(xml, Evidence::Table(table), &table.caption, context);
    // Whoever has no mouse scrolls by keys, for which the box must take the focus.
    xml.open(
        "div",
        &[("class", &"body scroll"), ("tabindex", &"0"), ("role", &"region"), ("aria-label", &table.title)],
    );
    xml.open("table", &[]);
    xml.open("thead", &[]);
    xml.open("tr", &[]);
    for column in &table.columns {
        xml.element("th", &[("scope", &"col"), ("class", &align(column.align))], &column.name);
    }
    xml.close();
    xml.close();
    xml.line();
    xml.open("tbody", &[]);
    for row in &table.rows {
        xml.open("tr", &[]);
        for (i, (cell, column)) in row.iter().zip(&table.columns).enumerate() {
            let class = [align(column.align), emphasis(cell)].join(" ");
            match i {
                0 => xml.element("th", &[("scope", &"row"), ("class", &class.trim())], &cell.text),
                _ => xml.element("td", &[("class", &class.trim())], &cell.text),
            }
        }
        xml.close();
        xml.line();
    }
    xml.close();
    xml.close();
    xml.close();
    source(xml, &table.id, &table.conditions);
    xml.close();
}

fn align(align: Align) -> &'static str {
    match align {
        Align::Left => "left",
        Align::Right => "right",
    }
}

fn emphasis(cell: &Cell) -> &'static str {
    match cell.emphasis {
        Emphasis::Plain => "",
        Emphasis::Strong => "strong",
        Emphasis::Muted => "muted",
    }
}
