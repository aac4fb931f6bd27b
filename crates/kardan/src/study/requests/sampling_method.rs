//! The sampling methods of a sweep, and their names in files.

/// Number of axes with directions of Sobol's sequence.
pub(in crate::study) const SOBOL_AXES: usize = 1000;

/// The sampling method.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::study) enum SamplingMethod {
    /// Independent draws.
    Random,
    /// Latin hypercube: each axis is divided into as many strips as points, with one point in each (McKay, Beckman, Conover, Technometrics 21, 1979, 239).
    LatinHypercube,
    /// Sobol's sequence with the directions of Joe and Kuo (SIAM J. Sci. Comput. 30, 2008, 2635), shifted by the seed in its binary digits.
    Sobol,
    /// Halton's sequence (Numer. Math. 2, 1960, 84), shifted by the seed (Cranley and Patterson).
    Halton,
    /// Every combination of this many values of each axis, from end to end.
    Levels(u64),
    /// Two samples A and B of Sobol's sequence, then A with one axis after another taken from B (Saltelli and others, Comput. Phys. Commun. 181, 2010, 259).
    Saltelli,
    /// Paths on which one axis after another moves by a fraction of its probability, in random order (Morris, Technometrics 33, 1991, 161); they start anywhere
    /// within the possible range, so that no grid hides periodic effects.
    Morris,
}

/// Their names in files, without the grid, whose levels are a key of its own.
const NAMES: [(&str, SamplingMethod); 7] = [
    ("random", SamplingMethod::Random),
    ("latin_hypercube", SamplingMethod::LatinHypercube),
    ("sobol", SamplingMethod::Sobol),
    ("halton", SamplingMethod::Halton),
    ("corners", SamplingMethod::Levels(2)),
    ("saltelli", SamplingMethod::Saltelli),
    ("morris", SamplingMethod::Morris),
];

impl SamplingMethod {
    /// Whether points are draws of the distributions.
    pub fn draws(self) -> bool {
        matches!(self, Self::Random | Self::LatinHypercube | Self::Sobol | Self::Halton)
    }

    /// The method of a name, a Latin hypercube if there is none.
    pub fn named(word: &str, levels: u64) -> Self {
        if word == "grid" {
            return Self::Levels(levels);
        }
        NAMES.iter().find(|(name, _)| *name == word).map_or(Self::LatinHypercube, |(_, method)| *method)
    }

    /// Its name.
    pub fn word(self) -> &'static str {
        NAMES.iter().find(|(_, method)| *method == self).map_or("grid", |(name, _)| name)
    }
}
