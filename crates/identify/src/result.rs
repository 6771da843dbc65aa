//! What an identification writes and reads back: `result.json`.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use export::{ExportError, write_json};
use serde::{Deserialize, Serialize};

use crate::cable::Resolution;
use crate::confidence::Known;
use crate::fit::Stage;
use crate::parameter::{Parameter, Parameters};

/// All that is needed to predict with a cable, and to repeat its identification.
#[derive(Clone, Debug, Serialize, Deserialize, PartialEq)]
pub struct CableFile {
    /// The parameters by their names.
    pub parameters: BTreeMap<String, Value>,
    /// Segments between two markers.
    pub segments: usize,
    /// Steps from frame to frame.
    pub steps: usize,
    /// Distance from which on the loss is linear [m].
    pub huber_m: f64,
    /// The stages of the search.
    pub stages: Vec<Stage>,
    /// The recordings that it was identified on.
    pub recordings: Vec<String>,
    /// Whether the search was stopped before its end.
    pub stopped: bool,
    /// Time of the search [s].
    pub seconds: f64,
    /// Mean errors of recordings [m], of those to fit and of those to predict.
    pub errors_m: BTreeMap<String, f64>,
}

/// A parameter in a file.
#[derive(Clone, Debug, Serialize, Deserialize, PartialEq)]
pub struct Value {
    /// Its value.
    pub value: f64,
    /// Its unit.
    pub unit: String,
    /// Its 95 % interval; none where it is held.
    pub interval: Option<[f64; 2]>,
}

/// The parameters as they stand in the file.
pub fn values(known: &[Known]) -> BTreeMap<String, Value> {
    let one = |known: &Known| {
        let unit = known.parameter.unit().to_owned();
        (known.parameter.name().to_owned(), Value { value: known.value, unit, interval: known.interval })
    };
    known.iter().map(one).collect()
}

impl CableFile {
    /// Writes it.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn write(&self, path: &Path) -> Result<(), ExportError> {
        write_json(path, self)
    }

    /// Reads it back.
    ///
    /// # Errors
    /// With the file, and what is wrong in it.
    pub fn read(path: &Path) -> Result<Self, String> {
        let text = fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
        let file: Self = serde_json::from_str(&text).map_err(|error| format!("{}: {error}", path.display()))?;
        file.parameters().map_err(|message| format!("{}: {message}", path.display()))?;
        Ok(file)
    }

    /// Its parameters; what it does not name is held where searches begin.
    ///
    /// # Errors
    /// If a name is unknown, or a value is not within its bounds.
    pub fn parameters(&self) -> Result<Parameters, String> {
        let mut parameters = Parameters::default();
        for (name, value) in &self.parameters {
            parameters.set(name, value.value)?;
        }
        if self.segments == 0 || self.steps == 0 {
            return Err("segments and steps must be 1 or more".to_owned());
        }
        Ok(parameters)
    }
}

impl CableFile {
    /// How finely the cable was simulated.
    pub fn resolution(&self) -> Resolution {
        Resolution { segments: self.segments, steps: self.steps }
    }

    /// What is known of each parameter.
    pub fn known(&self) -> Vec<Known> {
        let one = |parameter: Parameter| {
            let value = self.parameters.get(parameter.name())?;
            Some(Known { parameter, value: value.value, interval: value.interval })
        };
        Parameter::ALL.into_iter().filter_map(one).collect()
    }
}

impl Parameters {
    /// Sets a parameter by its name.
    ///
    /// # Errors
    /// If there is none of this name, or the value is not within its bounds. A drag may be 0.
    pub fn set(&mut self, name: &str, value: f64) -> Result<(), String> {
        let parameter: Parameter = name.parse().map_err(|allowed| format!("parameter {name:?}: {allowed}"))?;
        let [least, most] = parameter.bounds();
        let is_drag = matches!(parameter, Parameter::DragAcross | Parameter::DragAlong);
        if !((least..=most).contains(&value) || is_drag && value == 0.0) {
            return Err(format!("{name} = {value}, but it must be {least} to {most} {}", parameter.unit()));
        }
        self[parameter] = value;
        Ok(())
    }
}
