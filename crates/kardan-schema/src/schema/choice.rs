//! The choices of a key as a type.

/// Declares a type for the words of a choice: `Measure::NAMES` for its key, `of` to read one, `word` to write it.
#[doc(hidden)]
#[macro_export]
macro_rules! choice {
    ($(#[$meta:meta])* $name:ident { $($(#[$about:meta])* $variant:ident = $word:literal,)* }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum $name {
            $($(#[$about])* $variant,)*
        }

        impl $name {
            /// The words of a model file.
            pub const NAMES: &'static [&'static str] = &[$($word),*];

            /// The value of a word.
            pub fn of(word: &str) -> Option<Self> {
                match word {
                    $($word => Some(Self::$variant),)*
                    _ => None,
                }
            }

            /// The word in a model file.
            pub const fn word(self) -> &'static str {
                match self {
                    $(Self::$variant => $word,)*
                }
            }
        }

        impl From<$name> for String {
            fn from(choice: $name) -> Self {
                choice.word().into()
            }
        }
    };
}
