//! Which markers of a cable its grips hold.

use std::fmt;
use std::str::FromStr;

/// Which markers of a cable its two grips hold: those are given to a prediction over all time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Grips {
    /// Two markers at each end, which give the place and the direction of each grip.
    #[default]
    Ends,
    /// One marker between the ends, which gives the place of a grip that keeps its direction; and two at the end. What lies before that
    /// marker is free.
    Middle(usize),
}

impl Grips {
    /// The marker at which the first grip holds the cable.
    pub fn first(self) -> usize {
        match self {
            Self::Ends => 1,
            Self::Middle(marker) => marker,
        }
    }

    /// The markers that are given, of a cable of so many.
    pub fn given(self, count: usize) -> Vec<usize> {
        let first = match self {
            Self::Ends => 0..2,
            Self::Middle(marker) => marker..marker + 1,
        };
        first.chain(count - 2..count).collect()
    }

    /// The markers that are not given, of a cable of so many.
    pub fn free(self, count: usize) -> impl Iterator<Item = usize> {
        let given = self.given(count);
        (0..count).filter(move |marker| !given.contains(marker))
    }

    /// Says what is wrong where a cable of so many markers cannot be held so: there must be a marker between the grips.
    ///
    /// # Errors
    /// With the number of markers and what is allowed.
    pub fn check(self, count: usize) -> Result<(), String> {
        if self.first() + 4 <= count {
            return Ok(());
        }
        Err(match self {
            Self::Ends => {
                format!("{count} markers on the parent, but there must be at least two in each grip, one between")
            }
            Self::Middle(marker) => format!(
                "--grips {self}: a grip at marker {marker} of {count} on the parent, but it must be one of 1 to {}, so that a marker \
                 lies between the grips",
                count.saturating_sub(4)
            ),
        })
    }
}

impl fmt::Display for Grips {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ends => f.pad("0,1,-2,-1"),
            Self::Middle(marker) => write!(f, "{marker},-2,-1"),
        }
    }
}

impl FromStr for Grips {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let allowed = || {
            format!(
                "{text:?}: it must be 0,1,-2,-1, or M,-2,-1 with a marker M of the parent from 1 on; markers count from 0, -1 is the \
                 parent's last"
            )
        };
        let markers: Vec<i64> =
            text.split(',').map(|marker| marker.trim().parse()).collect::<Result<_, _>>().map_err(|_| allowed())?;
        match markers[..] {
            [0, 1, -2, -1] => Ok(Self::Ends),
            [marker, -2, -1] if marker > 0 => Ok(Self::Middle(marker as usize)),
            _ => Err(allowed()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grips_are_read_as_they_are_written() {
        for (text, grips, given) in
            [("0,1,-2,-1", Grips::Ends, vec![0, 1, 8, 9]), ("2,-2,-1", Grips::Middle(2), vec![2, 8, 9])]
        {
            assert_eq!(text.parse::<Grips>().unwrap(), grips);
            assert_eq!(grips.to_string(), text);
            assert_eq!(grips.given(10), given);
            assert_eq!(grips.free(10).count(), 10 - given.len());
        }
        for text in ["2", "0,-2,-1", "2,3,-2,-1", "a,-2,-1", "-3,-2,-1", ""] {
            assert!(text.parse::<Grips>().unwrap_err().contains("M,-2,-1"), "{text}");
        }
    }

    #[test]
    fn a_marker_must_lie_between_the_grips() {
        assert!(Grips::Ends.check(5).is_ok() && Grips::Ends.check(4).is_err());
        assert!(Grips::Middle(2).check(6).is_ok());
        assert!(Grips::Middle(3).check(6).unwrap_err().contains("one of 1 to 2"));
    }
}
