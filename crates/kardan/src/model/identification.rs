//! The tables of a model file that say what measured logs hold and what is to be found in them.

use crate::schema::{Field, Kind, Sign};
use crate::units::Dimension;

/// Keys of `[log.<name>]`.
pub const LOG: &[Field] = &[
    Field::optional(
        "file",
        Kind::Text,
        "Which of the files given it describes: a name, `*` and `?` stand for anything. Left out: all. Several tables of \
         files that were recorded together are joined by time.",
    ),
    Field::optional(
        "time",
        Kind::Text,
        "The column of the time; left out: the one the file marks, or the one called time or t.",
    ),
    Field::optional("time_unit", Kind::Text, "Unit of the time; left out: that of the file, else s."),
    Field::optional(
        "time_offset",
        Kind::Quantity(Dimension::TIME, Sign::Any),
        "What is added to the time, where clocks differ; left out: nothing.",
    ),
    Field::optional(
        "sample_time",
        Kind::Quantity(Dimension::TIME, Sign::Positive),
        "Time between rows of a file without a time.",
    ),
    Field::optional("delimiter", Kind::Text, "What stands between the cells of a text file; left out: found out."),
    Field::optional(
        "decimal",
        Kind::Choice(&["point", "comma"]),
        "The decimal sign of a text file; left out: found out.",
    ),
    Field::optional("names_row", Kind::Number(Sign::Positive), "Row of a text file with names; left out: found out."),
    Field::optional("units_row", Kind::Number(Sign::Positive), "Row of a text file with units; left out: found out."),
    Field::optional(
        "first_row",
        Kind::Number(Sign::Positive),
        "Row of a text file in which the numbers begin; left out: found out.",
    ),
    Field::optional(
        "channel",
        Kind::Tables(CHANNEL),
        "Which column is which signal: `[[log.NAME.channel]]`. Columns that are called like a signal, `wg.phi`, need none.",
    ),
];

/// Keys of `[[log.<name>.channel]]`.
pub const CHANNEL: &[Field] = &[
    Field::required(
        "signal",
        Kind::Text,
        "What was measured: `<shaft>.phi`, `<shaft>.w`, `<motor>.tau`, `<disturbance>.tau`, or a sensor of an angle or speed.",
    ),
    Field::optional("column", Kind::Text, "The column, or the channel of a binary file, by its name."),
    Field::optional("number", Kind::Number(Sign::Positive), "The column by its number, from 1 on, instead."),
    Field::optional("unit", Kind::Text, "Its unit; left out: that of the file, else the SI unit of the signal."),
    Field::optional(
        "factor",
        Kind::Number(Sign::NonZero),
        "What readings are multiplied by, as -1 where the sense differs; left out: 1.",
    ),
    Field::optional(
        "scale",
        Kind::AnyQuantity,
        "What one unit of a reading is, as \"200 N m\" for one volt, instead of a unit: for readings that are no such quantity.",
    ),
    Field::optional(
        "zero_samples",
        Kind::Number(Sign::Positive),
        "So many first samples are taken as zero: their mean is subtracted; left out: nothing is.",
    ),
    Field::optional("noise", Kind::AnyQuantity, "Standard deviation of a sample; left out: as seen in the log."),
];

/// Keys of `[identification]`.
pub const IDENTIFICATION: &[Field] = &[
    Field::optional(
        "parameters",
        Kind::Signals,
        "What is to be found: `<element>.<key>` with the keys inertia, damping, stiffness, friction, or parameters that stand \
         for one; left out: every damping and friction of the model, in dynamic tests inertias and stiffnesses too.",
    ),
    Field::optional(
        "method",
        Kind::Choice(&["steady", "dynamic"]),
        "`steady`: segments of constant speed; `dynamic`: everything, with filtered derivatives. Left out: steady if neither \
         inertias nor stiffnesses are asked for and the logs have such segments.",
    ),
    Field::optional(
        "window",
        Kind::Quantity(Dimension::TIME, Sign::Positive),
        "Width of the windows in which samples are smoothed; left out: 50 samples of the slowest channel.",
    ),
    Field::optional(
        "rest_speed",
        Kind::Quantity(Dimension::ANGULAR_VELOCITY, Sign::Positive),
        "Speed below which nobody knows the sign of a friction; left out: a hundredth of its largest, or what noise hides.",
    ),
    Field::optional(
        "steady_tolerance",
        Kind::Number(Sign::Positive),
        "Change of a speed in a steady segment, as a part of its largest; left out: 0.02.",
    ),
    Field::optional(
        "shortest_segment",
        Kind::Quantity(Dimension::TIME, Sign::Positive),
        "Shortest steady segment; left out: four windows.",
    ),
    Field::optional(
        "absent",
        Kind::Elements(&["motor", "disturbance"]),
        "Inputs that did nothing while it was logged; of others without a channel the torque is eliminated.",
    ),
    Field::optional(
        "nonnegative",
        Kind::Signals,
        "Parameters that may not be below zero; left out: none, as an equivalent damping may be.",
    ),
    Field::optional(
        "loss",
        Kind::Choice(&["squares", "huber", "bisquare"]),
        "How residuals count: the two others let outliers count less, or not at all. Left out: squares.",
    ),
    Field::optional(
        "confidence",
        Kind::Number(Sign::Positive),
        "Confidence of the intervals, below 1; left out: 0.95.",
    ),
    Field::optional(
        "extra",
        Kind::Tables(EXTRA),
        "Terms beyond those of the model: `[[identification.extra]]`. They are fitted where `parameters` names theirs, or is left \
         out; candidates choose among them.",
    ),
    Field::optional(
        "candidate",
        Kind::Tables(CANDIDATE),
        "Models that `--compare` compares: `[[identification.candidate]]`.",
    ),
    Field::optional(
        "published",
        Kind::Overrides,
        "Values from elsewhere that the report states beside: { \"fs.damping\" = \"0.02 N m s/rad\" }.",
    ),
    Field::optional("source", Kind::Text, "Where the published values are from."),
];

/// Keys of `[[identification.extra]]`.
pub const EXTRA: &[Field] = &[
    Field::required(
        "kind",
        Kind::Choice(&["stribeck", "load"]),
        "`stribeck`: more friction at low speed, the parameters `<element>.stribeck` and `<element>.stribeck_speed`; `load`: a \
         loss in proportion to a torque, as in a strain-wave gear, the parameter `<element>.load_loss`.",
    ),
    Field::required("friction", Kind::Element(&["shaft", "spring_damper"]), "The element whose friction it adds to."),
    Field::optional(
        "shape",
        Kind::Choice(&["gaussian", "exponential", "peak"]),
        "Of Stribeck friction over x, the speed by the Stribeck speed: exp(-x^2), exp(-x), or x exp(1 - x). Left out: gaussian.",
    ),
    Field::optional(
        "speed",
        Kind::Quantity(Dimension::ANGULAR_VELOCITY, Sign::Positive),
        "The Stribeck speed, if it is known; left out: it is found too.",
    ),
    Field::optional("torque", Kind::Element(&["motor", "disturbance"]), "The input whose torque loads the gear."),
];

/// Keys of `[[identification.candidate]]`.
pub const CANDIDATE: &[Field] = &[
    Field::required("name", Kind::Name, "Its name."),
    Field::optional("parameters", Kind::Signals, "Its parameters; left out: those of `[identification]`."),
    Field::optional(
        "extras",
        Kind::Words,
        "Its extra terms, by their parameters: `fs.stribeck`, `wg.load_loss`; left out: none.",
    ),
];
