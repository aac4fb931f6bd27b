//! Rows of the torque balance, one set for each window or steady segment of a log.

use std::ops::Range;

/// The motion in a window, from which [`Samples`] are built. Shapes: one entry for each reduced coordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Where {
    /// Number of the log.
    pub log: usize,
    /// Number of its section with a monotonic clock.
    pub section: usize,
    /// Middle, s.
    pub time: f64,
    /// Length, s.
    pub duration: f64,
}

/// Rows `y = Xθ + e` of many windows with the covariance of each, in flat memory.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Samples {
    /// Rows of a sample.
    pub rows: usize,
    /// Columns of X, extra ones included.
    pub columns: usize,
    /// Extra columns: the last ones.
    pub extras: usize,
    /// Degrees of freedom.
    pub degrees_of_freedom: usize,
    /// Inputs.
    pub inputs: usize,
    /// Location of each sample in time.
    pub places: Vec<Where>,
    /// Windows that each sample represents.
    pub windows: Vec<usize>,
    /// X, sample by sample, row by row.
    pub x: Vec<f64>,
    /// y, N m.
    pub y: Vec<f64>,
    /// Covariance of y − Xθ at the model's values, (N m)².
    pub covariance: Vec<f64>,
    /// Speed along the friction of each extra column, rad/s, without sign.
    pub speeds: Vec<f64>,
    /// Reduced coordinates, their speeds and accelerations: 3 × degrees_of_freedom for each sample.
    pub motion: Vec<f64>,
    /// How measurement errors enter, where needed.
    pub errors: Option<Errors>,
}

impl Samples {
    /// No samples yet.
    pub fn new(rows: usize, columns: usize, extras: usize, degrees_of_freedom: usize, inputs: usize) -> Self {
        Self { rows, columns, extras, degrees_of_freedom, inputs, ..Self::default() }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// Room for one more sample with zeros, at the end: X, y, covariance, speeds.
    pub fn push(&mut self, place: Where, motion: [&[f64]; 3]) -> Room<'_> {
        let grown = |list: &mut Vec<f64>, by: usize| {
            let from = list.len();
            list.resize(from + by, 0.0);
            from
        };
        self.places.push(place);
        self.windows.push(1);
        motion.iter().for_each(|part| self.motion.extend_from_slice(part));
        let x = grown(&mut self.x, self.rows * self.columns);
        let y = grown(&mut self.y, self.rows);
        let covariance = grown(&mut self.covariance, self.rows * self.rows);
        let speeds = grown(&mut self.speeds, self.extras);
        let (of_slopes, of_variances) = self.error_sizes();
        let errors = self.errors.as_mut().map(|errors| {
            let (slopes, variances) =
                (grown(&mut errors.slopes, of_slopes), grown(&mut errors.variances, of_variances));
            (&mut errors.slopes[slopes..], &mut errors.variances[variances..])
        });
        Room {
            x: &mut self.x[x..],
            y: &mut self.y[y..],
            covariance: &mut self.covariance[covariance..],
            speeds: &mut self.speeds[speeds..],
            errors,
        }
    }

    /// Removes the last sample.
    pub fn pop(&mut self) {
        self.places.pop();
        self.windows.pop();
        let n = self.len();
        self.x.truncate(n * self.rows * self.columns);
        self.y.truncate(n * self.rows);
        self.covariance.truncate(n * self.rows * self.rows);
        self.speeds.truncate(n * self.extras);
        self.motion.truncate(n * 3 * self.degrees_of_freedom);
        let (slopes, variances) = self.error_sizes();
        if let Some(errors) = &mut self.errors {
            errors.slopes.truncate(n * slopes);
            errors.variances.truncate(n * variances);
        }
    }

    /// Slopes and variances of a sample in its [`Errors`].
    pub fn error_sizes(&self) -> (usize, usize) {
        let (m, r) = (self.inputs, self.degrees_of_freedom);
        let columns = self.errors.as_ref().map_or(0, |errors| errors.columns.len());
        (self.rows * (m + (3 + columns) * r), m + 4 * r)
    }

    /// X of a sample.
    pub fn x(&self, sample: usize) -> &[f64] {
        &self.x[sample * self.rows * self.columns..(sample + 1) * self.rows * self.columns]
    }

    /// y of a sample.
    pub fn y(&self, sample: usize) -> &[f64] {
        &self.y[sample * self.rows..(sample + 1) * self.rows]
    }

    /// Covariance of a sample.
    pub fn covariance(&self, sample: usize) -> &[f64] {
        &self.covariance[sample * self.rows * self.rows..(sample + 1) * self.rows * self.rows]
    }

    /// Speeds of a sample along the frictions of the extra columns.
    pub fn speeds(&self, sample: usize) -> &[f64] {
        &self.speeds[sample * self.extras..(sample + 1) * self.extras]
    }

    /// Part of the motion of a sample: 0 coordinates, 1 speeds, 2 accelerations.
    pub fn motion(&self, sample: usize, part: usize) -> &[f64] {
        &self.motion[(3 * sample + part) * self.degrees_of_freedom..(3 * sample + part + 1) * self.degrees_of_freedom]
    }

    /// The same with some of the columns, of which the last so many are extra ones.
    ///
    /// # Panics
    /// If one of the last is no extra column here.
    pub fn of_columns(&self, columns: &[usize], extras: usize) -> Self {
        let (p, w) = (self.columns, self.columns - self.extras);
        let chosen = &columns[columns.len() - extras..];
        Self {
            columns: columns.len(),
            extras,
            x: self.x.chunks_exact(p.max(1)).flat_map(|row| columns.iter().map(|&k| row[k])).collect(),
            speeds: (0..self.len()).flat_map(|k| chosen.iter().map(move |&c| self.speeds(k)[c - w])).collect(),
            errors: self.errors.as_ref().map(|errors| self.errors_of(errors, columns)),
            ..self.clone()
        }
    }

    /// How errors enter some of the columns.
    fn errors_of(&self, errors: &Errors, columns: &[usize]) -> Errors {
        let (all, own) = (self.error_sizes().0, self.rows * self.degrees_of_freedom);
        let fixed = all - errors.columns.len() * own;
        // Position of each among the stored ones, and its new number.
        let retained: Vec<(usize, (usize, usize))> = columns
            .iter()
            .enumerate()
            .filter_map(|(number, column)| {
                let place = errors.columns.iter().position(|(of, _)| of == column)?;
                Some((place, (number, errors.columns[place].1)))
            })
            .collect();
        let mut slopes = Vec::with_capacity(errors.slopes.len());
        for sample in errors.slopes.chunks_exact(all.max(1)) {
            slopes.extend_from_slice(&sample[..fixed]);
            retained.iter().for_each(|(place, _)| slopes.extend_from_slice(&sample[fixed + place * own..][..own]));
        }
        Errors {
            columns: retained.into_iter().map(|(_, column)| column).collect(),
            slopes,
            variances: errors.variances.clone(),
        }
    }

    /// The samples at the places of other ones, which are in order, with the covariances of those.
    pub fn aligned(&self, reference: &Self) -> Self {
        let (mut retained, mut covariance) = (Vec::new(), Vec::new());
        let mut from = 0;
        for (k, place) in self.places.iter().enumerate() {
            let key = |one: &Where| (one.log, one.section, one.time);
            while reference.places.get(from).is_some_and(|candidate| key(candidate) < key(place)) {
                from += 1;
            }
            if reference.places.get(from) == Some(place) {
                retained.push(k..k + 1);
                covariance.extend_from_slice(reference.covariance(from));
            }
        }
        Self { covariance, ..self.averaged(&retained) }
    }

    /// Means over ranges of samples: a sample each.
    pub fn averaged(&self, ranges: &[Range<usize>]) -> Self {
        let mut out = Self::new(self.rows, self.columns, self.extras, self.degrees_of_freedom, self.inputs);
        out.errors = self.errors.as_ref().map(|errors| Errors { columns: errors.columns.clone(), ..Errors::default() });
        for range in ranges.iter().filter(|range| !range.is_empty()) {
            let n = range.len();
            let mean = |list: &[f64], size: usize| -> Vec<f64> {
                let mut sum = vec![0.0; size];
                for sample in range.clone() {
                    sum.iter_mut().zip(&list[sample * size..]).for_each(|(sum, x)| *sum += x / n as f64);
                }
                sum
            };
            let (first, last) = (self.places[range.start], self.places[range.end - 1]);
            let (begin, end) = (first.time - first.duration / 2.0, last.time + last.duration / 2.0);
            out.places.push(Where {
                log: first.log,
                section: first.section,
                time: (begin + end) / 2.0,
                duration: end - begin,
            });
            out.windows.push(self.windows[range.clone()].iter().sum());
            out.x.extend(mean(&self.x, self.rows * self.columns));
            out.y.extend(mean(&self.y, self.rows));
            out.covariance.extend(mean(&self.covariance, self.rows * self.rows).iter().map(|c| c / n as f64));
            out.speeds.extend(mean(&self.speeds, self.extras));
            out.motion.extend(mean(&self.motion, 3 * self.degrees_of_freedom));
            if let (Some(errors), Some(own)) = (&mut out.errors, &self.errors) {
                let (slopes, variances) = self.error_sizes();
                errors.slopes.extend(mean(&own.slopes, slopes));
                errors.variances.extend(mean(&own.variances, variances).iter().map(|c| c / n as f64));
            }
        }
        out
    }
}

/// How measurement errors enter the rows of samples.
///
/// Errors are those of the torques of all inputs, then of accelerations, speeds and positions of the reduced coordinates.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Errors {
    /// Columns that a part of the motion multiplies, and which: 0 accelerations, 1 speeds, 2 positions.
    pub columns: Vec<(usize, usize)>,
    /// Sample by sample: what each error adds to `y − Xθ` through known terms (rows × errors), then for each of these columns what the errors of
    /// its part add by its value (rows × degrees of freedom).
    pub slopes: Vec<f64>,
    /// Sample by sample: variances of the errors, then the covariances of accelerations and positions.
    pub variances: Vec<f64>,
}

/// Where the numbers of a new sample go.
pub struct Room<'a> {
    /// X
    pub x: &'a mut [f64],
    /// y
    pub y: &'a mut [f64],
    /// Covariance.
    pub covariance: &'a mut [f64],
    /// Speeds.
    pub speeds: &'a mut [f64],
    /// Slopes and variances of [`Errors`], where stored.
    pub errors: Option<(&'a mut [f64], &'a mut [f64])>,
}

/// Criteria of a steady segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steadiness {
    /// Permitted change of a speed, as a fraction of its largest magnitude in the log.
    pub tolerance: f64,
    /// Fewest windows of a segment.
    pub windows: usize,
    /// Windows omitted at either end, where a speed has just been reached or a friction has just broken away.
    pub guard: usize,
}

impl Default for Steadiness {
    fn default() -> Self {
        Self { tolerance: 0.02, windows: 4, guard: 1 }
    }
}

/// Tolerances within which an oscillation may leave and return.
const WOBBLE: f64 = 5.0;

/// Segments of constant speed: ranges of samples that follow each other in time, in which each speed stays within the tolerance of
/// its mean and no acceleration is distinguishable from noise (`noise`: standard deviations of the accelerations, rad/s²).
///
/// Pieces separated by an oscillation about the same set point are one segment, including the oscillation: their residual is one error, not two.
pub fn steady_segments(samples: &Samples, noise: &[f64], of: Steadiness) -> Vec<Range<usize>> {
    let r = samples.degrees_of_freedom;
    let mut largest = vec![0.0_f64; r];
    for sample in 0..samples.len() {
        largest.iter_mut().zip(samples.motion(sample, 1)).for_each(|(max, w)| *max = max.max(w.abs()));
    }
    let is_noise =
        |k: usize, change: f64, length: f64| change.abs() <= (of.tolerance * largest[k]).max(3.0 * noise[k] * length);
    let calm = |sample: usize| {
        let (length, a) = (samples.places[sample].duration, samples.motion(sample, 2));
        (0..r).all(|k| is_noise(k, a[k] * length, length))
    };
    let follows = |sample: usize, most: f64| {
        let (before, after) = (samples.places[sample - 1], samples.places[sample]);
        (before.log, before.section) == (after.log, after.section)
            && after.time - before.time < (most + 0.5) * after.duration
    };
    // Pieces with their mean speeds.
    let mut pieces: Vec<(Range<usize>, Vec<f64>)> = Vec::new();
    let mut begin = 0;
    let mut mean = vec![0.0; r];
    let close = |range: Range<usize>, mean: &[f64], pieces: &mut Vec<(Range<usize>, Vec<f64>)>| {
        if !range.is_empty() {
            pieces.push((range, mean.to_vec()));
        }
    };
    for sample in 0..samples.len() {
        let (w, length) = (samples.motion(sample, 1), samples.places[sample].duration);
        let open = sample > begin;
        let stays =
            calm(sample) && (!open || (follows(sample, 1.0) && (0..r).all(|k| is_noise(k, w[k] - mean[k], length))));
        if !stays {
            close(begin..sample, &mean, &mut pieces);
            begin = if calm(sample) { sample } else { sample + 1 };
        }
        if begin <= sample {
            let n = (sample - begin + 1) as f64;
            if sample == begin {
                mean.fill(0.0);
            }
            mean.iter_mut().zip(w).for_each(|(mean, w)| *mean += (w - *mean) / n);
        }
    }
    close(begin..samples.len(), &mean, &mut pieces);
    let mut joined: Vec<(Range<usize>, Vec<f64>)> = Vec::new();
    for (piece, mean) in pieces {
        let Some((before, joined_speed)) = joined.last_mut() else {
            joined.push((piece, mean));
            continue;
        };
        let length = samples.places[piece.start].duration;
        let near = |w: &[f64], times: f64| (0..r).all(|k| is_noise(k, (w[k] - joined_speed[k]) / times, length));
        let between = (before.end..piece.start).all(|sample| near(samples.motion(sample, 1), WOBBLE));
        let lasting = (before.end..=piece.start).all(|sample| follows(sample, of.windows as f64));
        if near(&mean, 1.0) && between && lasting {
            let (n, more) = (before.len() as f64, piece.len() as f64);
            joined_speed
                .iter_mut()
                .zip(&mean)
                .for_each(|(joined_speed, w)| *joined_speed += (w - *joined_speed) * more / (n + more));
            *before = before.start..piece.end;
        } else {
            joined.push((piece, mean));
        }
    }
    let long = joined.into_iter().map(|(range, _)| range).filter(|range| range.len() >= of.windows + 2 * of.guard);
    long.map(|range| range.start + of.guard..range.end - of.guard).collect()
}
