//! Keys and choices that had another name, for hints.

/// Former and present names. A former name may still be the name of a key in another table.
const FORMER_NAMES: &[(&str, &str)] = &[
    ("absent", "inactive_inputs"),
    ("against", "baseline"),
    ("bend_gain", "curvature_gain"),
    ("beyond", "extrapolation"),
    ("brakes", "braking_signal"),
    ("by", "value"),
    ("clear", "min_deflection"),
    ("corrects", "closed_loop"),
    ("course", "steering_angle"),
    ("display", "display_unit"),
    ("fade", "blending_signal"),
    ("hold", "grip"),
    ("largest", "max_acceptable"),
    ("measures", "evaluate"),
    ("refuse", "error"),
    ("sense", "friction_asymmetry"),
    ("sense_damping", "damping_asymmetry"),
    ("shows", "kind"),
    ("slows", "speed_reduction_signal"),
    ("steers", "steered_by"),
    ("steers", "steering_signal"),
    ("straight", "linear"),
    ("teeth", "gear"),
    ("teeth", "gear_loss"),
    ("together", "correlated"),
    ("within", "detection_time_limit"),
    ("without", "excluded_elements"),
];

/// The present name of a key or choice that had another one, if it is among those of the table.
pub fn present_name<'a>(name: &str, candidates: &[&'a str]) -> Option<&'a str> {
    candidates.iter().copied().find(|candidate| FORMER_NAMES.contains(&(name, *candidate)))
}
