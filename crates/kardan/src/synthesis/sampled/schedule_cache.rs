//! Designs along a turn, kept with the plant that they are for.

use std::sync::{Arc, OnceLock};

use super::RegulatorData;
use crate::element::Values;

/// The points that were designed first on a plant: a law is designed anew for each run, and a schedule takes as long as all its
/// points.
#[derive(Debug, Clone, Default)]
pub(in crate::synthesis) struct ScheduleCache(OnceLock<Arc<Schedule>>);

#[derive(Debug)]
struct Schedule {
    values: Values,
    disturbances: Vec<usize>,
    points: Vec<RegulatorData>,
}

impl ScheduleCache {
    /// The points for what is asked, if they are those that are kept.
    pub fn of(&self, values: &Values, disturbances: &[usize]) -> Option<Vec<RegulatorData>> {
        let schedule = self.0.get()?;
        (schedule.values == *values && schedule.disturbances == disturbances).then(|| schedule.points.clone())
    }

    /// Keeps the first points that it is given.
    pub fn store(&self, values: &Values, disturbances: &[usize], points: &[RegulatorData]) {
        let (values, disturbances) = (values.clone(), disturbances.to_vec());
        self.0.get_or_init(|| Arc::new(Schedule { values, disturbances, points: points.to_vec() }));
    }
}
