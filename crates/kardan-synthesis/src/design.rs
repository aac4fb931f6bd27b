//! From the keys of a controller to a designed law.

use std::sync::Arc;

use super::at_operating_point::at_operating_point;
use super::observed;
use super::{Law, LawKind, Plant, Program, Request, SynthesisError, clock};
use kardan_schema::schema::LawKeys;
use kardan_schema::schema::Values;

/// Designs a law with the observer that its keys ask for.
///
/// # Errors
/// Why it cannot be designed.
pub fn design_law(kind: &LawKind, name: &str, values: &Values, plant: &Plant) -> Result<Arc<dyn Law>, SynthesisError> {
    if clock(values)?.is_none() && kind.samples {
        return Err(SynthesisError::sampled_only(kind.keyword));
    }
    let disturbances = observed::disturbances(values, plant)?;
    let law = (kind.design)(&Request { name, values, plant, disturbances: &disturbances })?;
    // A program reads the actual values.
    let law = if kind.keyword == Program::KEYWORD { law } else { at_operating_point(law, values, plant)? };
    match values.table("observer") {
        Some(observer) if kind.samples && observer.has("plant") => Err(SynthesisError::idle_key("plant", kind.keyword)),
        Some(_) if kind.samples => Ok(law),
        Some(observer) => Ok(Arc::new(observed::Observed::new(law, observer, plant, &disturbances)?)),
        None => Ok(law),
    }
}
