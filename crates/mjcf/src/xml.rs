//! One tree of a file and of what it includes, whose attributes know where they stand, and are read as numbers.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::Vector3;
use roxmltree::{Document, Node};

use crate::error::{MjcfError, Result};

/// How deep elements may lie in one another.
const DEEPEST: usize = 200;
/// The largest number that an attribute may hold: squares and cubes of it are numbers still.
const LARGEST: f64 = 1e30;

/// A place in a file.
#[derive(Clone, Debug)]
pub(crate) struct Place {
    file: Arc<str>,
    /// From 1.
    line: usize,
}

/// An attribute, where it is given.
#[derive(Clone, Debug)]
pub(crate) struct Attribute {
    pub(crate) name: String,
    pub(crate) value: String,
    pub(crate) place: Place,
}

/// An element with all that is in it.
#[derive(Clone, Debug)]
pub(crate) struct Element {
    pub(crate) tag: String,
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) children: Vec<Element>,
    pub(crate) place: Place,
}

/// The tree of a text, which is the file `path`, with what it includes.
pub(crate) fn read(text: &str, path: &Path) -> Result<Element> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let root = Reader { folder, known: vec![path.to_owned()] }.parse(text, path, 0)?;
    match root.tag.as_str() {
        "mujoco" => Ok(root),
        "robot" => root.wrong("is URDF; save it from MuJoCo as MJCF"),
        _ => root.wrong("must be <mujoco>"),
    }
}

struct Reader<'a> {
    /// From which included files are seen: that of the first file.
    folder: &'a Path,
    /// Files that were read: each may be included once.
    known: Vec<PathBuf>,
}

impl Reader<'_> {
    fn parse(&mut self, text: &str, path: &Path, depth: usize) -> Result<Element> {
        let file: Arc<str> = path.display().to_string().into();
        let document = Document::parse(text).map_err(|error| MjcfError::Invalid {
            file: file.to_string(),
            line: error.pos().row as usize,
            message: format!("not valid XML: {}", error.to_string().replace(char::is_control, " ")),
        })?;
        let breaks: Vec<usize> =
            text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n').map(|(at, _)| at).collect();
        self.element(document.root_element(), &file, &breaks, depth)
    }

    /// A node with all that is in it; `breaks` are the ends of the lines of its file.
    fn element(&mut self, node: Node, file: &Arc<str>, breaks: &[usize], depth: usize) -> Result<Element> {
        let place = |at: usize| Place { file: file.clone(), line: 1 + breaks.partition_point(|end| *end < at) };
        let attribute = |given: roxmltree::Attribute| Attribute {
            name: given.name().to_owned(),
            value: given.value().to_owned(),
            place: place(given.range().start),
        };
        let mut element = Element {
            tag: node.tag_name().name().to_owned(),
            attributes: node.attributes().map(attribute).collect(),
            children: Vec::new(),
            place: place(node.range().start),
        };
        if depth > DEEPEST {
            return element.wrong(&format!("lies deeper than {DEEPEST} elements"));
        }
        for child in node.children().filter(Node::is_element) {
            let child = self.element(child, file, breaks, depth + 1)?;
            if child.tag == "include" {
                element.children.extend(self.included(&child, depth + 1)?);
            } else {
                element.children.push(child);
            }
        }
        Ok(element)
    }

    /// The elements of the file that an element includes.
    fn included(&mut self, element: &Element, depth: usize) -> Result<Vec<Element>> {
        element.knows(&["file"], &[])?;
        let name = element.required("file")?;
        let path = self.folder.join(name);
        if self.known.contains(&path) {
            return element.must_be("file", "a file that is not read already");
        }
        self.known.push(path.clone());
        let text = std::fs::read_to_string(&path).map_err(|source| MjcfError::Read {
            file: path.display().to_string(),
            by: format!(" (that {} names)", element.label()),
            source,
        })?;
        Ok(self.parse(&text, &path, depth)?.children)
    }
}

impl Element {
    /// `FILE:LINE: <TAG name="NAME">`.
    pub(crate) fn label(&self) -> String {
        format!("{}:{}: {}", self.place.file, self.place.line, self.title())
    }

    fn title(&self) -> String {
        let name = ["name", "prefix", "key"].into_iter().find_map(|key| Some((key, self.text(key)?)));
        let name = name.map(|(key, name)| format!(" {key}=\"{}\"", shortened(name))).unwrap_or_default();
        format!("<{}{name}>", self.tag)
    }

    /// An error: `<TAG>: MESSAGE`.
    pub(crate) fn wrong<T>(&self, message: &str) -> Result<T> {
        Err(MjcfError::Invalid {
            file: self.place.file.to_string(),
            line: self.place.line,
            message: format!("{}: {message}", self.title()),
        })
    }

    /// An error: `<TAG> ATTRIBUTE = "VALUE", but it must be ALLOWED`.
    pub(crate) fn must_be<T>(&self, name: &str, allowed: &str) -> Result<T> {
        self.at(name, &format!("it must be {allowed}"))
    }

    /// An error: `<TAG> ATTRIBUTE = "VALUE", but MESSAGE`.
    pub(crate) fn at<T>(&self, name: &str, message: &str) -> Result<T> {
        let Some(attribute) = self.attribute(name) else { return self.wrong(&format!("{name}: {message}")) };
        Err(MjcfError::Invalid {
            file: attribute.place.file.to_string(),
            line: attribute.place.line,
            message: format!("{} {name} = \"{}\", but {message}", self.title(), shortened(&attribute.value)),
        })
    }

    /// Refuses attributes other than these.
    pub(crate) fn knows(&self, read: &[&str], harmless: &[&str]) -> Result<()> {
        let is_known = |name: &str| read.contains(&name) || harmless.contains(&name);
        match self.attributes.iter().find(|attribute| !is_known(&attribute.name)) {
            None => Ok(()),
            Some(unknown) => {
                self.at(&unknown.name, &format!("this attribute is not read; read are {}", read.join(", ")))
            }
        }
    }

    pub(crate) fn children_of<'a>(&'a self, tag: &'a str) -> impl Iterator<Item = &'a Element> {
        self.children.iter().filter(move |child| child.tag == tag)
    }

    pub(crate) fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.attributes.iter().find(|attribute| attribute.name == name)
    }

    pub(crate) fn has(&self, name: &str) -> bool {
        self.attribute(name).is_some()
    }

    pub(crate) fn text(&self, name: &str) -> Option<&str> {
        self.attribute(name).map(|attribute| attribute.value.as_str())
    }

    pub(crate) fn required(&self, name: &str) -> Result<&str> {
        match self.text(name) {
            Some(text) => Ok(text),
            None => self.wrong(&format!("the attribute {name} is missing")),
        }
    }

    /// One of some words.
    pub(crate) fn choice<'a>(&self, name: &str, allowed: &[&'a str], default: &'a str) -> Result<&'a str> {
        let Some(text) = self.text(name) else { return Ok(default) };
        match allowed.iter().find(|word| **word == text) {
            Some(word) => Ok(word),
            None => self.must_be(name, &allowed.join(", ")),
        }
    }

    pub(crate) fn is_true(&self, name: &str, default: bool) -> Result<bool> {
        Ok(self.choice(name, &["true", "false"], if default { "true" } else { "false" })? == "true")
    }

    /// Numbers, as many as there are.
    pub(crate) fn numbers(&self, name: &str) -> Result<Option<Vec<f64>>> {
        let Some(text) = self.text(name) else { return Ok(None) };
        let number = |word: &str| word.parse().ok().filter(|v: &f64| v.abs() <= LARGEST);
        match text.split_whitespace().map(number).collect() {
            Some(numbers) => Ok(Some(numbers)),
            None => self.must_be(name, "finite numbers, 1e30 in size at most"),
        }
    }

    /// So many numbers.
    pub(crate) fn exactly<const N: usize>(&self, name: &str) -> Result<Option<[f64; N]>> {
        let Some(numbers) = self.numbers(name)? else { return Ok(None) };
        match numbers.try_into() {
            Ok(numbers) => Ok(Some(numbers)),
            Err(_) if N == 1 => self.must_be(name, "one number"),
            Err(_) => self.must_be(name, &format!("{N} numbers")),
        }
    }

    pub(crate) fn number(&self, name: &str, default: f64) -> Result<f64> {
        Ok(self.exactly::<1>(name)?.map_or(default, |[number]| number))
    }

    pub(crate) fn positive(&self, name: &str, default: f64, unit: &str) -> Result<f64> {
        match self.number(name, default)? {
            number if number > 0.0 => Ok(number),
            _ => self.must_be(name, &format!("> 0 [{unit}]")),
        }
    }

    pub(crate) fn not_negative(&self, name: &str, unit: &str) -> Result<f64> {
        match self.number(name, 0.0)? {
            number if number >= 0.0 => Ok(number),
            _ => self.must_be(name, &format!(">= 0 [{unit}]")),
        }
    }

    pub(crate) fn vector(&self, name: &str) -> Result<Option<Vector3<f64>>> {
        Ok(self.exactly::<3>(name)?.map(Vector3::from))
    }
}

fn shortened(text: &str) -> String {
    const LONGEST: usize = 60;
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ").replace(char::is_control, " ");
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text,
    }
}
