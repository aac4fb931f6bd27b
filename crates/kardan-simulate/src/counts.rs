//! Readings of counting sensors in a run, and counts that are flipped at a boundary.

use std::collections::VecDeque;

/// Most recorded readings of a sensor: those of 17 minutes at 1 kHz.
const MOST: usize = 1 << 20;

/// The readings of a counting sensor for a sampled law.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EncoderReading {
    /// Name of the sensor.
    pub sensor: String,
    /// The time of each reading, s, and its value in counts before rounding down: whole numbers are the boundaries of
    /// counts.
    pub readings: Vec<(f64, f64)>,
    /// The time of the first reading that is not recorded any more, s, if there is one.
    pub until: Option<f64>,
}

/// A reading that is flipped to the other side of a boundary.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlippedReading {
    /// Number of its sensor in [`RunResult::encoder_readings`](super::RunResult::encoder_readings).
    pub sensor: usize,
    /// Number of the reading.
    pub reading: usize,
    /// The boundary, in counts.
    pub boundary: f64,
    /// Whether the flipped reading is above.
    pub above: bool,
}

/// Records the readings of a sensor, and flips some of them.
#[derive(Debug, Clone)]
pub(super) struct Notes {
    pub encoder_readings: EncoderReading,
    /// Number of the next reading.
    next: usize,
    flipped: VecDeque<FlippedReading>,
}

impl Notes {
    /// Of a sensor; its flipped readings in their order.
    pub fn new(sensor: String, flipped: VecDeque<FlippedReading>) -> Self {
        Self { encoder_readings: EncoderReading { sensor, ..EncoderReading::default() }, next: 0, flipped }
    }

    /// The count of a reading.
    pub fn count(&mut self, time: f64, steps: f64) -> f64 {
        let number = self.next;
        self.next += 1;
        if number < MOST {
            self.encoder_readings.readings.push((time, steps));
        } else if self.encoder_readings.until.is_none() {
            self.encoder_readings.until = Some(time);
        }
        let flipped = self.flipped.pop_front_if(|flipped| flipped.reading == number);
        match flipped.filter(|flipped| (steps - flipped.boundary).abs() < 0.5) {
            Some(FlippedReading { boundary, above, .. }) => boundary - f64::from(u8::from(!above)),
            None => steps.floor(),
        }
    }
}

#[cfg(test)]
#[path = "../tests/unit/counts.rs"]
mod tests;
