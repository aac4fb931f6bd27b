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

impl SamplingMethod {
    /// Whether points are draws of the distributions.
    pub fn draws(self) -> bool {
        matches!(self, Self::Random | Self::LatinHypercube | Self::Sobol | Self::Halton)
    }

    /// The names in files, in order.
    pub fn named(word: &str, levels: u64) -> Self {
        match word {
            "random" => Self::Random,
            "sobol" => Self::Sobol,
            "halton" => Self::Halton,
            "corners" => Self::Levels(2),
            "grid" => Self::Levels(levels),
            "saltelli" => Self::Saltelli,
            "morris" => Self::Morris,
            _ => Self::LatinHypercube,
        }
    }

    pub fn word(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::LatinHypercube => "latin_hypercube",
            Self::Sobol => "sobol",
            Self::Halton => "halton",
            Self::Levels(2) => "corners",
            Self::Levels(_) => "grid",
            Self::Saltelli => "saltelli",
            Self::Morris => "morris",
        }
    }

    /// Samples of one group, for a number of axes, or of factors that move together.
    pub fn group(self, axes: usize) -> u64 {
        match self {
            Self::Saltelli => axes as u64 + 2,
            Self::Morris => axes as u64 + 1,
            _ => 1,
        }
    }
}
