//! The keys that all laws share.

/// Declares the keys of a law, as [`keys!`](kardan_schema::schema::Keys) does, and adds those that all laws have.
macro_rules! law_keys {
    (
        $(#[$meta:meta])*
        law $name:ident ($keyword:literal) { required { $($required:tt)* } optional { $($optional:tt)* } }
    ) => {
        kardan_schema::schema::keys! {
            $(#[$meta])*
            law $name($keyword) {
                required { $($required)* }
                optional {
                    $($optional)*
                    observer: Table($crate::Observer),
                        "An observer: the law then uses its sensors and its estimates instead of the true state. Left out: all \
                         angles and speeds are known.";
                    sample_time: Quantity(kardan_math::units::Dimension::TIME, kardan_schema::schema::Sign::Period),
                        "Sample time at which the controller runs, up to 1 s: it reads its sensors then, and its torques \
                         are held in between. Left out: continuous time.";
                    delay: Quantity(kardan_math::units::Dimension::TIME, kardan_schema::schema::Sign::NonNegative) = "0 s",
                        "Time from the reading of the sensors to the change of the torques: a fraction of a sample time, or several.";
                    precision: Choice(&["double", "single"]) = "double",
                        "The arithmetic in which the controller computes.";
                    blending_signal: Name,
                        "Name of a signal or a block from 0 to 1 that its commands are multiplied by: 1 applies them \
                         fully, 0 not at all; its observer knows the commands that the motors get. Needs `sample_time`. Left out: 1.";
                    design: Overrides,
                        "Parameter values of the model that the law is designed on, where they differ: \
                         { beta = \"0 deg\" }. Coulomb friction is left out of every design.";
                    excluded_elements: Names,
                        "Elements that its design leaves out, with their parts: the car behind a rack, an unknown \
                         load. Their effect is a disturbance to the law; an observer may estimate it.";
                    at: Point,
                        "Operating point, angles of reduced coordinates: { \"arm.phi\" = \"60 deg\" }: the law is \
                         designed on the linear model there, measures deviations from it, and adds the constant \
                         equilibrium torques. Coordinates that are left out take values at which the motors can \
                         balance the model. All controllers of a variant share it. A `program` reads the actual values \
                         there: its margins are those of its linearisation there, with signals at their initial \
                         values; it takes every form of `at` of `[analysis]`: \
                         { \"car.v\" = \"20 km/h\" } in steady motion, \"t = 3.2 s\" of the run. Left out: zero angles.";
                }
            }
        }
    };
}
