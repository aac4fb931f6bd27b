//! An identification as one JSON object.

use serde_json::{Value, json as object};

use crate::results::{ChannelRead, Found, FoundDamping, Identification, LogRead, NamedMatrix};

/// Gives an identification as one JSON object on one line, in SI; a number that is not finite is `null`.
///
/// | key | what it is |
/// |---|---|
/// | `model`, `description` | the model |
/// | `verdict`, `sound` | what came of it in one sentence; whether every parameter is determined from whole logs without a warning |
/// | `method`, `window_s`, `loss`, `confidence` | how it was found |
/// | `coordinates`, `measured`, `eliminated` | names: coordinates, inputs whose torque was measured, and those whose torque was eliminated |
/// | `logs` | `name`, `rows`, `begin_s`, `end_s`, `remarks`, `damage` and `clock` (`null`, or how much of a damaged log is used and why its clock is in doubt), `channels` (`name`, `unit`, `signal`, `si`, `sample_time_s`, `noise`, `noise_stated`) |
/// | `windows` | `all`, `incomplete`, `resting`, `moving`, `used` |
/// | `samples`, `outliers`, `freedom`, `scale`, `condition`, `lags` | rows of the fit, outliers, degrees of freedom, residual over the noise of the sensors, condition, lags of Newey and West |
/// | `parameters` | `name`, `unit`, `before`, `value`, `standard_error`, `interval`, `combination`, `remark`, `published` |
/// | `not_determined` | `by_structure`, `by_data`: sentences |
/// | `correlation` | `names`, `values` |
/// | `damping` | the reduced damping matrix: `coordinates`, `values`, `passive`; `null` where none was asked for |
/// | `tests` | `what`, `probability`, `meaning` |
/// | `validation` | `row`, `torque_rms_N_m`, `residual_seen_N_m`, `residual_unseen_N_m` |
/// | `candidates` | `name`, `parameters`, `error`, `error_spread`, `chosen`, `failure` |
/// | `warnings`, `notes` | sentences |
/// | `complete`, `unfinished` | whether nothing ended early; else why it did and what is missing (such parts are empty), `null` if nothing is |
pub fn identification_json(found: &Identification) -> String {
    value(found).to_string()
}

pub(super) fn value(found: &Identification) -> Value {
    let verdict = found.verdict();
    object!({
        "model": found.model,
        "description": found.description,
        "verdict": verdict.text,
        "sound": verdict.sound,
        "method": found.method,
        "window_s": found.window,
        "loss": found.loss,
        "confidence": found.confidence,
        "coordinates": found.coordinates,
        "measured": found.measured,
        "eliminated": found.eliminated,
        "logs": found.logs.iter().map(log).collect::<Vec<_>>(),
        "windows": {
            "all": found.windows.all,
            "incomplete": found.windows.incomplete,
            "resting": found.windows.resting,
            "moving": found.windows.moving,
            "used": found.windows.used,
        },
        "samples": found.samples,
        "outliers": found.outliers,
        "freedom": found.freedom,
        "scale": found.scale,
        "condition": found.condition,
        "lags": found.lags,
        "parameters": found.parameters.iter().map(parameter).collect::<Vec<_>>(),
        "not_determined": { "by_structure": found.structural, "by_data": found.weak },
        "correlation": { "names": found.correlation.rows, "values": found.correlation.values },
        "damping": found.damping.as_ref().map(|FoundDamping { matrix, passive }| damping(matrix, *passive)),
        "tests": found.tests.iter().map(|test| object!({
            "what": test.what, "probability": test.probability, "meaning": test.meaning,
        })).collect::<Vec<_>>(),
        "validation": found.validation.iter().map(|one| object!({
            "row": one.row,
            "torque_rms_N_m": one.torque,
            "residual_seen_N_m": one.seen,
            "residual_unseen_N_m": one.unseen,
        })).collect::<Vec<_>>(),
        "candidates": found.candidates.iter().map(|one| object!({
            "name": one.name,
            "parameters": one.parameters,
            "error": one.error.map(|error| error.mean),
            "error_spread": one.error.map(|error| error.spread),
            "chosen": one.chosen,
            "failure": one.failure,
        })).collect::<Vec<_>>(),
        "warnings": found.warnings,
        "notes": found.notes,
        "complete": found.unfinished.is_none(),
        "unfinished": found.unfinished,
    })
}

fn log(log: &LogRead) -> Value {
    object!({
        "name": log.name,
        "rows": log.rows,
        "begin_s": log.span.map(|span| span.from),
        "end_s": log.span.map(|span| span.until),
        "remarks": log.remarks,
        "damage": log.damage,
        "clock": log.clock,
        "channels": log.channels.iter().map(channel).collect::<Vec<_>>(),
    })
}

fn channel(one: &ChannelRead) -> Value {
    object!({
        "name": one.name,
        "unit": one.unit,
        "signal": one.signal,
        "si": one.si,
        "sample_time_s": one.sample_time,
        "noise": one.noise,
        "noise_stated": one.stated,
    })
}

fn parameter(one: &Found) -> Value {
    let interval = one.interval.map(|it| [it.lower, it.upper]);
    object!({
        "name": one.name,
        "unit": one.unit,
        "before": one.before,
        "value": one.value,
        "standard_error": one.standard_error,
        "interval": interval,
        "combination": one.combination,
        "remark": one.remark,
        "published": one.published,
    })
}

fn damping(matrix: &NamedMatrix, passive: bool) -> Value {
    object!({ "coordinates": matrix.rows, "values": matrix.values, "passive": passive })
}
