//! Warnings of margins that are too small.

use kardan_rt::functions::ln;

use super::verdict::{at, at_once, because, time};
use kardan_results::{ChannelMargin, LOW_DISK, Margins, MultiloopMargin};

/// Factor of a torque that a loop must tolerate, or its margins count as low.
pub(super) const LOW_MARGIN: f64 = 1.1;
/// The same for all motors at once: a factor of 1.22, 11°.
const MULTILOOP_DISK: f64 = 0.2;
/// Phase margin of one channel, rad, below which kardan warns: 15°.
const PHASE: f64 = std::f64::consts::PI / 12.0;
/// Disk margin above which margins do not count as low: it includes the factor 1.1, and 5.5°.
pub(super) const CLOSE: f64 = 2.0 * (LOW_MARGIN - 1.0) / (LOW_MARGIN + 1.0);
/// Fraction of its lag, or of one sample, by which a motor must be allowed to be late.
const LATE: f64 = 0.25;
/// Ratio of the disk margin of all motors at once to that of each channel below which kardan warns, if it has warned of others.
const WORSE: f64 = 0.75;

/// Important warnings about margins.
pub(in crate::study) fn warnings(found: &Margins) -> Vec<String> {
    let mut out: Vec<String> = found.channels.iter().filter_map(close).collect();
    let wrong = |one: &&ChannelMargin| close(one).is_none() && one.disk < LOW_DISK;
    out.extend(found.channels.iter().filter(wrong).map(|one| {
        format!(
            "{} tolerates errors only by factors from {:.3} to {:.3} with up to {:.1}° of phase: the disk margin is \
             {:.3}{}, and below {LOW_DISK} (a factor of 1.5, 23°) small errors of the model can make the loop \
             unstable",
            of(one),
            one.disk_gain[0],
            one.disk_gain[1],
            one.disk_phase.to_degrees(),
            one.disk,
            at(one.disk_frequency)
        )
    }));
    out.extend(found.channels.iter().filter_map(late));
    let common = found.gain_margin.as_ref().filter(|_| out.is_empty());
    if let Some([down, up]) = common.filter(|[down, up]| down.value > 1.0 / LOW_MARGIN || up.value < LOW_MARGIN) {
        let motion = if up.value < LOW_MARGIN { &up.motion } else { &down.motion };
        out.push(format!(
            "stable with low margins: it tolerates torque errors only by factors from {:.4} to {:.4}{}",
            down.value,
            up.value,
            because(motion)
        ));
    }
    // The margin of all at once never exceeds that of each alone: reported if it is much worse.
    let single_disk = found.channels.iter().map(|one| one.disk).fold(f64::INFINITY, f64::min);
    let worse =
        |all: &&MultiloopMargin| all.disk[1] < MULTILOOP_DISK && (out.is_empty() || all.disk[1] < WORSE * single_disk);
    if let Some(all) = found.multiloop.as_ref().filter(worse) {
        out.push(format!(
            "{}; below {MULTILOOP_DISK} (a factor of 1.22, 11°) small errors of the model can make the loop unstable",
            at_once(all)
        ));
    }
    out
}

/// The name of a channel.
fn of(one: &ChannelMargin) -> String {
    if one.is_sensor { format!("the reading `{}`", one.name) } else { format!("the torque of `{}`", one.name) }
}

/// Whether a channel does not tolerate factors within 10 %, together with the corresponding phase change (5.5°).
pub(super) fn low_margins(one: &ChannelMargin) -> bool {
    [one.gain, one.disk_gain].iter().any(|[low, high]| *low > 1.0 / LOW_MARGIN || *high < LOW_MARGIN)
}

/// A channel that a small factor, or a small phase change, makes unstable.
pub(super) fn close(one: &ChannelMargin) -> Option<String> {
    let ([low, high], what) = (one.gain, of(one));
    let (factor, frequency) =
        if ln(high) < -ln(low) { (high, one.gain_frequency[1]) } else { (low, one.gain_frequency[0]) };
    let prefix = if low_margins(one) { "stable with low margins: " } else { "" };
    if low == 1.0 || high == 1.0 {
        let factors = match (low == 1.0, high == 1.0) {
            (true, true) => "any factor except 1",
            (true, false) => "any factor below 1",
            _ => "any factor above 1",
        };
        return Some(format!(
            "{prefix}{factors} in {what} makes the loop unstable, as its error moves an uncontrolled rigid-body mode (a pole at zero)"
        ));
    }
    if low > 1.0 / LOW_MARGIN || high < LOW_MARGIN {
        Some(format!("{prefix}{what} times {factor:.4} makes the loop unstable{}", at(frequency)))
    } else if one.phase < PHASE {
        Some(format!(
            "{prefix}{:.1}° of phase in {what} make the loop unstable{}",
            one.phase.to_degrees(),
            at(one.phase_frequency)
        ))
    } else {
        low_margins(one).then(|| {
            format!(
                "{prefix}{what} tolerates errors only by factors from {:.4} to {:.4} with up to {:.1}° of phase{}",
                one.disk_gain[0],
                one.disk_gain[1],
                one.disk_phase.to_degrees(),
                at(one.disk_frequency)
            )
        })
    }
}

/// A motor that tolerates only a delay of a small fraction of its own time.
fn late(one: &ChannelMargin) -> Option<String> {
    let (delay, own) = (one.delay?, one.own_time?);
    (delay < LATE * own).then(|| {
        format!(
            "{} tolerates a delay of only {}{}: that is {:.1} % of {}",
            of(one),
            time(delay),
            at(one.delay_frequency),
            100.0 * delay / own,
            if one.sampled {
                format!("one sample, {}", time(own))
            } else {
                format!("the lag of its motor, {}", time(own))
            },
        )
    })
}

#[cfg(test)]
#[path = "../../../../tests/unit/study/loops/margins/warnings.rs"]
mod tests;
