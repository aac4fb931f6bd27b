//! The tables of an analysis: inputs, outputs, operating point, and candidate locations of motors and sensors.

use kardan_math::units::Dimension;
use kardan_schema::schema::{Sign, keys};

use super::HOLDING;

keys! {
    /// `[analysis]`.
    table Analysis {
        optional {
            inputs: Elements(&["motor", "disturbance"]), "Inputs to analyse; left out: all motors.";
            outputs: Signals,
                "Outputs to analyse: `<shaft>.phi`, `<shaft>.w` or the name of a sensor; left out: all sensors, else \
                 the outputs that the laws control, else the angles of all coordinates.";
            at: Point,
                "Operating point. Angles of reduced coordinates, { \"rk.phi\" = \"30 deg\" }: at rest there. With \
                 speeds of any shafts or masses, { \"car.v\" = \"20 km/h\" }: in steady motion; kardan computes what \
                 is not given (twists of springs, other speeds, torques of motors) so that nothing accelerates; \
                 sliding friction counts, engaged locks are locked, load-dependent losses are left out. `<motor>.tau` \
                 gives a torque, `t` the time at which functions of time are evaluated. Where all positions and \
                 speeds are given it need not be an equilibrium: kardan reports what accelerates. `\"t = 3.2 s\"` \
                 alone is the state of the run at that time. Left out: the initial position of the scenario, or an \
                 equilibrium near it.";
            stuck: Elements(HOLDING),
                "Elements whose Coulomb friction sticks, hence constrains, or whose clutch, lock or stop is closed; left out: all slide and are open.";
            horizon: Quantity(Dimension::TIME, Sign::Positive) = "1 s", "Time over which the Gramians are taken.";
            motion: Overrides,
                "Angles and speeds of reduced coordinates to reach from rest: { \"rk.phi\" = \"10 deg\" }. Motor locations are then compared by the energy that this needs; left out: by their Gramians.";
            threshold: Number(Sign::Positive),
                "Gramian eigenvalue below which a sample of the parameters counts as lost; left out: a tenth of that \
                 of the nominal values.";
            samples: Number(Sign::Positive),
                "Samples of the parameters within their tolerances, a whole number up to a million; left out: 1000, \
                 or fewer for a large model.";
            actuator: Tables(ActuatorSite), "Candidate locations of motors: `[[analysis.actuator]]`.";
            sensor: Tables(SensorSite), "Candidate locations of sensors: `[[analysis.sensor]]`.";
        }
    }
}

keys! {
    /// `[[analysis.actuator]]`.
    table ActuatorSite {
        required {
            shaft: Body, "The shaft or mass that the torque or force would act on.";
        }
        optional {
            cost: Number(Sign::NonNegative) = "1", "Cost of this location.";
        }
    }
}

keys! {
    /// `[[analysis.sensor]]`.
    table SensorSite {
        required {
            shaft: Body, "The shaft or mass that would be measured.";
        }
        optional {
            measures: Choice(&["angle", "speed"]) = "angle", "What would be measured.";
            cost: Number(Sign::NonNegative) = "1", "Cost of this location.";
        }
    }
}
