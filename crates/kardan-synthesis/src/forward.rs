//! Methods that a law takes over from the law that it changes.

/// Methods whose result is that of a field: `forward! { law; fn inputs(&self) -> &[String]; }`.
macro_rules! forward {
    ($field:ident; $(fn $name:ident(&self $(, $argument:ident: $type:ty)*) $(-> $result:ty)?;)*) => {
        $(fn $name(&self $(, $argument: $type)*) $(-> $result)? {
            self.$field.$name($($argument),*)
        })*
    };
}
