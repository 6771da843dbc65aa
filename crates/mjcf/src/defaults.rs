//! Classes of defaults: attributes that elements of a kind have where they do not give them.

use crate::error::Result;
use crate::xml::{Attribute, Element};

/// Attributes that say the same: who gives one of them takes none from a class.
const ALTERNATIVES: [&[&str]; 1] = [&["quat", "axisangle", "euler", "xyaxes", "zaxis"]];
/// What the class of all that name no other is called, unless the file calls it otherwise.
const MAIN: &str = "main";
/// Kinds whose defaults are read, or are of no use to what is read.
const KINDS: [&str; 20] = [
    "geom",
    "joint",
    "mesh",
    "material",
    "site",
    "camera",
    "light",
    "pair",
    "equality",
    "tendon",
    "general",
    "motor",
    "position",
    "velocity",
    "intvelocity",
    "damper",
    "cylinder",
    "muscle",
    "adhesion",
    "default",
];

struct Class {
    name: String,
    /// A kind, and the attributes of its elements.
    kinds: Vec<(String, Vec<Attribute>)>,
}

/// All classes of a file.
#[derive(Default)]
pub(crate) struct Defaults {
    /// The first one is that of all that name no other.
    classes: Vec<Class>,
}

impl Defaults {
    /// Reads the sections `default` of a file.
    pub(crate) fn read(root: &Element) -> Result<Self> {
        let mut defaults = Self::default();
        for section in root.children_of("default") {
            section.knows(&["class"], &[])?;
            let name = section.text("class").unwrap_or(MAIN);
            defaults.class(section, name.to_owned(), Vec::new())?;
        }
        Ok(defaults)
    }

    fn class(&mut self, section: &Element, name: String, mut kinds: Vec<(String, Vec<Attribute>)>) -> Result<()> {
        for element in section.children.iter().filter(|child| child.tag != "default") {
            if !KINDS.contains(&element.tag.as_str()) {
                return element.wrong("is not known in <default>");
            }
            match kinds.iter_mut().find(|(kind, _)| *kind == element.tag) {
                Some((_, known)) => *known = merged(&element.attributes, known),
                None => kinds.push((element.tag.clone(), element.attributes.clone())),
            }
        }
        // A section may be given in parts, by files that are included.
        match self.classes.iter_mut().find(|class| class.name == name) {
            Some(class) => {
                for (kind, own) in &kinds {
                    match class.kinds.iter_mut().find(|(known, _)| known == kind) {
                        Some((_, known)) => *known = merged(own, known),
                        None => class.kinds.push((kind.clone(), own.clone())),
                    }
                }
                kinds = class.kinds.clone();
            }
            None => self.classes.push(Class { name, kinds: kinds.clone() }),
        }
        for child in section.children_of("default") {
            child.knows(&["class"], &[])?;
            self.class(child, child.required("class")?.to_owned(), kinds.clone())?;
        }
        Ok(())
    }

    /// An element with what its class says, or else that of the body that it is in.
    pub(crate) fn applied(&self, element: &Element, childclass: Option<&str>) -> Result<Element> {
        let named = element.text("class").or(childclass);
        let class = match named {
            Some(name) => self.classes.iter().find(|class| class.name == name),
            None => self.classes.first(),
        };
        if let (Some(name), None) = (named, class)
            && name != MAIN
        {
            return element.wrong(&format!("there is no class \"{name}\""));
        }
        let own = class.and_then(|class| class.kinds.iter().find(|(kind, _)| *kind == element.tag));
        let mut element = element.clone();
        if let Some((_, defaults)) = own {
            element.attributes = merged(&element.attributes, defaults);
        }
        element.attributes.retain(|attribute| attribute.name != "class");
        Ok(element)
    }
}

/// Attributes, and those of `others` that they do not replace.
fn merged(own: &[Attribute], others: &[Attribute]) -> Vec<Attribute> {
    let gives = |name: &str| own.iter().any(|attribute| attribute.name == name);
    let replaced = |name: &str| {
        let same = ALTERNATIVES.iter().find(|names| names.contains(&name));
        gives(name) || same.is_some_and(|names| names.iter().any(|name| gives(name)))
    };
    own.iter().chain(others.iter().filter(|other| !replaced(&other.name))).cloned().collect()
}
