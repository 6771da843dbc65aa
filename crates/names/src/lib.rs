//! Enums whose variants have names in files and flags.

/// Gives an enum without fields the list `ALL`, `name`, `Display`, and `FromStr`, whose error lists the names:
///
/// ```
/// #[derive(Clone, Copy, Debug, PartialEq)]
/// enum Side {
///     Left,
///     Right,
/// }
/// names::names!(Side { Left = "left", Right = "right" });
///
/// assert_eq!(Side::ALL.map(Side::name), ["left", "right"]);
/// assert_eq!((Side::Left.to_string().as_str(), "right".parse()), ("left", Ok(Side::Right)));
/// assert_eq!("up".parse::<Side>(), Err("expected one of left, right".to_owned()));
/// ```
#[macro_export]
macro_rules! names {
    ($of:ident { $($variant:ident = $name:literal),+ $(,)? }) => {
        impl $of {
            /// All of them, in the order in which messages list them.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$variant),+];

            /// The name in files and flags.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name),+
                }
            }
        }

        impl ::std::fmt::Display for $of {
            fn fmt(&self, f: &mut ::std::fmt::Formatter<'_>) -> ::std::fmt::Result {
                f.write_str(self.name())
            }
        }

        impl ::std::str::FromStr for $of {
            type Err = ::std::string::String;

            fn from_str(name: &str) -> ::std::result::Result<Self, Self::Err> {
                let found = Self::ALL.into_iter().find(|one| one.name() == name);
                found.ok_or_else(|| ::std::format!("expected one of {}", [$($name),+].join(", ")))
            }
        }
    };
}
