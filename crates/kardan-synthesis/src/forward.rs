//! Methods that a law takes over from the law that it changes, and a block from the block that it changes.

/// Methods whose result is that of a field: `forward! { law; fn inputs(&self) -> &[String]; }`.
macro_rules! forward {
    ($field:ident; $(fn $name:ident(&self $(, $argument:ident: $type:ty)*) $(-> $result:ty)?;)*) => {
        $(fn $name(&self $(, $argument: $type)*) $(-> $result)? {
            self.$field.$name($($argument),*)
        })*
    };
}

/// What a block has in addition to commands and states is that of the block inside it: `forward_rest! { block }`.
macro_rules! forward_rest {
    ($field:ident) => {
        fn archive_state(&mut self, archive: &mut kardan_math::num::StateArchive<'_>) {
            self.$field.archive_state(archive);
        }

        fn health(&self) -> kardan_rt::Health {
            self.$field.health()
        }
    };
}
