//! Declares the keys of a table once.

/// Declares the keys of a table as a struct.
///
/// ```text
/// keys! {
///     /// A lamp.
///     element Lamp("lamp") {
///         required { shaft: Shaft, "What it hangs on."; }
///         optional {
///             torque: Quantity(Dimension::TORQUE, Sign::Positive), "Left out: none.";
///             lag: Quantity(Dimension::TIME, Sign::NonNegative) = "0 s", "Time constant.";
///             load: Shaft as LOAD;
///         }
///     }
/// }
/// ```
///
/// A key has the name of its [`Kind`](crate::schema::Kind), its default, and a sentence for the manual;
/// or a constant that several tables share. A table without required or without optional keys leaves that group out. The struct
/// gets `new` with the required keys and a method for each other key.
#[doc(hidden)]
#[macro_export]
macro_rules! keys {
    ($(#[$meta:meta])* $mark:ident $name:ident $(($keyword:literal))? { required $required:tt }) => {
        $crate::keys! { $(#[$meta])* $mark $name $(($keyword))? { required $required optional {} } }
    };
    ($(#[$meta:meta])* $mark:ident $name:ident $(($keyword:literal))? { optional $optional:tt }) => {
        $crate::keys! { $(#[$meta])* $mark $name $(($keyword))? { required {} optional $optional } }
    };
    (
        $(#[$meta:meta])*
        $mark:ident $name:ident $(($keyword:literal))? {
            required { $( $rkey:ident: $rkind:ident $(($($rargs:tt)*))? $(, $rdoc:literal)? $(as $rshared:path)?; )* }
            optional { $( $key:ident: $kind:ident $(($($args:tt)*))? $(= $default:literal)? $(, $doc:literal)? $(as $shared:path)?; )* }
        }
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, PartialEq, Default)]
        pub struct $name {
            $( #[doc = $crate::keys!(@doc $($rdoc)?)]
               pub $rkey: $crate::keys!(@type $rkind $(($($rargs)*))?), )*
            $( #[doc = $crate::keys!(@doc $($doc)?)]
               pub $key: Option<$crate::keys!(@type $kind $(($($args)*))?)>, )*
        }

        impl $crate::schema::Keys for $name {
            const FIELDS: &'static [$crate::schema::Field] = &[
                $( $crate::keys!(@field required $rkey [$rkind $(($($rargs)*))?] [] [$($rdoc)?] [$($rshared)?]), )*
                $( $crate::keys!(@field optional $key [$kind $(($($args)*))?] [$($default)?] [$($doc)?] [$($shared)?]), )*
            ];

            #[allow(unused_mut, clippy::let_and_return)]
            fn entries(&self) -> $crate::entries::Entries {
                use $crate::schema::EntryValue;
                let mut out = $crate::entries::Entries::default();
                $( out.set(stringify!($rkey), self.$rkey.raw()); )*
                $( if let Some(value) = &self.$key { out.set(stringify!($key), value.raw()); } )*
                out
            }

            #[allow(unused_variables)]
            fn read_entries(entries: &$crate::entries::Entries) -> Option<Self> {
                use $crate::schema::EntryValue;
                Some(Self {
                    $( $rkey: EntryValue::read(entries.get(stringify!($rkey))?)?, )*
                    $( $key: match entries.get(stringify!($key)) { Some(raw) => Some(EntryValue::read(raw)?), None => None }, )*
                })
            }
        }

        impl $name {
            /// With the required keys; all others are left out.
            #[allow(clippy::new_without_default, clippy::too_many_arguments)]
            pub fn new($($rkey: impl Into<$crate::keys!(@type $rkind $(($($rargs)*))?)>),*) -> Self {
                Self { $($rkey: $rkey.into(),)* $($key: None,)* }
            }

            $(
                #[doc = $crate::keys!(@doc $($doc)?)]
                #[must_use]
                pub fn $key(mut self, $key: impl Into<$crate::keys!(@type $kind $(($($args)*))?)>) -> Self {
                    self.$key = Some($key.into());
                    self
                }
            )*
        }

        $crate::keys!(@mark $mark $name $($keyword)?);
    };

    (@mark table $name:ident) => {};
    (@mark element $name:ident $keyword:literal) => { $crate::keys!(@keyword ElementKeys $name $keyword); };
    (@mark signal $name:ident $keyword:literal) => { $crate::keys!(@keyword SignalKeys $name $keyword); };
    (@mark block $name:ident $keyword:literal) => { $crate::keys!(@keyword BlockKeys $name $keyword); };
    (@mark law $name:ident $keyword:literal) => { $crate::keys!(@keyword LawKeys $name $keyword); };
    (@keyword $group:ident $name:ident $keyword:literal) => {
        impl $crate::schema::$group for $name {
            const KEYWORD: &'static str = $keyword;
        }
    };

    (@doc) => { "Shared with other tables: see the manual." };
    (@doc $doc:literal) => { $doc };

    (@field $need:ident $key:ident [$($kind:tt)*] [] [] [$shared:path]) => { $shared };
    (@field $need:ident $key:ident [$($kind:tt)*] [] [$doc:literal] []) => {
        $crate::schema::Field::$need(stringify!($key), $crate::keys!(@kind $($kind)*), $doc)
    };
    (@field $need:ident $key:ident [$($kind:tt)*] [$default:literal] [$doc:literal] []) => {
        $crate::schema::Field::with_default(stringify!($key), $crate::keys!(@kind $($kind)*), $default, $doc)
    };

    (@kind Tables($table:ty)) => { $crate::schema::Kind::Tables(<$table as $crate::schema::Keys>::FIELDS) };
    (@kind Table($table:ty)) => { $crate::schema::Kind::Table(<$table as $crate::schema::Keys>::FIELDS) };
    (@kind $kind:ident $(($($args:tt)*))?) => { $crate::schema::Kind::$kind $(($($args)*))? };

    (@type Tables($table:ty)) => { Vec<$table> };
    (@type Table($table:ty)) => { $table };
    (@type Quantity $($args:tt)*) => { $crate::schema::Quantity };
    (@type Mechanical $($args:tt)*) => { $crate::schema::Quantity };
    (@type AnyQuantity) => { $crate::schema::Quantity };
    (@type Number $($args:tt)*) => { $crate::schema::Quantity };
    (@type Coefficients) => { $crate::schema::Named };
    (@type Overrides) => { $crate::schema::Named };
    (@type Point) => { $crate::schema::Named };
    (@type Formula $($args:tt)*) => { $crate::schema::Quantity };
    (@type Expressions) => { $crate::schema::Named };
    (@type Expression) => { $crate::schema::Quantity };
    (@type OfTime $($args:tt)*) => { $crate::schema::Quantity };
    (@type Surface) => { $crate::schema::Quantity };
    (@type Formulas) => { $crate::schema::Named };
    (@type Functions) => { $crate::schema::Named };
    (@type Lists) => { $crate::schema::Lists };
    (@type Poles) => { $crate::schema::Quantities };
    (@type Shafts $($args:tt)*) => { $crate::schema::Names };
    (@type Elements $($args:tt)*) => { $crate::schema::Names };
    (@type Signals) => { $crate::schema::Names };
    (@type Outputs) => { $crate::schema::Names };
    (@type Names) => { $crate::schema::Names };
    (@type $kind:ident $($args:tt)*) => { String };
}
