//! Margins of one channel of a loop.

use std::f64::consts::TAU;

use kardan_rt::functions::{atan, atan2};

use super::Response;
use super::channel_quotient::OneChannel;
use kardan_results::ChannelMargin;

/// A factor that is zero but for rounding, where an open channel leaves a motion at zero: `1 + 1/M` at M = −1.
const NOTHING: f64 = 1e-9;

/// The range of gains that a balanced disk α guarantees, below one and above: `(2 − α)/(2 + α)` and its inverse, from 2 on 0 and infinity; and the phase
/// changes, rad: `2 atan(α/2)`, half a turn from 2 on.
pub fn within_disk(disk: f64) -> ([f64; 2], f64) {
    let gain = match disk >= 2.0 {
        true => [0.0, f64::INFINITY],
        false => [(2.0 - disk) / (2.0 + disk), (2.0 + disk) / (2.0 - disk)],
    };
    (gain, 2.0 * atan(0.5 * disk))
}

/// Gain, phase, delay and disk margins of one channel of a stable loop.
///
/// Gain margins where M is real, phase margins where |S| = |T|, that is Re M = −½; the disk from the peak of (S − T)/2 (Seiler, Packard, Gahinet 2020). Up
/// to 32 states they are roots of polynomials with exact coefficients, for more a search between frequencies next to all poles. An uncontrolled rigid-body mode
/// that the channel measures moves with every error of it: the channel has no margin on that side. `None` if an iteration fails.
///
/// ```
/// use kardan_math::num::Matrix;
/// use kardan_synthesis::margins::{Response, channel_margins};
/// // An integrator under u = −3 x: a turn of a quarter, at 3 rad/s, and the disk of a loop without limits.
/// let one = |x: f64| Matrix::from_fn(1, 1, |_, _| x);
/// let found = channel_margins(&Response::continuous(&one(-3.0), &one(1.0), &one(-3.0)).unwrap()).unwrap();
/// assert!((found.phase - std::f64::consts::FRAC_PI_2).abs() < 1e-12 && (found.phase_frequency.unwrap() - 3.0).abs() < 1e-9);
/// assert_eq!(found.gain, [0.0, f64::INFINITY]);
/// assert!((found.disk - 2.0).abs() < 1e-9);
/// ```
///
/// # Panics
/// If it has not just one channel.
pub fn channel_margins(channel: &Response) -> Option<ChannelMargin> {
    assert_eq!(channel.channels(), 1, "margins of one channel");
    let one = channel.channel_quotient();
    let (peak, place) = match &one {
        Some(one) => {
            let balanced = channel.balanced();
            one.balanced().peak(&channel.first_places(), &|place| balanced.size(place))
        }
        None => channel.balanced().peak(),
    };
    let disk = 1.0 / peak;
    let (disk_gain, disk_phase) = within_disk(disk);
    let mut out = ChannelMargin {
        gain: [0.0, f64::INFINITY],
        phase: f64::INFINITY,
        delay: (!channel.is_sampled()).then_some(f64::INFINITY),
        disk,
        disk_frequency: Some(channel.frequency(place)),
        disk_gain,
        disk_phase,
        ..ChannelMargin::default()
    };
    let at = |place: f64| one.as_ref().map_or_else(|| channel.at(place)[(0, 0)], |one| one.at(place));
    let [real, half] = match &one {
        Some(one) => [one.real(), one.half()],
        None => [channel.changes(&|m| m.im), channel.changes(&|m| m.re + 0.5)],
    };
    for place in real.into_iter().chain([0.0, f64::INFINITY]) {
        let m = at(place).re;
        let (factor, frequency) = (1.0 + 1.0 / m, Some(channel.frequency(place)));
        if m > 0.0 && m.is_finite() && factor < out.gain[1] {
            (out.gain[1], out.gain_frequency[1]) = (factor, frequency);
        } else if m < 0.0 && factor > out.gain[0].max(NOTHING) {
            (out.gain[0], out.gain_frequency[0]) = (factor, frequency);
        }
    }
    for place in half {
        let m = at(place);
        let factor = 1.0 + m.conj() / m.norm_sqr();
        let (turn, frequency) = (-atan2(factor.im, factor.re), channel.frequency(place));
        if turn.abs() < out.phase {
            (out.phase, out.phase_frequency) = (turn.abs(), Some(frequency));
        }
        let late = turn.rem_euclid(TAU) / frequency;
        if out.delay.is_some_and(|delay| late < delay) {
            (out.delay, out.delay_frequency) = (Some(late), Some(frequency));
        }
    }
    if let Some(one) = one.filter(|one| one.poles_at_zero() > 0) {
        moving_freely(&one, &mut out);
    }
    Some(out)
}

/// The margins of a channel that measures and moves an uncontrolled rigid-body mode.
fn moving_freely(one: &OneChannel, out: &mut ChannelMargin) {
    let [low, high] = out.gain;
    // Between one and the next limit all factors are equivalent.
    if !one.stable_with(0.5 * (1.0 + low)) {
        (out.gain[0], out.gain_frequency[0]) = (1.0, Some(0.0));
    }
    if !one.stable_with(if high.is_finite() { 0.5 * (1.0 + high) } else { 2.0 }) {
        (out.gain[1], out.gain_frequency[1]) = (1.0, Some(0.0));
    }
    let (rate, turns) = if one.poles_at_zero() == 1 { one.at_pole() } else { (0.0, true) };
    if turns {
        (out.phase, out.phase_frequency) = (0.0, Some(0.0));
    }
    // A root comes to zero where 1 + r τ is none.
    if rate < 0.0 && out.delay.is_some_and(|delay| -1.0 / rate < delay) {
        (out.delay, out.delay_frequency) = (Some(-1.0 / rate), Some(0.0));
    }
}
