//! When and in which arithmetic a controller runs.

/// When and in which arithmetic a controller runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clock {
    /// Sample time T, s.
    pub period: f64,
    /// From the reading of the sensors to the change of the commands, s; constant until the next change.
    pub delay: f64,
    /// Whether the controller computes in `f32`.
    pub single: bool,
}

/// Whether a clock, if there is one, requests `f32`.
pub(super) fn is_single(clock: Option<Clock>) -> bool {
    clock.is_some_and(|clock| clock.single)
}
