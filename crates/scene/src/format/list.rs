//! Lists of a fixed length.

use std::marker::PhantomData;

use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// `N` values, no fewer and no more: serde's own arrays leave further values unread.
#[derive(Clone, Copy)]
pub(crate) struct List<T, const N: usize>(pub(crate) [T; N]);

impl<'de, T: Deserialize<'de>, const N: usize> Deserialize<'de> for List<T, N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Exactly<T, const N: usize>(PhantomData<T>);

        impl<'de, T: Deserialize<'de>, const N: usize> Visitor<'de> for Exactly<T, N> {
            type Value = List<T, N>;

            fn expecting(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
                write!(formatter, "an array of length {N}")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut values: A) -> Result<List<T, N>, A::Error> {
                let mut found = Vec::new();
                while let Some(value) = values.next_element()? {
                    found.push(value);
                }
                let count = found.len();
                found.try_into().map(List).map_err(|_| A::Error::invalid_length(count, &self))
            }
        }

        deserializer.deserialize_seq(Exactly(PhantomData))
    }
}
