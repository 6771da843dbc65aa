//! What the text of a scene file says of its entries: where they stand, and which materials they leave out.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::defaults;

/// Lists whose entries have names, and what the nameless are called.
const NAMED: [(&str, &str); 4] = [("bodies", "body"), ("rods", "rod"), ("nets", "net"), ("obstacles", "obstacle")];

/// Line, from 1, of the entry that is called so in a scene; also of one that is made from it, as `hair/7` is from `hair`. `None`
/// where the text has no such entry.
pub fn line_of(text: &str, name: &str) -> Option<usize> {
    let document = DeTable::parse(text).ok()?;
    let is = |own: &str| name.strip_prefix(own).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'));
    for (list, kind) in NAMED {
        for (index, entry) in entries(document.get_ref(), list).enumerate() {
            if is(&name_of(entry, kind, index)) {
                let start = entry.span().start.min(text.len());
                return Some(1 + text.as_bytes()[..start].iter().filter(|&&byte| byte == b'\n').count());
            }
        }
    }
    None
}

/// What the rods of a scene file do not say of their material, and what it is then, a line each rod: `cable: radius_m = 0.05`.
pub(crate) fn left_out(text: &str) -> Vec<String> {
    let Ok(document) = DeTable::parse(text) else { return Vec::new() };
    let of_rod = |(index, entry): (usize, &Spanned<DeValue>)| {
        let rod = entry.get_ref().as_table()?;
        let section = rod.get("section").and_then(|section| section.get_ref().as_table());
        let by_stiffness = section.is_some_and(|section| section.contains_key("stiffness"));
        if by_stiffness || rod.contains_key("pieces") {
            return None;
        }
        let keys = [
            ("radius_m", defaults::RADIUS, section.is_none()),
            ("youngs_modulus_pa", defaults::YOUNGS_MODULUS, true),
            ("density_kg_m3", defaults::DENSITY, true),
        ];
        let left_out = keys.iter().filter(|(key, _, is_due)| *is_due && !rod.contains_key(*key));
        let left_out: Vec<String> = left_out.map(|(key, value, _)| format!("{key} = {value}")).collect();
        (!left_out.is_empty()).then(|| format!("{}: {}", name_of(entry, "rod", index), left_out.join(", ")))
    };
    entries(document.get_ref(), "rods").enumerate().filter_map(of_rod).collect()
}

fn entries<'a>(document: &'a DeTable<'a>, list: &str) -> impl Iterator<Item = &'a Spanned<DeValue<'a>>> {
    document.get(list).and_then(|list| list.get_ref().as_array()).into_iter().flat_map(|list| list.iter())
}

fn name_of(entry: &Spanned<DeValue>, kind: &str, index: usize) -> String {
    let name = entry.get_ref().as_table().and_then(|table| table.get("name")?.get_ref().as_str());
    name.map_or_else(|| format!("{kind}-{index}"), str::to_owned)
}
