//! The text of a scene's file, which a run keeps with the files that it names.

use std::cell::RefCell;
use std::ops::Range;
use std::path::{Path, PathBuf};

use crate::entries;

/// The text of a scene's file, and the other files that it names.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SceneText {
    text: String,
    /// In the order of the text.
    named: Vec<Named>,
}

/// What a scene names.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Named {
    /// Place of the value in the text, with its quotes.
    span: Range<usize>,
    /// Seen from where the program runs.
    path: PathBuf,
    /// What follows the path of a run's folder in the value; `None` of a file.
    folder: Option<String>,
}

impl SceneText {
    /// The files that the text names, each once, in its order; seen from where the program runs.
    pub fn files(&self) -> Vec<&Path> {
        let mut files: Vec<&Path> = Vec::new();
        for named in self.named.iter().filter(|named| named.folder.is_none()) {
            if !files.contains(&named.path.as_path()) {
                files.push(&named.path);
            }
        }
        files
    }

    /// What the rods of the text do not say of their material, and what it is then, a line each rod: `cable: radius_m = 0.05`.
    pub fn left_out(&self) -> Vec<String> {
        entries::left_out(&self.text)
    }

    /// The text with other names of these files, from [`SceneText::files`] with the name of each: what it says when it stands in
    /// the folder in which they have these names. Folders of runs (`run.from`) are named in full.
    pub fn with_names(&self, names: &[(&Path, String)]) -> String {
        let mut text = self.text.clone();
        for Named { span, path, folder } in self.named.iter().rev() {
            let name = match folder {
                None => names.iter().find(|(known, _)| known == path).map(|(_, name)| name.clone()),
                Some(frame) => std::path::absolute(path).ok().map(|path| format!("{}{frame}", path.display())),
            };
            if let Some(name) = name {
                text.replace_range(span.clone(), &toml::Value::String(name).to_string());
            }
        }
        text
    }
}

/// What a text names, noted down while it is read.
#[derive(Default)]
pub(crate) struct Notes(RefCell<Vec<Named>>);

impl Notes {
    /// Notes a file down.
    pub(crate) fn file(&self, span: Range<usize>, path: &Path) {
        self.note(Named { span, path: path.to_owned(), folder: None });
    }

    /// Notes the folder of a run down, and what follows it.
    pub(crate) fn folder(&self, span: Range<usize>, path: &Path, frame: Option<usize>) {
        let frame = frame.map(|frame| format!("@{frame}")).unwrap_or_default();
        self.note(Named { span, path: path.to_owned(), folder: Some(frame) });
    }

    fn note(&self, named: Named) {
        let mut all = self.0.borrow_mut();
        // A file may be read more than once.
        if let Err(place) = all.binary_search_by_key(&named.span.start, |other| other.span.start) {
            all.insert(place, named);
        }
    }

    /// The text with all that was noted down.
    pub(crate) fn text(&self, text: &str) -> SceneText {
        SceneText { text: text.to_owned(), named: self.0.borrow().clone() }
    }
}
