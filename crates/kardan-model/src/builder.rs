//! Builds a model in a program.

use crate::tables::{
    Analysis, Bench, Event, Fault, Figure, Header, Identification, Log, Plot, Requirement, Safety, Scenario, Sweep,
    Variant,
};
use kardan_elements::manoeuvre::{Manoeuvre, Path};
use kardan_schema::entries::{Entries, Entry, RawValue};
use kardan_schema::schema::{BlockKeys, ElementKeys, EntryValue, Keys, LawKeys, Quantities, Quantity, SignalKeys};

/// A model that a program builds, or changes: every table of a model file as a typed struct. The resulting
/// project reports its errors, as for a file, with the path of the entry.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Builder {
    entries: Entries,
}

/// Methods that write a table of one kind: `[key]`, an entry of the list `[[key]]`, or `[key.NAME]`.
macro_rules! setters {
    ($($(#[$about:meta])+ $how:ident $method:ident($key:literal $(, $name:ident)?): $keys:ty;)*) => {
        $(
            $(#[$about])+
            #[must_use]
            pub fn $method(self, $($name: &str,)? keys: $keys) -> Self {
                self.$how($key, $($name,)? &keys)
            }
        )*
    };
}

impl Builder {
    setters! {
        /// `[model]`
        table header("model"): Header;
        /// `[scenario]`
        table scenario("scenario"): Scenario;
        /// `[safety]`
        table safety("safety"): Safety;
        /// `[sweep]`
        table sweep("sweep"): Sweep;
        /// A `[[requirement]]` after the existing ones.
        listed requirement("requirement"): Requirement;
        /// A `[[figure]]` after the existing ones.
        listed figure("figure"): Figure;
        /// A `[[plot]]` after the existing ones.
        listed plot("plot"): Plot;
        /// A `[[variant]]` after the existing ones.
        listed variant("variant"): Variant;
        /// `[analysis]`
        table analysis("analysis"): Analysis;
        /// `[bench]`
        table bench("bench"): Bench;
        /// `[identification]`
        table identification("identification"): Identification;
        /// A manoeuvre `[manoeuvre.NAME]`, in place of one of that name.
        named manoeuvre("manoeuvre", name): Manoeuvre;
        /// Lanes `[path.NAME]`, in place of those of that name.
        named path("path", name): Path;
        /// `[fault.NAME]`
        named fault("fault", name): Fault;
        /// `[log.NAME]`
        named log("log", name): Log;
    }

    /// A model with only a name.
    pub fn new(name: impl Into<String>) -> Self {
        Self::default().header(Header::default().name(name))
    }

    /// The entries so far, mutable.
    pub fn from_entries(entries: Entries) -> Self {
        Self { entries }
    }

    /// The value.
    pub fn into_entries(mut self) -> Entries {
        self.entries.assign_places();
        self.entries
    }

    fn table(mut self, key: &str, table: &impl Keys) -> Self {
        self.entries.set(key, table.raw());
        self
    }

    fn named(mut self, group: &str, name: &str, table: &impl Keys) -> Self {
        self.entries.table_mut(group).set(name, table.raw());
        self
    }

    /// A named table whose kind is a word under a key of its own, before the keys of that kind.
    fn of_kind(mut self, group: &str, name: &str, word: (&str, &str), keys: Entries) -> Self {
        let mut table = Entries::of_texts([word]);
        keys.iter().for_each(|entry| table.set(&entry.key, entry.entry.value.clone()));
        self.entries.table_mut(group).set(name, RawValue::Table(table));
        self
    }

    fn listed(mut self, key: &str, table: &impl Keys) -> Self {
        self.entries.list_mut(key).push(Entry::from(table.raw()));
        self
    }

    /// An entry of `[parameters]`: `beta = "10 deg"`, with a tolerance if you like.
    #[must_use]
    pub fn parameter(mut self, name: &str, value: impl Into<Quantity>) -> Self {
        self.entries.table_mut("parameters").set(name, value.into().raw());
        self
    }

    /// An entry of `[variants]`: a run for each value of a parameter.
    #[must_use]
    pub fn vary(mut self, parameter: &str, values: impl Into<Quantities>) -> Self {
        self.entries.table_mut("variants").set(parameter, values.into().raw());
        self
    }

    /// An element `[keyword.NAME]`, in place of one of that kind and name.
    #[must_use]
    pub fn element<E: ElementKeys>(self, name: &str, element: E) -> Self {
        self.named(E::KEYWORD, name, &element)
    }

    /// A controller `[control.NAME]`, in place of one of that name.
    #[must_use]
    pub fn control<L: LawKeys>(self, name: &str, law: L) -> Self {
        self.control_of(name, L::KEYWORD, law.entries())
    }

    /// A controller by the keyword of its law and its keys.
    #[must_use]
    pub fn control_of(self, name: &str, law: &str, keys: Entries) -> Self {
        self.of_kind("control", name, ("law", law), keys)
    }

    /// A signal `[signal.NAME]`, in place of one of that name.
    ///
    /// ```
    /// use kardan::project::{Builder, Disturbance, Project, Scenario, Shaft, Sine};
    ///
    /// let model = Builder::new("axle")
    ///     .element("axle", Shaft::new().inertia("2 kg cm^2"))
    ///     .element("load", Disturbance::new("axle"))
    ///     .signal("wave", Sine::new("1 N m", "2 Hz"))
    ///     .scenario(Scenario::default().signals([("load", "2 * wave")]));
    /// assert_eq!(Project::build(model).diagnostics(), []);
    /// ```
    #[must_use]
    pub fn signal<S: SignalKeys>(self, name: &str, signal: S) -> Self {
        self.of_kind("signal", name, ("kind", S::KEYWORD), signal.entries())
    }

    /// A block `[block.NAME]`, in place of one of that name.
    ///
    /// ```
    /// use kardan::project::{Builder, LowPass, Project, Shaft};
    ///
    /// let model = Builder::new("axle")
    ///     .element("axle", Shaft::new().inertia("2 kg cm^2"))
    ///     .block("smooth", LowPass::new("axle.w", "5 ms"))
    ///     .set(&["block", "smooth", "sample_time"], String::from("1 ms"));
    /// assert_eq!(Project::build(model).diagnostics(), []);
    /// ```
    #[must_use]
    pub fn block<B: BlockKeys>(self, name: &str, block: B) -> Self {
        self.of_kind("block", name, ("kind", B::KEYWORD), block.entries())
    }

    /// A key of a table, by its path: `&["control", "column", "feedback"]`. Missing tables on the path are created.
    #[must_use]
    pub fn set(mut self, path: &[&str], value: impl EntryValue) -> Self {
        if let Some((key, tables)) = path.split_last() {
            let table = tables.iter().fold(&mut self.entries, |table, key| table.table_mut(key));
            table.set(key, value.raw());
        }
        self
    }

    /// The model without a table or key, by its path.
    #[must_use]
    pub fn removing(mut self, path: &[&str]) -> Self {
        if let Some((key, tables)) = path.split_last() {
            let mut table = &mut self.entries;
            for key in tables {
                if table.table(key).is_none() {
                    return self;
                }
                table = table.table_mut(key);
            }
            table.remove(key);
        }
        self
    }

    /// A step or ramp `[[scenario.event]]` after the existing ones.
    #[must_use]
    pub fn event(mut self, event: Event) -> Self {
        self.entries.table_mut("scenario").list_mut("event").push(Entry::from(event.raw()));
        self
    }

    /// Without these `signals` of `[scenario]`.
    #[must_use]
    pub fn remove_signals(self, names: &[String]) -> Self {
        names.iter().fold(self, |out, name| out.removing(&["scenario", "signals", name]))
    }

    /// Leaves only the controller of that name in the loop, without entries for the references of others.
    #[must_use]
    pub fn only_control(mut self, control: &str) -> Self {
        let control_entries = self.entries.table_mut("control");
        *control_entries = control_entries.iter().filter(|entry| entry.key == control).cloned().collect();
        self =
            self.removing(&["scenario", "event"]).removing(&["requirement"]).removing(&["figure"]).removing(&["plot"]);
        if self.entries.get("variant").is_some() {
            for variant in self.entries.list_mut("variant") {
                if let RawValue::Table(variant) = &mut variant.value {
                    variant.remove("controls");
                }
            }
        }
        self
    }
}
