//! The distributions of varied values.

use kardan_identify::normal_quantile;

/// The distribution of a value.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::study) enum Distribution {
    /// Uniform between two values.
    Uniform { from: f64, to: f64 },
    /// Normal, cut off at two ends, which may be infinite.
    Normal { mean: f64, deviation: f64, from: f64, to: f64 },
    /// Two normal halves that meet at the peak, cut off at two ends (Fechner's two-piece normal): with equal probability below a quantile of the one and above that of
    /// the other, both by their own deviations.
    Halves { peak: f64, below: f64, above: f64, from: f64, to: f64 },
    /// Triangular: rising from one end to the peak and falling to the other.
    Triangular { from: f64, peak: f64, to: f64 },
    /// Only these values, with equal probability.
    Listed(Vec<f64>),
}

impl Distribution {
    /// The number of its values on a grid.
    pub fn levels(&self, levels: u64) -> u64 {
        if let Self::Listed(values) = self { values.len() as u64 } else { levels }
    }

    /// Whether it is unbounded below, and above.
    pub fn is_open(&self) -> [bool; 2] {
        match self {
            Self::Normal { from, to, .. } | Self::Halves { from, to, .. } => [from.is_infinite(), to.is_infinite()],
            _ => [false; 2],
        }
    }

    /// The quantile of this probability.
    pub fn quantile(&self, part: f64) -> f64 {
        match self {
            Self::Uniform { from, to } => (from + (to - from) * part).clamp(*from, *to),
            Self::Normal { mean, deviation, from, to } => {
                let [low, high] = [from, to].map(|end| normal_below((end - mean) / deviation));
                let part = low + (high - low) * part;
                (mean - deviation * normal_quantile(part)).clamp(*from, *to)
            }
            Self::Halves { peak, below, above, from, to } => {
                // The probability below the peak, and below a value.
                let left = below / (below + above);
                let part_below = |value: f64| match value < *peak {
                    true => 2.0 * left * normal_below((value - peak) / below),
                    false => 1.0 - 2.0 * (1.0 - left) * normal_below((peak - value) / above),
                };
                let [low, high] = [*from, *to].map(part_below);
                let part = low + (high - low) * part;
                let value = match part < left {
                    true => peak - below * normal_quantile(0.5 * part / left),
                    false => peak + above * normal_quantile(0.5 * (1.0 - part) / (1.0 - left)),
                };
                value.clamp(*from, *to)
            }
            Self::Triangular { from, peak, to } => {
                let (width, rise) = (to - from, peak - from);
                let value = match part * width < rise {
                    true => from + (part * width * rise).sqrt(),
                    false => to - ((1.0 - part) * width * (to - peak)).sqrt(),
                };
                value.clamp(*from, *to)
            }
            Self::Listed(values) => values[((part * values.len() as f64) as usize).min(values.len() - 1)],
        }
    }

    /// The quantile at the probability of a standard normal score.
    pub fn of_score(&self, score: f64) -> f64 {
        match self {
            Self::Normal { mean, deviation, from, to } if from.is_infinite() && to.is_infinite() => {
                mean + deviation * score
            }
            _ => self.quantile(normal_below(score)),
        }
    }
}

/// The quantile of the standard normal distribution.
pub(in crate::study) fn score(part: f64) -> f64 {
    -normal_quantile(part)
}

/// The distribution function of the standard normal distribution.
pub(in crate::study) fn normal_below(z: f64) -> f64 {
    if z.is_infinite() {
        if z > 0.0 { 1.0 } else { 0.0 }
    } else {
        0.5 * statrs::function::erf::erfc(-z / std::f64::consts::SQRT_2)
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/study/requests/distribution.rs"]
mod tests;
