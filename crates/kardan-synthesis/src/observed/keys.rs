//! Keys of an observer.

use crate::{Plant, SynthesisError};
use kardan_mechanics::equations::Domain;
use kardan_schema::schema::Values;
use kardan_schema::schema::{Sign, keys};

keys! {
    /// The observer of a controller: `[control.<name>.observer]`.
    table Observer {
        required {
            sensors: Outputs,
                "What is measured: angles, speeds, torques of torsion bars, currents of branches (`<branch>.i`, ideal); \
                 `<sensor>.phi` and so on reads the sensor of that name with its resolution, if the controller has a sample \
                 time. In continuous time they are ideal.";
        }
        optional {
            disturbances: Names,
                "Shafts and masses on which an unknown constant torque or force acts, which is estimated too; left out: all \
                 reduced coordinates that are shafts or masses and have an inertia.";
            plant: Choice(&["linear", "nonlinear"]),
                "The model that it runs: `linear`: that at the operating point (`at`, else zero angles); `nonlinear`: the full one, joints and \
                 friction fed forward by the law included. Its gain is that at the operating point either way. Left \
                 out: nonlinear where the design model of the law is, unless expressions give torques, which it would \
                 not contain.";
            method: Choice(&["poles", "kalman"]),
                "How its gain is found; left out: poles, of the law `sampled_noninteracting` kalman.";
            poles: Poles,
                "Poles of the error: as many as the longest chain of a sensor has (the same for every sensor), or one \
                 for each state of the observer. Required by the method `poles`.";
            disturbance_rate: Number(Sign::Positive) = "10", "Kalman: how fast a disturbance may drift, N m/sqrt(s).";
            speed_noise: Number(Sign::NonNegative),
                "Kalman: noise of the accelerations, rad/s/sqrt(s); a larger value makes the loop more robust to \
                 errors of the model. Left out: 0.1, of the law `sampled_noninteracting` 10.";
            sensor_noise: Number(Sign::Positive),
                "Kalman: noise of each sensor, its unit times sqrt(s); left out: 1e-5, of the law \
                 `sampled_noninteracting` what follows from the resolution.";
            compensation: Number(Sign::NonNegative) = "1",
                "Share of the estimated disturbances that the law cancels, from 0 to 1.";
        }
    }
}

/// Numbers of the shafts on which the observer of a controller estimates torques; none without an observer.
///
/// # Errors
/// If a name is no shaft or is a duplicate.
pub(crate) fn disturbances(values: &Values, plant: &Plant) -> Result<Vec<usize>, SynthesisError> {
    let Some(observer) = values.table("observer") else { return Ok(Vec::new()) };
    let moves = |k: &usize| plant.reduced.equations.domain(*k) != Domain::Charge;
    let Some(names) = observer.names("disturbances") else {
        let moving = plant.linear.moving();
        return Ok(moving.into_iter().map(|k| plant.reduced.coordinates[k]).filter(moves).collect());
    };
    let found = |name: &String| plant.reduced.coordinate(name).filter(moves);
    let shaft = |name: &String| {
        found(name).ok_or_else(|| {
            let message = format!("there is no shaft `{name}` on which a disturbance could act");
            SynthesisError::at(message, name, "no such shaft", "name shafts of the model in `disturbances`")
        })
    };
    names.iter().map(shaft).collect()
}
