//! kardan: from one model of a drivetrain to its equations, certified structure, controllers and closed-loop runs.
//!
//! Begin with [`project`]: a model is opened from a file or built with a typed struct for each of its tables, and provides everything
//! else.
//!
//! ```
//! use kardan::project::*;
//! use kardan::study::{AnalyzeSettings, Settings, Silent};
//!
//! let project = Project::build(
//!     Builder::new("axle")
//!         .element("axle", Shaft::new().inertia("2 kg cm^2").damping("1e-3 N m s/rad").friction("0.01 N m"))
//!         .element("motor", Motor::new("axle").torque_limit("1 N m"))
//!         .scenario(Scenario::new().duration("0.5 s"))
//!         .event(Event::new("0.1 s", "motor.tau", "0.05 N m"))
//!         .requirement(Requirement::on("axle.w", Measure::Max).below("50 rad/s")),
//! );
//! assert!(project.diagnostics().is_empty());
//! let study = project.run(&Settings::default(), &Silent).unwrap();
//! assert!(study.runs[0].requirements[0].passed);
//! let analysis = project.analyze(&AnalyzeSettings::default(), &Silent).unwrap();
//! assert_eq!(analysis.structure.min_inputs, 1);
//!
//! // The loop by hand: see `examples/steering.rs` for the steering system.
//! let mut axle = project.simulation(None).unwrap();
//! let speed = axle.signal("axle.w")?;
//! axle.advance(0.2)?;
//! assert!(axle.get(speed) > 0.0);
//! # Ok::<(), kardan::simulate::SimulationError>(())
//! ```
//!
//! | module | contents |
//! |---|---|
//! | [`project`] | a model: open, build, change, write |
//! | [`study`] | runs, analyses, designs, identifications, virtual benches |
//! | [`simulate`] | the loop stepped from outside: [`simulate::Simulation`] |
//! | [`results`] | the results, with names and units; [`export`]: as JSON and tables |
//! | [`element`], [`synthesis`], [`analysis`] | the elements, the control laws, exact structure, for further use |
//! | [`diagnostics`], [`schema`], [`entries`], [`units`] | errors with their places, keys, source entries, exact quantities |
//! | [`tables`] | logs as streams, tables as bytes |
//!
//! The other modules are implementation. They are not listed here, may change with any version, and are public for the tests.
#![deny(clippy::disallowed_methods)]

pub mod export;
pub mod project;
pub mod study;

#[doc(inline)]
pub use kardan_analysis as analysis;
#[doc(inline)]
pub use kardan_elements::element;
#[doc(inline)]
pub use kardan_math::units;
#[doc(inline)]
pub use kardan_results as results;
#[doc(inline)]
pub use kardan_schema::diagnostics;
#[doc(inline)]
pub use kardan_schema::entries;
#[doc(inline)]
pub use kardan_schema::schema;
#[doc(inline)]
pub use kardan_simulate as simulate;
#[doc(inline)]
pub use kardan_synthesis as synthesis;
pub use kardan_tables as tables;

#[doc(hidden)]
pub use kardan_elements::block;
#[doc(hidden)]
pub use kardan_elements::manoeuvre;
#[doc(hidden)]
pub use kardan_elements::signal;
#[doc(hidden)]
pub use kardan_expr::expr;
#[doc(hidden)]
pub use kardan_expr::plan;
#[doc(hidden)]
pub use kardan_identify as identify;
#[doc(hidden)]
pub use kardan_math::names;
#[doc(hidden)]
pub use kardan_math::num;
#[doc(hidden)]
pub use kardan_mechanics::assemble;
#[doc(hidden)]
pub use kardan_mechanics::equations;
#[doc(hidden)]
pub use kardan_mechanics::program;
#[doc(hidden)]
pub use kardan_mechanics::reduce;
#[doc(hidden)]
pub use kardan_mechanics::symbolic;
#[doc(hidden)]
pub use kardan_model as model;
#[doc(hidden)]
pub use kardan_schema::file;
