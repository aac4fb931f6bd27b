//! Margins of each motor and reading of a loop alone, and of all motors at once.

use kardan_rt::functions::{atan2, hypot};
use rayon::prelude::*;

use crate::study::PreparedVariant;
use kardan_analysis::OutputSignal;
use kardan_math::num::Rational;
use kardan_results::{ChannelMargin, MultiloopMargin, WrongTorque};
use kardan_synthesis::margins::{Response, channel_margins, multiloop_margin as all_at_once, within_disk};
use kardan_synthesis::{ControlLoop, Law, Limit, Plant, Readings, Survey};

/// The margins of one channel of a response, a motor or a reading.
fn of_channel(response: &Response, (number, name): (usize, &String), is_sensor: bool) -> Option<ChannelMargin> {
    Some(ChannelMargin { name: name.clone(), is_sensor, ..channel_margins(&response.channel(number))? })
}

/// The margins of each motor; with `late` the tolerated delay of a sampled loop is searched too.
pub(super) fn of_motors(survey: &Survey<'_>, response: Option<&Response>, late: bool) -> Vec<ChannelMargin> {
    let clock = survey.clocks[survey.number];
    let law = &survey.laws[survey.number];
    let lag = |name: &String| {
        let input = survey.plant.inputs.iter().position(|input| input == name)?;
        Some(survey.plant.lags[input]).filter(|lag| *lag > 0.0)
    };
    let one = |(motor, name): (usize, &String)| {
        let mut out = match response {
            Some(response) => of_channel(response, (motor, name), false)?,
            None => searched(survey, motor, name)?,
        };
        out.sampled = clock.is_some();
        out.own_time = clock.map_or_else(|| lag(name), |clock| Some(clock.period));
        if clock.is_some() && late {
            let limit = survey.motor_delay(motor);
            out.delay = limit.map(|limit| limit.value);
            out.delay_frequency = limit.filter(|limit| limit.value.is_finite()).map(|limit| limit.frequency);
        }
        Some(out)
    };
    law.inputs().par_iter().enumerate().filter_map(one).collect()
}

/// The margins of each motor, from the response of a stable loop; of a sampled one without the delay. `None` if
/// it cannot be computed.
pub(in crate::study) fn motor_margins(view: &ControlLoop<'_>, motors: &[String]) -> Option<Vec<ChannelMargin>> {
    let response = view.motors()?;
    let sampled = response.nyquist().is_some();
    let one = |motor: (usize, &String)| Some(ChannelMargin { sampled, ..of_channel(&response, motor, false)? });
    motors.iter().enumerate().map(one).collect()
}

/// The margins of a motor of a sampled controller in a loop with several clocks, searched on the map over their common period.
fn searched(survey: &Survey<'_>, motor: usize, name: &str) -> Option<ChannelMargin> {
    let lifted = survey.lifted(motor)?;
    let [down, up] = survey.gain_margin(Some(motor))?;
    let limited = |limit: &Limit| (limit.value > 0.0 && limit.value.is_finite()).then_some(limit.frequency);
    let disk = lifted.disk();
    let (disk_gain, disk_phase) = within_disk(disk);
    Some(ChannelMargin {
        name: name.into(),
        gain: [down.value, up.value],
        gain_frequency: [limited(&down), limited(&up)],
        phase: lifted.phase(),
        disk,
        disk_gain,
        disk_phase,
        multirate_search: true,
        ..ChannelMargin::default()
    })
}

/// Each sensor of a law with its row over `[q_r; q̇_r]`.
pub(super) fn sensor_rows(model: &Plant, law: &dyn Law) -> Vec<(String, Vec<Rational>)> {
    law.sensors().iter().map(|signal| (signal.name.clone(), row_of(model, law, signal))).collect()
}

/// The row of a signal over `[q_r; q̇_r]`.
pub(super) fn row_of(model: &Plant, law: &dyn Law, signal: &OutputSignal) -> Vec<Rational> {
    let found = model.system(law.inputs(), std::slice::from_ref(signal));
    found.c.row(0).to_vec()
}

/// The margins of each channel alone, and of all motors at once.
pub(super) fn errors(variant: &PreparedVariant, survey: &Survey<'_>) -> (Vec<ChannelMargin>, Option<MultiloopMargin>) {
    let (law, number) = (&survey.laws[survey.number], survey.number);
    let of_readings = || {
        let (parts, plant) = survey.parts()?;
        let model = &*variant.whole_model(number);
        let sensors = sensor_rows(model, &**law);
        let Readings { names, loops, .. } =
            ControlLoop { plant: &plant, parts: &parts, number }.readings(&sensors, &model.motion_names())?;
        let of = |reading: (usize, &String)| of_channel(&loops, reading, true);
        Some(names.par_iter().enumerate().filter_map(of).collect::<Vec<_>>())
    };
    let of_motors = || {
        let motors = survey.motors();
        let multiloop = motors.as_ref().and_then(|motors| named_multiloop(motors, law.inputs()));
        (of_motors(survey, motors.as_ref(), true), multiloop)
    };
    let ((mut out, multiloop), readings) = rayon::join(of_motors, of_readings);
    out.extend(readings.into_iter().flatten());
    (out, multiloop)
}

/// The margin of all channels of a response at once, with their names; `None` for one channel alone, or if an iteration fails.
pub(super) fn named_multiloop(response: &Response, names: &[String]) -> Option<MultiloopMargin> {
    if response.channels() < 2 {
        return None;
    }
    let found = all_at_once(response)?;
    let wrong = |(name, (re, im)): (&String, &(f64, f64))| WrongTorque {
        motor: name.clone(),
        factor: hypot(*re, *im),
        phase: atan2(*im, *re),
    };
    let worst = names.iter().zip(&found.worst).map(wrong).collect();
    Some(MultiloopMargin { disk: found.disk, frequency: found.frequency, worst_perturbation: worst })
}
