//! Quantities with units, kept exactly: `"130 kg mm^2"`, `"2 N m/deg"`, `"30 deg"`.
