//! Errors of bringing constraints to explicit form.

use kardan_math::names::backquoted;

/// Why constraints cannot be brought to explicit form.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ReduceError {
    /// Some constraints contradict others that they follow from, or are balances of nodes.
    #[error("{rows} linear constraints have only rank {rank}; {}", describe_dependencies(dependencies))]
    ConstraintsDependent {
        /// How many rows there are.
        rows: usize,
        /// The exact rank of C.
        rank: usize,
        /// One entry for each dependency that cannot be removed as redundant.
        dependencies: Vec<Dependency>,
    },
    /// The constraints leave no motion.
    #[error("the constraints leave no motion: {shafts} shafts and {constraints} independent constraints")]
    NoMotion {
        /// Number of shafts.
        shafts: usize,
        /// Number of constraints.
        constraints: usize,
    },
    /// Coordinates named by the user are too few or too many.
    #[error("the model has {degrees_of_freedom} degree{} of freedom, but {} coordinate{} named", plural(*degrees_of_freedom), named.len(), if named.len() == 1 { " is" } else { "s are" })]
    CoordinateCount {
        /// Degrees of freedom.
        degrees_of_freedom: usize,
        /// The names given.
        named: Vec<String>,
        /// A valid set of coordinates.
        suggestion: Vec<String>,
    },
    /// Coordinates named by the user depend on each other through linear constraints.
    #[error("the coordinates {} are not independent: the constraints couple them", backquoted(named))]
    CoordinatesDependent {
        /// The names given.
        named: Vec<String>,
        /// A valid set of coordinates.
        suggestion: Vec<String>,
    },
    /// The transmissions cannot be evaluated one after another from the coordinates.
    #[error("{}", describe_open(elements, one_way))]
    NotExplicit {
        /// Elements of the loop.
        elements: Vec<String>,
        /// Those of them whose curve has no inverse in closed form: the shaft that drives must be known first.
        one_way: Vec<String>,
        /// A valid set of coordinates, if there is one.
        suggestion: Vec<String>,
    },
    /// A shaft follows through too many transmissions: its exact ratio has too many digits.
    #[error("`{shaft}` follows from the coordinates through {transmissions} transmissions one after the other, more than {MOST_IN_SERIES}: its \
             exact ratio would have {} digits", transmissions * DIGITS_OF_A_RATIO)]
    TooDeep {
        /// The shaft.
        shaft: String,
        /// How many transmissions.
        transmissions: usize,
    },
}

/// Most transmissions in series that a shaft may follow through: exact ratios of that many take seconds.
pub(super) const MOST_IN_SERIES: usize = 500;
/// Decimal digits of a ratio that is rounded to binary, on both sides of its point.
const DIGITS_OF_A_RATIO: usize = 16;

/// Constraint elements whose rows are linearly dependent.
#[derive(Debug, Clone, PartialEq)]
pub struct Dependency {
    /// `(element, its share in the combination that vanishes)`.
    pub elements: Vec<(String, f64)>,
    /// Whether the offsets contradict each other; otherwise one row is redundant.
    pub contradiction: bool,
    /// Whether an offset is a function of time: whether they agree at all times is not decided.
    pub moving: bool,
}

fn plural(count: usize) -> &'static str {
    if count == 1 { "" } else { "s" }
}

fn describe_dependencies(dependencies: &[Dependency]) -> String {
    let one = |dependency: &Dependency| {
        let sum: Vec<String> = dependency.elements.iter().map(|(name, x)| format!("{x} · `{name}`")).collect();
        let verdict = match dependency {
            Dependency { contradiction: true, .. } => "and their offsets contradict each other",
            Dependency { moving: true, .. } => "and an offset is a function of time",
            _ => "so one is redundant",
        };
        format!("{} = 0, {verdict}", sum.join(" + "))
    };
    dependencies.iter().map(one).collect::<Vec<_>>().join("; ")
}

fn describe_open(elements: &[String], one_way: &[String]) -> String {
    let all = backquoted(elements);
    if one_way.is_empty() {
        return format!("the transmissions {all} close a loop that cannot be evaluated one after another");
    }
    let drives = backquoted(one_way);
    format!(
        "the transmissions {all} cannot be evaluated from these coordinates: the driving shaft of {drives} must be known first"
    )
}
