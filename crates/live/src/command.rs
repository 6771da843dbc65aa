//! What the page sends: one JSON object or word a message.

use serde::Deserialize;

use crate::input::Input;

/// Longest message of the page [bytes].
pub(crate) const LONGEST: usize = 4096;
/// Pace may be so slow and so fast, in simulated seconds a second.
const PACES: [f64; 2] = [1e-3, 100.0];

/// A message of the page.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum Command {
    /// Something is done to the motion.
    Do(Input),
    /// Time goes on.
    Play,
    /// Time stops.
    Pause,
    /// One step.
    Step,
    /// Simulated seconds a second.
    Pace(f64),
    /// To a moment not after a time [s].
    Back(f64),
    /// To the start.
    Reset,
    /// What happened is saved.
    Save,
}

impl Command {
    /// Reads a message.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(crate) fn read(text: &str) -> Result<Self, String> {
        let command = serde_json::from_str(text).map_err(|error| format!("no command: {error}"))?;
        match command {
            Self::Pace(pace) if !(PACES[0]..=PACES[1]).contains(&pace) => {
                Err(format!("the pace must be from {} to {}", PACES[0], PACES[1]))
            }
            Self::Back(time) if !time.is_finite() => Err("the time must be finite".to_owned()),
            command => Ok(command),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_command_is_refused() {
        assert_eq!(Command::read("\"play\""), Ok(Command::Play));
        assert_eq!(Command::read(r#"{"do":{"drop":{"hand":1}}}"#), Ok(Command::Do(Input::Drop { hand: 1 })));
        for text in [
            "",
            "{",
            "null",
            "\"fly\"",
            r#"{"do":{"drop":{"hand":1,"foot":2}}}"#,
            r#"{"do":{"drop":{"hand":256}}}"#,
            r#"{"do":{"grab":{"hand":0,"segment":-1,"at":[0,0,0]}}}"#,
            r#"{"do":{"grab":{"hand":0,"segment":1,"at":[0,0]}}}"#,
            r#"{"do":{"move":{"hand":0,"to":[0,0,1e999]}}}"#,
            r#"{"pace":0}"#,
            r#"{"pace":1e9}"#,
            r#"{"play":1}"#,
            r#"{"pause":null,"play":null}"#,
        ] {
            assert!(Command::read(text).is_err(), "{text}");
        }
    }
}
