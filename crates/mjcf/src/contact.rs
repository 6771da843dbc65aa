//! Which geoms touch, and with which coefficient of friction.

use crate::error::Result;
use crate::xml::Element;

/// What a geom says of its contacts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Touch {
    contype: u32,
    conaffinity: u32,
    condim: u32,
    priority: i64,
    /// Coefficient of sliding friction.
    friction: f64,
}

impl Touch {
    pub(crate) fn read(element: &Element) -> Result<Self> {
        let bits = |name| match element.number(name, 1.0)? {
            bits if bits >= 0.0 && bits <= f64::from(u32::MAX) && bits.fract() == 0.0 => Ok(bits as u32),
            _ => element.must_be(name, "a whole number from 0 to 4294967295"),
        };
        let condim = match element.number("condim", 3.0)? {
            dim @ (1.0 | 3.0 | 4.0 | 6.0) => dim as u32,
            _ => return element.must_be("condim", "1, 3, 4 or 6"),
        };
        let priority = match element.number("priority", 0.0)? {
            priority if priority.fract() == 0.0 => priority as i64,
            _ => return element.must_be("priority", "a whole number"),
        };
        let friction = match element.numbers("friction")?.as_deref() {
            None => 1.0,
            Some([first, ..]) if *first >= 0.0 => *first,
            Some(_) => return element.must_be("friction", "one to three numbers >= 0"),
        };
        Ok(Self { contype: bits("contype")?, conaffinity: bits("conaffinity")?, condim, priority, friction })
    }

    /// Whether no other geom can touch it.
    pub(crate) fn touches_nothing(&self) -> bool {
        self.contype == 0 && self.conaffinity == 0
    }

    /// The coefficient of friction with which two geoms touch; `None` where they do not.
    pub(crate) fn with(&self, other: &Self) -> Option<f64> {
        if self.contype & other.conaffinity == 0 && other.contype & self.conaffinity == 0 {
            return None;
        }
        let (condim, friction) = match self.priority.cmp(&other.priority) {
            std::cmp::Ordering::Greater => (self.condim, self.friction),
            std::cmp::Ordering::Less => (other.condim, other.friction),
            std::cmp::Ordering::Equal => (self.condim.max(other.condim), self.friction.max(other.friction)),
        };
        Some(if condim == 1 { 0.0 } else { friction })
    }
}

/// The coefficient of friction that all of these pairs have, or that none of them touches.
pub(crate) enum Common {
    None,
    Friction(f64),
    /// They differ.
    Mixed,
}

impl Common {
    pub(crate) fn of(pairs: impl IntoIterator<Item = Option<f64>>) -> Self {
        let mut pairs = pairs.into_iter();
        let Some(first) = pairs.next() else { return Self::None };
        match (first, pairs.all(|pair| pair == first)) {
            (_, false) => Self::Mixed,
            (None, true) => Self::None,
            (Some(friction), true) => Self::Friction(friction),
        }
    }
}
