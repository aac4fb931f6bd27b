//! kardan: from one model file of a drivetrain to its equations, controllers and closed-loop runs.

pub mod analysis;
pub mod assemble;
pub mod diagnostics;
pub mod element;
pub mod entries;
pub mod equations;
pub mod export;
pub mod file;
pub mod identify;
pub mod model;
pub mod names;
pub mod num;
pub mod project;
pub mod reduce;
pub mod results;
pub mod schema;
pub mod simulate;
pub mod study;
pub mod synthesis;
pub mod units;

pub use kardan_tables as tables;
