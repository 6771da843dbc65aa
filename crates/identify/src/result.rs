//! What an identification writes and reads back: `result.json`.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use export::{ExportError, write_json};
use serde::{Deserialize, Serialize};

use crate::cable::Resolution;
use crate::confidence::Known;
use crate::conformal::Regions;
use crate::fit::{Search, Stage};
use crate::parameter::Parameters;
use crate::quantity::Quantity;
use crate::recording::{Grips, Reading};
use crate::specimen::Numbers;

/// All that is needed to predict with what was identified, and to repeat its identification.
#[derive(Clone, Debug, Serialize, Deserialize, PartialEq)]
pub struct CableFile {
    /// What makes the result doubtful.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// What it is: a cable, a cable with branches, a noodle.
    pub kind: String,
    /// The parameters by their names.
    pub parameters: BTreeMap<String, Value>,
    /// Those that were searched for; the others were held.
    pub free: Vec<String>,
    /// Segments between two markers; of a noodle, in all.
    pub segments: usize,
    /// Steps from frame to frame.
    pub steps: usize,
    /// How finely it was searched for; none: as finely as it is predicted.
    #[serde(default)]
    pub search: Option<Resolution>,
    /// Distance from which on the loss is linear [m].
    pub huber_m: f64,
    /// The stages of the search.
    pub stages: Vec<Stage>,
    /// The markers along each rod.
    pub rods: Vec<Vec<usize>>,
    /// The recordings that it was identified on.
    pub recordings: Vec<String>,
    /// Frames a second of files that do not say it.
    pub rate_per_s: f64,
    /// Unit of length of the files [m].
    pub unit_m: f64,
    /// The markers that grips hold, of a cable with branches those of the parent ([`Grips`]).
    #[serde(default = "ends")]
    pub grips: String,
    /// Whether the search was stopped before its end.
    pub stopped: bool,
    /// Time of the search [s].
    pub seconds: f64,
    /// Regions about predictions; none where the recordings were too few, or the search was stopped.
    #[serde(default)]
    pub regions: Option<Regions>,
    /// Errors of recordings [m] by their names, of those to fit and of those to predict.
    pub errors_m: BTreeMap<String, BTreeMap<String, f64>>,
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

/// The usual grips.
fn ends() -> String {
    Grips::Ends.to_string()
}

impl CableFile {
    /// What is to be written of a search, and of how finely it was searched for and is predicted.
    pub fn new<Q: Quantity>(
        kind: &str,
        search: &Search<Q>,
        [searched, predicted]: [Resolution; 2],
        reading: Reading,
    ) -> Self {
        Self {
            warnings: Vec::new(),
            kind: kind.to_owned(),
            parameters: BTreeMap::new(),
            free: Vec::new(),
            segments: predicted.segments,
            steps: predicted.steps,
            search: (searched != predicted).then_some(searched),
            huber_m: search.huber,
            stages: search.stages.clone(),
            rods: Vec::new(),
            recordings: Vec::new(),
            rate_per_s: reading.rate,
            unit_m: reading.unit,
            grips: reading.grips.to_string(),
            stopped: false,
            seconds: 0.0,
            regions: None,
            errors_m: BTreeMap::new(),
        }
    }

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
        let wrong = |message: String| format!("{}: {message}", path.display());
        let text = fs::read_to_string(path).map_err(|error| wrong(error.to_string()))?;
        let file: Self = serde_json::from_str(&text).map_err(|error| wrong(error.to_string()))?;
        if file.segments == 0 || file.steps == 0 {
            return Err(wrong("segments and steps must be 1 or more".to_owned()));
        }
        for (key, value) in [("rate_per_s", file.rate_per_s), ("unit_m", file.unit_m)] {
            if !(value.is_finite() && value > 0.0) {
                return Err(wrong(format!("{key} = {value}, but it must be above 0")));
            }
        }
        if file.regions.as_ref().is_some_and(|regions| !regions.is_sound()) {
            return Err(wrong("its regions must have a radius of each marker at each time, in order".to_owned()));
        }
        Ok(file)
    }

    /// How its recordings were read.
    ///
    /// # Errors
    /// If its grips are none.
    pub fn reading(&self) -> Result<Reading, String> {
        let grips = self.grips.parse().map_err(|message| format!("grips: {message}"))?;
        Ok(Reading { rate: self.rate_per_s, unit: self.unit_m, grips })
    }

    /// The parameters of a cable without branches; what the file does not name is held where searches begin.
    ///
    /// # Errors
    /// If a name is unknown, or a value is not within its bounds.
    pub fn parameters(&self) -> Result<Parameters, String> {
        self.numbers(Parameters::default())
    }

    /// What it says instead of some numbers.
    ///
    /// # Errors
    /// If a name is unknown, or a value is not within its bounds.
    pub fn numbers<N: Numbers>(&self, mut numbers: N) -> Result<N, String> {
        for (name, value) in &self.parameters {
            numbers.set(name, value.value).map_err(|message| format!("a {}: {message}", self.kind))?;
        }
        Ok(numbers)
    }

    /// How finely it was simulated.
    pub fn resolution(&self) -> Resolution {
        Resolution { segments: self.segments, steps: self.steps }
    }

    /// Notes what is known of each of some numbers.
    pub fn note<Q: Quantity>(&mut self, known: &[Known<Q>]) {
        let one = |known: &Known<Q>| {
            let unit = known.parameter.unit().to_owned();
            (known.parameter.to_string(), Value { value: known.value, unit, interval: known.interval })
        };
        self.parameters = known.iter().map(one).collect();
    }

    /// What is known of each of some numbers.
    pub fn known<N: Numbers>(&self, numbers: &N) -> Vec<Known<N::Quantity>> {
        let one = |parameter: N::Quantity| {
            let interval = self.parameters.get(&parameter.to_string()).and_then(|value| value.interval);
            Known { parameter, value: numbers[parameter], interval }
        };
        numbers.quantities().into_iter().map(one).collect()
    }
}
