//! kardan: from one model file of a drivetrain to its equations, controllers and closed-loop runs.

pub mod diagnostics;
pub mod export;
pub mod model;
pub mod report;
pub mod results;
pub mod schema;
pub mod simulate;
pub mod units;
