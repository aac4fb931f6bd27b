//! Cache of designs over a turn, stored with their plant.

use std::sync::{Arc, OnceLock};

use super::RegulatorData;
use kardan_schema::schema::Values;

/// The points that were designed first on a plant: each run designs the law again, and a schedule takes as long as all its
/// points.
#[derive(Debug, Clone, Default)]
pub(crate) struct ScheduleCache(OnceLock<Arc<Schedule>>);

#[derive(Debug)]
struct Schedule {
    values: Values,
    disturbances: Vec<usize>,
    points: Vec<RegulatorData>,
}

impl ScheduleCache {
    /// The points for this request, if the cache has them.
    pub fn of(&self, values: &Values, disturbances: &[usize]) -> Option<Vec<RegulatorData>> {
        let schedule = self.0.get()?;
        (schedule.values == *values && schedule.disturbances == disturbances).then(|| schedule.points.clone())
    }

    /// Stores the first points that it gets.
    pub fn store(&self, values: &Values, disturbances: &[usize], points: &[RegulatorData]) {
        let (values, disturbances) = (values.clone(), disturbances.to_vec());
        self.0.get_or_init(|| Arc::new(Schedule { values, disturbances, points: points.to_vec() }));
    }
}
