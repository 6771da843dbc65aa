//! Numbers that know their place in the text.

use toml::Spanned;

use super::list::List;

pub(crate) type Number = Spanned<f64>;
pub(crate) type Count = Spanned<i64>;
pub(crate) type Vector = Spanned<List<f64, 3>>;
