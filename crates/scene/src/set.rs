//! Keys of a scene's file that are given another value before it is read.

use toml_edit::{DocumentMut, InlineTable, Item, TableLike, Value};

use crate::error::nearest;
use crate::{Scene, SceneError, parse};

/// Similarity, of 0 to 1, from which a name is taken for a slip of the pen.
const ALIKE: f64 = 0.7;

/// The scene of [`parse`] after each of the `settings`, `KEY=VALUE`, has put its value in. A key is a path of keys with dots between
/// them; an entry of a list is named by its `name`, or counted from 0: `rods.cable.radius_m`, `rods[0].clamp`. Values are TOML.
///
/// # Errors
/// [`SceneError::Setting`] with the setting to blame, or what [`parse`] finds wrong with the text as it is.
pub fn parse_set(text: &str, file_name: &str, settings: &[String]) -> Result<Scene, SceneError> {
    if settings.is_empty() {
        return parse(text, file_name);
    }
    let set = |settings: &[String]| parse(&edited(text, settings)?, file_name);
    let mistake = match set(settings) {
        Err(mistake @ (SceneError::Invalid { .. } | SceneError::Read { .. })) => mistake,
        done => return done,
    };
    // The file's own mistakes have their lines.
    parse(text, file_name)?;
    let is_first = |count: &usize| set(&settings[..*count]).is_err();
    let blamed = (1..settings.len()).find(is_first).unwrap_or(settings.len());
    let message = match mistake {
        SceneError::Invalid { file, message, .. } if file == file_name => message,
        other => other.to_string(),
    };
    Err(SceneError::Setting { setting: settings[blamed - 1].clone(), message })
}

/// The text of a scene's file after each of the `settings` has put its value in: see [`parse_set`]. A text that is not TOML stays.
///
/// # Errors
/// [`SceneError::Setting`] if a setting is no key and value, or leads nowhere.
fn edited(text: &str, settings: &[String]) -> Result<String, SceneError> {
    let Ok(mut document) = text.parse::<DocumentMut>() else { return Ok(text.to_owned()) };
    for setting in settings {
        let wrong = |message| SceneError::Setting { setting: setting.clone(), message };
        let (path, value) = split(setting).map_err(wrong)?;
        put(document.as_item_mut(), &path, value, "").map_err(wrong)?;
    }
    Ok(document.to_string())
}

/// A part of a path.
enum Part {
    Key(String),
    Index(usize),
}

/// The path and the value of a setting, or what is wrong with it.
fn split(setting: &str) -> Result<(Vec<Part>, Value), String> {
    let (mut parts, mut rest) = (Vec::new(), setting);
    loop {
        let (key, after) = match rest.strip_prefix('"') {
            Some(quoted) => quoted.split_once('"').ok_or("a quote is not closed")?,
            None => rest.split_at(rest.find(['.', '[', '=']).unwrap_or(rest.len())),
        };
        if key.trim().is_empty() {
            return Err(
                "it must be KEY=VALUE, the key a path such as rods.cable.radius_m or rods[0].radius_m".to_owned()
            );
        }
        parts.push(Part::Key(key.trim().to_owned()));
        rest = after.trim_start();
        while let Some(index) = rest.strip_prefix('[') {
            let (number, after) = index.split_once(']').ok_or("a bracket is not closed")?;
            let number = number.trim().parse().map_err(|_| format!("[{number}] must hold a whole number from 0 on"))?;
            parts.push(Part::Index(number));
            rest = after.trim_start();
        }
        if let Some(next) = rest.strip_prefix('.') {
            rest = next;
            continue;
        }
        let value = rest.strip_prefix('=').ok_or("it must be KEY=VALUE")?.trim();
        let parsed = value.parse::<Value>().map_err(|_| {
            format!("{value} is no TOML value: a number, [a, list], true, false, or a text in double quotes")
        })?;
        return Ok((parts, parsed));
    }
}

/// Puts a value where a path leads from an item, which is at `at`.
fn put(item: &mut Item, path: &[Part], value: Value, at: &str) -> Result<(), String> {
    let Some((part, rest)) = path.split_first() else { return replace(item, value, at) };
    if let Some(tables) = item.as_array_of_tables_mut() {
        let names: Vec<_> = tables.iter().map(|table| table.get("name").and_then(Item::as_str)).collect();
        let index = entry(part, &names, at)?;
        let table = tables.get_mut(index).ok_or("it is not there")?;
        return in_table(table, rest, value, &format!("{at}[{index}]"));
    }
    if let Some(list) = item.as_array_mut() {
        let named =
            |value: &Value| value.as_inline_table().and_then(|table| table.get("name")?.as_str().map(str::to_owned));
        let names: Vec<_> = list.iter().map(named).collect();
        let index = entry(part, &names.iter().map(Option::as_deref).collect::<Vec<_>>(), at)?;
        let mut own = Item::Value(list.remove(index));
        put(&mut own, rest, value, &format!("{at}[{index}]"))?;
        let own = own.into_value().map_err(|_| "it is no value")?;
        list.insert_formatted(index, own);
        return Ok(());
    }
    match item.as_table_like_mut() {
        Some(table) => in_table(table, path, value, at),
        None => Err(format!("{at} is no table and no list")),
    }
}

/// Puts a value where a path leads from a table.
fn in_table(table: &mut dyn TableLike, path: &[Part], value: Value, at: &str) -> Result<(), String> {
    let (key, rest) = match path.split_first() {
        Some((Part::Key(key), rest)) => (key, rest),
        Some((Part::Index(_), _)) => return Err(format!("{at} is no list")),
        None => return Err(format!("{at} is a whole table: give one of its keys, such as {at}.name")),
    };
    let here = if at.is_empty() { key.clone() } else { format!("{at}.{key}") };
    if let Some(item) = table.get_mut(key) {
        return put(item, rest, value, &here);
    }
    // The last keys of a path may be new.
    let mut nested = value;
    for part in rest.iter().rev() {
        let Part::Key(key) = part else { return Err(format!("there is no {here} yet, and so no entry of it")) };
        nested = Value::InlineTable(InlineTable::from_iter([(key.clone(), nested)]));
    }
    table.insert(key, Item::Value(nested));
    Ok(())
}

/// Index of the entry of a list that a part names.
fn entry(part: &Part, names: &[Option<&str>], at: &str) -> Result<usize, String> {
    let count = names.len();
    let index = match part {
        Part::Index(index) => Some(*index),
        Part::Key(key) => {
            // The nameless one is called rod-0, body-0 and so on elsewhere, too.
            let list = at.rsplit('.').next().unwrap_or(at);
            let kind = if list == "bodies" { "body" } else { list.strip_suffix('s').unwrap_or(list) };
            let number =
                key.rsplit_once('-').filter(|(own, _)| *own == kind).and_then(|(_, number)| number.parse().ok());
            let is_nameless = |index: &usize| names.get(*index).is_some_and(Option::is_none);
            let by_name = names.iter().position(|name| *name == Some(key.as_str()));
            by_name.or(number.filter(is_nameless)).or_else(|| key.parse().ok())
        }
    };
    match (index, part) {
        (Some(index), _) if index < count => Ok(index),
        (Some(index), _) => Err(format!("there is no {at}[{index}]: the file has {count} of them, counted from 0")),
        (None, Part::Key(key)) => {
            let known = || names.iter().flatten().copied();
            let meant =
                nearest(key, known(), ALIKE).map(|name| format!("; did you mean `{name}`?")).unwrap_or_default();
            let all: Vec<&str> = known().take(20).collect();
            let all = if all.is_empty() {
                "none of them has a name".to_owned()
            } else {
                format!("there are {}", all.join(", "))
            };
            Err(format!("none of {at} is called `{key}`{meant} ({all}; {at}[0] is the first)"))
        }
        (None, Part::Index(_)) => Err(format!("{at} has no such entry")),
    }
}

fn replace(item: &mut Item, mut value: Value, at: &str) -> Result<(), String> {
    match item {
        Item::Value(old) => {
            *value.decor_mut() = old.decor().clone();
            *old = value;
            Ok(())
        }
        _ => Err(format!("{at} is a whole table: give one of its keys")),
    }
}
