//! Designs along a turn, kept with the plant that they are for.

use std::sync::{Arc, OnceLock};

use super::RegulatorData;
use crate::element::Values;

/// The points that were designed first on a plant: a law is designed anew for each run, and a schedule takes as long as all its
/// points.
#[derive(Debug, Clone, Default)]
pub(in crate::synthesis) struct Turned(OnceLock<Arc<Kept>>);

#[derive(Debug)]
struct Kept {
    values: Values,
    disturbances: Vec<usize>,
    points: Vec<RegulatorData>,
}

impl Turned {
    /// The points for what is asked, if they are those that are kept.
    pub fn of(&self, values: &Values, disturbances: &[usize]) -> Option<Vec<RegulatorData>> {
        let kept = self.0.get()?;
        (kept.values == *values && kept.disturbances == disturbances).then(|| kept.points.clone())
    }

    /// Keeps the first points that it is given.
    pub fn keep(&self, values: &Values, disturbances: &[usize], points: &[RegulatorData]) {
        let (values, disturbances) = (values.clone(), disturbances.to_vec());
        self.0.get_or_init(|| Arc::new(Kept { values, disturbances, points: points.to_vec() }));
    }
}
