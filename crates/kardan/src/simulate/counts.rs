//! What sensors that count meet in a run, and counts that come out otherwise.

use std::collections::VecDeque;

/// Readings of a sensor that are noted: those of 17 minutes at 1 kHz.
const MOST: usize = 1 << 20;

/// What a sensor that counts met at the readings of a sampled law.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Met {
    /// Name of the sensor.
    pub sensor: String,
    /// The time of each reading, s, and what was read there, in counts before they are rounded down: whole numbers are the boundaries of counts.
    pub readings: Vec<(f64, f64)>,
    /// When the first reading was that is not noted any more, s, if there is one.
    pub until: Option<f64>,
}

/// A reading that comes out on the other side of a boundary.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turned {
    /// Number of its sensor in [`RunResult::met`](super::RunResult::met).
    pub sensor: usize,
    /// Number of the reading.
    pub reading: usize,
    /// The boundary, in counts.
    pub boundary: f64,
    /// Whether it comes out above.
    pub above: bool,
}

/// Takes the readings of a sensor down, and turns some of them.
#[derive(Debug, Clone)]
pub(super) struct Notes {
    met: Met,
    /// Number of the next reading.
    next: usize,
    turned: VecDeque<Turned>,
}

impl Notes {
    /// Of a sensor; its turned readings in their order.
    pub fn new(sensor: String, turned: VecDeque<Turned>) -> Self {
        Self { met: Met { sensor, ..Met::default() }, next: 0, turned }
    }

    /// The count of what is met.
    pub fn count(&mut self, time: f64, steps: f64) -> f64 {
        let number = self.next;
        self.next += 1;
        if number < MOST {
            self.met.readings.push((time, steps));
        } else if self.met.until.is_none() {
            self.met.until = Some(time);
        }
        let turned = self.turned.pop_front_if(|turned| turned.reading == number);
        match turned.filter(|turned| (steps - turned.boundary).abs() < 0.5) {
            Some(Turned { boundary, above, .. }) => boundary - f64::from(u8::from(!above)),
            None => steps.floor(),
        }
    }

    /// What it met.
    pub fn met(self) -> Met {
        self.met
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turned_readings_come_out_on_the_side_asked_for() {
        let turned = |reading, above| Turned { sensor: 0, reading, boundary: 5.0, above };
        let all = [turned(1, true), turned(2, false), turned(3, true), turned(4, true)];
        let mut notes = Notes::new("encoder".into(), all.into());
        // Not turned; below and turned up; above and turned down; above already; far from the boundary.
        let met = [4.999, 4.999, 5.001, 5.001, 7.2];
        let counts: Vec<f64> = met.iter().zip([0.0, 0.1, 0.2, 0.3, 0.4]).map(|(x, t)| notes.count(t, *x)).collect();
        assert_eq!(counts, [4.0, 5.0, 4.0, 5.0, 7.0]);
        let noted = notes.met();
        assert_eq!(noted.readings, [(0.0, 4.999), (0.1, 4.999), (0.2, 5.001), (0.3, 5.001), (0.4, 7.2)]);
        assert_eq!((noted.sensor.as_str(), noted.until), ("encoder", None));
    }
}
