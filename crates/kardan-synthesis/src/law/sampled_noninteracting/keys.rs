//! The keys of the law and of its channels.

use kardan_math::units::Dimension;
use kardan_schema::schema::{Sign, keys};

keys! {
    /// A channel of the law `sampled_noninteracting`.
    table SampledNoninteractingChannel {
        required {
            output: Output,
                "The output: the angle of a shaft, `<shaft>.phi`, its speed, `<shaft>.w`, or a sensor of a torque.";
            input: Element(&["motor"]), "The motor of this channel; any pairing gives the same law.";
            reference: Name, "Name of the reference signal, set by the scenario.";
        }
        optional {
            kind: Choice(&["position", "torque"]) = "position",
                "Of an angle: `position`: it follows a reference; `torque`: the reference is a torque that acts along \
                 it, in addition to external torques there, as if the shaft carried only its effective inertia. A speed, \
                 and a sensor of a torque, follow a reference.";
            bandwidth: Quantity(Dimension::ANGULAR_VELOCITY, Sign::Positive) = "30 rad/s",
                "Corner of the reference model, critically damped of second order.";
            acceptable_angle: Quantity(Dimension::ANGLE, Sign::Positive) = "0.01 rad",
                "Acceptable error of an angle; changes of torques are weighed against it.";
            acceptable_speed: Quantity(Dimension::ANGULAR_VELOCITY, Sign::Positive) = "0.3 rad/s",
                "Acceptable error of a speed.";
            acceptable_torque: Quantity(Dimension::TORQUE, Sign::Positive) = "0.02 N m",
                "Acceptable error of a torque.";
            torque_rate: Quantity(Dimension::TORQUE_RATE, Sign::Positive),
                "Acceptable rate of the motor's torque; left out: 80 times its torque limit in a second, 100 \
                 N m/s for a motor without a limit.";
            coasting_time: Quantity(Dimension::TIME, Sign::Positive) = "1 s",
                "Time constant with which a shaft under a torque channel comes to rest if nothing drives it. Its own \
                 damping is compensated up to that; errors of the model must not overcompensate it.";
        }
    }
}

law_keys! {
    /// Noninteracting control that is designed for its sample time, the delay and the motors: what is left of a decoupling is
    /// minimised, instead of the plant inverted.
    law SampledNoninteracting("sampled_noninteracting") {
        required {
            channels: Tables(SampledNoninteractingChannel), "One table for each output and its motor.";
        }
        optional {
            effort: Number(Sign::Positive) = "1",
                "Factor of all acceptable rates of torques: a larger one reduces the interaction and demands more of \
                 motors and model.";
            governor: Choice(&["on", "off"]),
                "Whether the law limits references that would drive a motor over its torque limit; left out: on.";
            schedule: Number(Sign::Positive),
                "Number of positions over half a turn of the joints at which the law is designed, from 1 to 256; it \
                 follows their position. 1: it is designed straight ahead only. Left out: 16 where a joint is bent, if \
                 its joints turn with one coordinate and no spring acts through them.";
        }
    }
}
