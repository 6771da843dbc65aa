//! CSV tables with a header that names quantities and units.

use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use toml::Spanned;

use crate::SceneError;
use crate::error::{AT_MOST, LARGEST, Result, Source};

/// The text of the file that a scene names, from the scene's own folder on, and its path for errors.
pub(crate) fn text(source: &Source, name: &Spanned<String>) -> Result<(String, String)> {
    let (path, file) = place(source, name, "a CSV file")?;
    Ok((utf_8(bytes(&path, &file)?, &file)?, file))
}

/// What is in a file, whose name stands in errors.
pub(crate) fn bytes(path: &Path, file: &str) -> Result<Vec<u8>> {
    std::fs::read(path).map_err(|source| SceneError::Read { file: file.to_owned(), source })
}

/// The text of a file, whose name stands in errors.
pub(crate) fn utf_8(bytes: Vec<u8>, file: &str) -> Result<String> {
    match String::from_utf8(bytes) {
        Ok(text) => Ok(text),
        Err(error) => {
            let file = file.to_owned();
            let valid = error.utf8_error().valid_up_to();
            let line = 1 + error.as_bytes()[..valid].iter().filter(|&&byte| byte == b'\n').count();
            Err(SceneError::Invalid { file, line, message: "this is no CSV file: its text must be UTF-8".to_owned() })
        }
    }
}

/// Where the file is that a scene names, from the scene's own folder on, and the same for errors; `what` it must be.
pub(crate) fn place(source: &Source, name: &Spanned<String>, what: &str) -> Result<(PathBuf, String)> {
    let path = Path::new(source.file).parent().unwrap_or_else(|| Path::new("")).join(name.get_ref());
    let file = path.display().to_string();
    if !path.is_file() {
        return source.must_be(name.span(), &format!("{what}, and there is none at {file}"));
    }
    source.notes.file(name.span(), &path);
    Ok((path, file))
}

/// A table whose header has been read.
pub(crate) struct Table<'a> {
    file: &'a str,
    /// Line of the header.
    head: usize,
    header: Vec<String>,
    reader: csv::Reader<&'a [u8]>,
}

impl<'a> Table<'a> {
    /// The table in a text, whose columns are among the `known` ones; `file` stands in errors.
    pub(crate) fn new(text: &'a str, file: &'a str, known: &[&[&str]]) -> Result<Self> {
        let head = 1 + text.lines().take_while(|line| line.trim().is_empty()).count();
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
        let header = reader.headers().map(|header| header.iter().map(str::to_owned).collect::<Vec<_>>());
        let mistake = header.as_ref().err().map(ToString::to_string);
        let table = Self { file, head, header: header.unwrap_or_default(), reader };
        if let Some(mistake) = mistake {
            return table.wrong(mistake);
        }
        let is_known = |name: &String| known.iter().any(|columns| columns.contains(&name.as_str()));
        match table.header.iter().find(|name| !is_known(name)) {
            Some(name) => {
                table.wrong(format!("column `{name:.40}` is not known; there are {}", known.concat().join(", ")))
            }
            None => Ok(table),
        }
    }

    /// An error of the header.
    pub(crate) fn wrong<T>(&self, message: String) -> Result<T> {
        self.wrong_in(self.head, message)
    }

    fn wrong_in<T>(&self, line: usize, message: String) -> Result<T> {
        let message = message.replace(char::is_control, " ");
        Err(SceneError::Invalid { file: self.file.to_owned(), line, message })
    }

    /// Where these columns are, which go together; `None` where there is none of them.
    pub(crate) fn columns(&self, names: &[&str]) -> Result<Option<Vec<usize>>> {
        let times = |name: &&str| self.header.iter().filter(|own| own == name).count();
        if let Some(name) = names.iter().find(|name| times(name) > 1) {
            return self.wrong(format!("there are two columns `{name}`"));
        }
        let found: Vec<usize> =
            names.iter().filter_map(|name| self.header.iter().position(|own| own == name)).collect();
        if !found.is_empty() && found.len() < names.len() {
            return self.wrong(format!("some of the columns {} are missing", names.join(", ")));
        }
        Ok((!found.is_empty()).then_some(found))
    }

    /// Gives each row to `take`, which says what is wrong with it.
    pub(crate) fn rows(&mut self, mut take: impl FnMut(&Row) -> std::result::Result<(), String>) -> Result<()> {
        let mut record = csv::StringRecord::new();
        loop {
            match self.reader.read_record(&mut record) {
                Ok(true) => {}
                Ok(false) => return Ok(()),
                Err(error) => {
                    let line = error.position().map_or(1, |place| place.line() as usize);
                    return self.wrong_in(line, "this row has not as many values as the header has columns".to_owned());
                }
            }
            if let Err(message) = take(&Row { header: &self.header, record: &record }) {
                return self.wrong_in(record.position().map_or(1, |place| place.line() as usize), message);
            }
        }
    }
}

/// A row of a table.
pub(crate) struct Row<'a> {
    header: &'a [String],
    record: &'a csv::StringRecord,
}

impl Row<'_> {
    pub(crate) fn number(&self, column: usize) -> std::result::Result<f64, String> {
        match self.record[column].parse::<f64>() {
            Ok(value) if value.abs() <= LARGEST => Ok(value),
            Ok(value) if value.is_finite() => {
                Err(format!("{} = {:.40}, but it must be {AT_MOST}", self.header[column], &self.record[column]))
            }
            _ => Err(format!("{} = {:.40}, but it must be a finite number", self.header[column], &self.record[column])),
        }
    }

    pub(crate) fn numbers<const N: usize>(&self, columns: &[usize]) -> std::result::Result<[f64; N], String> {
        let mut values = [0.0; N];
        for (value, &column) in values.iter_mut().zip(columns) {
            *value = self.number(column)?;
        }
        Ok(values)
    }

    pub(crate) fn vector(&self, columns: &[usize]) -> std::result::Result<Vector3<f64>, String> {
        self.numbers(columns).map(Vector3::from)
    }
}
