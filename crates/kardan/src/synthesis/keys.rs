//! The keys that every law has besides its own.

/// Declares the keys of a law, as [`keys!`](crate::schema::Keys) does, and adds those that all laws have.
macro_rules! law_keys {
    (
        $(#[$meta:meta])*
        law $name:ident ($keyword:literal) { required { $($required:tt)* } optional { $($optional:tt)* } }
    ) => {
        $crate::schema::keys! {
            $(#[$meta])*
            law $name($keyword) {
                required { $($required)* }
                optional {
                    $($optional)*
                    observer: Table($crate::synthesis::Observer),
                        "An observer: the law then sees its sensors and its estimates, not the true state. Left out: all \
                         angles and speeds are known.";
                    sample_time: Quantity($crate::units::Dimension::TIME, $crate::schema::Sign::Period),
                        "Sample time at which the controller runs, up to 1 s: it reads its sensors then, and its torques \
                         are held in between. Left out: continuous time.";
                    delay: Quantity($crate::units::Dimension::TIME, $crate::schema::Sign::NonNegative) = "0 s",
                        "From the reading of the sensors to the change of the torques, any part of a sample time or several.";
                    precision: Choice(&["double", "single"]) = "double",
                        "The arithmetic in which the controller computes.";
                    fade: Name,
                        "Name of a signal or a block from 0 to 1 that its commands are multiplied by: 1 gives them whole, 0 none; its observer knows \
                         what the motors get. Needs `sample_time`. Left out: 1.";
                    design: Overrides,
                        "Parameter values of the model that the law is designed on, where they differ: \
                         { beta = \"0 deg\" }. Coulomb friction is left out of every design.";
                    without: Names,
                        "Elements that its design leaves out, with their parts: the car behind a rack, a load that is not known. What they do \
                         is a disturbance to the law; an observer may estimate it.";
                    at: Point,
                        "Operating point, angles of reduced coordinates: { \"arm.phi\" = \"60 deg\" }: the law is designed on the linear \
                         model there, measures from there, and gives the constant torques that hold it there. Coordinates that are left \
                         out stand where the motors can hold it. It is one for all controllers of a variant. A `program` reads what is true there: its \
                         margins are those of its slopes around that, with signals as they begin; it takes all that `at` of `[analysis]` takes: \
                         { \"car.v\" = \"20 km/h\" } in steady motion, \"t = 3.2 s\" of the run. Left out: zero angles.";
                }
            }
        }
    };
}
