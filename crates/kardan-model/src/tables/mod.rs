//! The tables of a model beside its elements and laws: header, scenario, requirements, plots, analysis, bench, logs.

mod analysis;
mod bench;
mod identification;
mod requirements;
mod scenario;
mod sweep;

pub use analysis::*;
pub use bench::*;
pub use identification::*;
pub use requirements::*;
pub use scenario::*;
pub use sweep::*;

use kardan_schema::schema::keys;

/// The elements that can stick or lock, by Coulomb friction or otherwise; a test checks that they equal the registry.
pub(super) const HOLDING: &[&str] = &[
    "shaft",
    "mass",
    "harmonic_drive",
    "gear",
    "rack_and_pinion",
    "screw",
    "pulley",
    "spring_damper",
    "universal_joint",
    "clutch",
    "brake",
    "one_way_clutch",
    "lock",
    "end_stop",
];

keys! {
    /// `[model]`.
    table Header {
        optional {
            name: Text = "model", "Name of the model.";
            description: Text, "A sentence for the report.";
            coordinates: Shafts(0),
                "Shafts (in a circuit: charges) to use as reduced coordinates; left out: chosen so that the equations \
                 stay well scaled.";
        }
    }
}

keys! {
    /// `[table.NAME]`.
    table LookupTable {
        optional {
            points: Lists,
                "The points of a curve: `{ x = [\"0 rad/s\", \"100 rad/s\"], value = [\"5 N m\", \"1 N m\"] }`, or of a surface: \
                 `x`, `y`, and in `value` those for all x at the first y, then at the second, and so on; left out: those of a file.";
            file: Text,
                "A log with the points (CSV, Parquet, MAT or MDF 4), by its path from the folder of the model file; a surface has a \
                 row for each point of its grid, in any order.";
            columns: Names,
                "The columns of x (and y) and of the value: [\"speed\", \"torque\"]; left out: those of the file, if there are two or three.";
            units: Names, "Units of these columns: [\"rpm\", \"N m\"]; left out: those of the file.";
            interpolation: Choice(&["linear", "cubic"]) = "linear",
                "Between two points along x: a straight line, or a cubic that is as monotone as the points are (Steffen, Astron. \
                 Astrophys. 239, 1990). Along y always a straight line.";
            extrapolation: Choice(&["hold", "linear"]) = "hold",
                "Beyond the first and the last point: constant at the value there, or a straight line with the slope there.";
        }
    }
}
