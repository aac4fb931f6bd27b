//! Extended disturbance observers.
pub fn kalman() {}
