//! Extended disturbance observers \[diss. (6.41)-(6.46)\] for any model and sensor set.
