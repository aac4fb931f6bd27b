//! Save and restore of the numbers of a running block or machine, bit for bit.

/// Visits the numbers of a running block or machine, always in the same order: reads them out, or replaces them. So one
/// list of the state serves for saving and restoring.
///
/// ```
/// use kardan_math::num::StateArchive;
///
/// let (mut speed, mut places) = (0.1, vec![3, 5]);
/// let mut out = StateArchive::taking();
/// out.number(&mut speed);
/// out.counts(&mut places);
/// let data = out.data();
///
/// let (mut again, mut there) = (0.0, vec![]);
/// let mut back = StateArchive::putting(&data);
/// back.number(&mut again);
/// back.counts(&mut there);
/// assert!(back.fits());
/// assert_eq!((again, there), (speed, places));
/// ```
#[derive(Debug)]
pub struct StateArchive<'a>(Way<'a>);

#[derive(Debug)]
enum Way<'a> {
    Taking(Vec<u64>),
    /// The words that are left; whether there were enough, and lengths were as they can be.
    Putting(&'a [u64], bool),
}

/// The longest list that can be put back: more is no list of what runs.
const LONGEST: usize = 1 << 32;

impl<'a> StateArchive<'a> {
    /// Takes numbers out.
    pub fn taking() -> Self {
        Self(Way::Taking(Vec::new()))
    }

    /// Restores saved numbers.
    pub fn putting(data: &'a [u64]) -> Self {
        Self(Way::Putting(data, true))
    }

    /// The numbers read out; empty, if numbers were restored.
    pub fn data(self) -> Vec<u64> {
        match self.0 {
            Way::Taking(data) => data,
            Way::Putting(..) => Vec::new(),
        }
    }

    /// Whether the words put back were as many as there are places for.
    pub fn fits(&self) -> bool {
        match &self.0 {
            Way::Taking(_) => true,
            Way::Putting(rest, good) => *good && rest.is_empty(),
        }
    }

    /// A whole number.
    pub fn word(&mut self, value: &mut u64) {
        match &mut self.0 {
            Way::Taking(data) => data.push(*value),
            Way::Putting(rest, good) => match rest.split_first() {
                Some((first, tail)) => (*value, *rest) = (*first, tail),
                None => *good = false,
            },
        }
    }

    /// A count.
    pub fn count(&mut self, value: &mut usize) {
        let mut word = *value as u64;
        self.word(&mut word);
        *value = word as usize;
    }

    /// Yes or no.
    pub fn flag(&mut self, value: &mut bool) {
        let mut word = u64::from(*value);
        self.word(&mut word);
        *value = word != 0;
    }

    /// A number, bit for bit.
    pub fn number(&mut self, value: &mut f64) {
        let mut word = value.to_bits();
        self.word(&mut word);
        *value = f64::from_bits(word);
    }

    /// A number that may be missing.
    pub fn optional(&mut self, value: &mut Option<f64>) {
        let (mut present, mut number) = (value.is_some(), value.unwrap_or(0.0));
        self.flag(&mut present);
        self.number(&mut number);
        *value = present.then_some(number);
    }

    /// Numbers of any precision, whose count is known.
    pub fn numbers<T: super::Float>(&mut self, values: &mut [T]) {
        for value in values {
            let mut wide = value.to_f64();
            self.number(&mut wide);
            *value = T::from_f64(wide);
        }
    }

    /// A list of any length.
    pub fn list<T: Clone>(&mut self, values: &mut Vec<T>, empty: T, mut each: impl FnMut(&mut Self, &mut T)) {
        let mut length = values.len();
        self.count(&mut length);
        if let Way::Putting(rest, good) = &mut self.0
            && (length > LONGEST || length > rest.len())
        {
            // Each entry takes a word at least.
            *good = false;
            return;
        }
        values.resize(length, empty);
        values.iter_mut().for_each(|value| each(self, value));
    }

    /// A list of counts of any length.
    pub fn counts(&mut self, values: &mut Vec<usize>) {
        self.list(values, 0, Self::count);
    }
}
