//! Words that promise certainty, and what stands behind each.
//!
//! Every text of the library, of its pages and of the command that says "exact", "exactly", "proven", "proof", "decided", "certified",
//! "guaranteed" or "bounded" is in a list here, with the
//! evidence: keys of the certificate that another program checks, a test that decides the same in another way, or that it claims nothing. A new one
//! fails until it has its place. Some texts are put together from pieces; then the piece with the word is listed.

use std::fs;
use std::path::{Path, PathBuf};

use crate::reader::{crate_folder, crates, sources, texts};

/// What stands behind a text.
enum Evidence {
    /// Keys of the JSON of an analysis that `docs/check_certificate.py` reads and `docs/certificate.md` explains.
    Certificate(&'static [&'static str]),
    /// A test that decides it otherwise: its file below `crates`, and its name.
    Test(&'static str, &'static str),
    /// It says that something is not decided or not proven, or names its probability.
    Open,
    /// No verdict: a description of a method, a key or a number that is as it was given.
    Description,
}
use Evidence::{Certificate, Description, Open, Test};

/// Evidence, and parts of texts that it stands behind.
const LISTED: &[(Evidence, &[&str])] = &[
    (
        Certificate(&[
            "controllability_minor",
            "observability_minor",
            "uncontrollable_invariant",
            "unobservable_invariant",
        ]),
        &[
            "rank {n} of {n}: a minor does not vanish modulo a prime; proven",
            "a minor does not vanish modulo a prime, and {} never reached; proven",
            "exact left vector",
            "(at least {rank} is proven)",
        ],
    ),
    (
        Certificate(&["inputs", "outputs"]),
        &[
            "with a non-vanishing minor",
            "the number of non-trivial invariant factors; proven",
            "{some} enough: proven.",
            "{some} enough, and fewer are not: proven.",
        ],
    ),
    (Certificate(&["stability"]), &["Routh's table of exact characteristic polynomials; proven"]),
    (
        Certificate(&["factors", "relative_degrees", "zeros"]),
        &[
            "powers of square-free factors multiply to the invariant factors exactly",
            "the leading Markov parameters vanish exactly; proven",
            "{what}; proven",
        ],
    ),
    (Certificate(&["proven"]), &["Every result is proven over the rationals."]),
    (
        Certificate(&["matrix_distance"]),
        &["The smaller number is a proven lower bound", "rely on the result only if the numbers are exact"],
    ),
    (
        Test("kardan/tests/analysis/constraints.rs", "no_prime_and_no_point_is_known_before"),
        &["Frobenius' test is not zero, exactly, at the generic point"],
    ),
    (
        Test("kardan/tests/analysis/constraints.rs", "functions_that_are_not_rational_are_not_guessed_at"),
        &["the cross derivatives of its coefficients are equal, exactly"],
    ),
    (
        Test("kardan/tests/analysis/box_proof.rs", "a_loss_in_the_box_is_never_overlooked"),
        &[
            "no loss of {what} within {} tolerances: proven",
            "proven: no loss",
            "is nowhere lost in the box of tolerances",
            "It is proven that there is no loss",
        ],
    ),
    (
        Test("kardan/tests/analysis/sensitivity.rs", "a_loss_at_zero_is_decided_exactly"),
        &["the nominal model itself; exact", "proven_distance_tolerances"],
    ),
    (
        Test("kardan/tests/analysis/parity.rs", "verdicts_of_random_systems_are_those_of_their_pencils"),
        &["Decided exactly.", "{decided} One fault at a time"],
    ),
    (
        Test("kardan/tests/analysis/properties.rs", "zeros_in_the_right_half_plane_are_counted"),
        &["Some zeros lie in the right half-plane, decided exactly"],
    ),
    (
        Test("kardan/tests/synthesis/design.rs", "unstable_zero_dynamics_are_refused"),
        &["They are stable, decided exactly"],
    ),
    (
        Test("kardan/tests/synthesis/decoupling.rs", "hidden_canonical_systems_are_decoupled_again"),
        &[
            "proof",
            "proven exactly",
            "Transfer matrix of the linear loop, exact",
            "the transfer matrix has normal rank {normal_rank}; both exact",
            "is exactly zero: the linear loop is decoupled",
            "0 (exact)",
            "proven for the linear design model with rounded rows",
            "framed: exactly zero in the linear loop",
            "proven",
        ],
    ),
    (
        Test("kardan/tests/synthesis/margins.rs", "next_to_the_axis_is_decided_exactly"),
        &["(decided exactly)", "exactly (over the rationals", "this was decided exactly", "exactly, gains "],
    ),
    (
        Test("kardan/tests/synthesis/margins.rs", "three_poles_exactly_at_zero"),
        &["Its pole is exactly at zero", "Their poles are exactly at zero"],
    ),
    (
        Test("kardan/tests/sampled/sampled.rs", "runs_equal_the_exact_map"),
        &[
            "The sampled linear loop, exactly, at its sample instants",
            "(exact map of the linear loop",
            "stability is that of the exact map",
            "searched on the exact map",
        ],
    ),
    (
        Test("kardan/tests/synthesis/stability.rs", "sampled_loops_with_transcendental_maps"),
        &["(certified: poles bounded away from the stability boundary)", "by certified bounds"],
    ),
    (
        Test("kardan/tests/synthesis/trials.rs", "margins_and_rates_are_right"),
        &[
            "(eigenvalues in floating point, their rounding bounded)",
            "floating point, rounding bounded",
            "guaranteed range",
        ],
    ),
    (
        Test("kardan/tests/synthesis/stability.rs", "what_hangs_on_rounded_slopes_is_not_decided"),
        &[
            "exactly, and the same for other last digits of rounded numbers that were tried",
            "(decided exactly for the rounded numbers",
        ],
    ),
    (
        Test("kardan/tests/model/torque_laws.rs", "equilibria_are_reported_as_what_they_are"),
        &[
            "proven: there is exactly one within",
            "proven: the residual torque is exactly zero",
            "{}, {by}; {proven}{local}",
            "{what} {}, {by}{at_rest_text}; {proven}",
            "the run reports which one, and what of it is proven",
        ],
    ),
    (
        Open,
        &[
            "Not decided",
            "not decided",
            "not proven",
            "Not proven",
            "; {NOT_PROVEN}",
            "no proof",
            "neither proven nor found",
            "Not all results are proven",
            "The search found the worst case without proof",
            "and is not attempted",
            "was rounded to",
            "exact answers of larger systems would take too long",
            "too large for an exact decomposition",
            "which is exact to first order only",
            "wrong with a probability",
            "Results not marked as proven are computed modulo random primes",
            "the proof is for this controller alone",
            "the proof of the loop applies",
            "the statements are for the exact loop; the loop that runs",
            "exact verdicts are for the rounded rows",
            "all later steps are exact",
            "Those o",
        ],
    ),
    (
        Description,
        &[
            "bounded search: candidates added one by one",
            "input = \\\"3 * torque_sensor.tau\\\"",
            "not certified",
            "kardan design my.toml --control column",
            "closed_loop_poles_exact",
            "{exactly} values",
            "no exact forms were found",
            "<abbr title",
            "Each statement and how it was decided",
            ", exact",
            "{}{exact}",
            "solved exactly, the matrices are those of Theorem 4.1",
            "its exact derivatives {slopes}",
            "kardan places them exactly",
            "stays exact.",
            "The side force over the slip angle",
            "A function of time with a name.",
            "Named quantities",
            "its exact ratio would have",
            "have exact breakpoints",
            "steps at exact times",
            "the structure is still exact",
            "exactly",
            "decided and designed exactly on the linear model",
            "the exactly sampled plant",
            "is not in exactly one block",
            "need exactly one measurement",
            "it sticks exactly, without creep",
            "the servo loops read the exact angles",
            "leave it out if the value is exact",
        ],
    ),
];

/// Whether a text has one of the words.
fn promises(text: &str) -> bool {
    let claims = ["exact", "exactly", "proven", "proof", "decided", "certified", "guaranteed", "bounded"];
    text.split(|c: char| !c.is_alphabetic()).any(|word| claims.contains(&word.to_lowercase().as_str()))
}

/// All texts that have one, with their files.
fn promising() -> Vec<(PathBuf, String)> {
    let mut out = Vec::new();
    for (name, src) in crates() {
        if ["kardan-native", "kardan-rt", "kardan-tables"].contains(&name.as_str()) {
            continue;
        }
        for path in sources(&src) {
            let found = texts(&fs::read_to_string(&path).expect("a source"));
            out.extend(found.into_iter().filter(|text| promises(text)).map(|text| (path.clone(), text)));
        }
    }
    out
}

#[test]
fn every_promise_has_its_evidence() {
    let found = promising();
    assert!(found.len() > 100, "{}", found.len());
    // The whole text or, of a fragment of more than a word, any that contains it.
    let matches =
        |text: &str, part: &str| text == part || (part.contains(' ') || part.contains('<')) && text.contains(part);
    let parts = || LISTED.iter().flat_map(|(_, parts)| parts.iter());
    let open: Vec<String> = found
        .iter()
        .filter(|(_, text)| !parts().any(|part| matches(text, part)))
        .map(|(path, text)| format!("{}: {text}", path.display()))
        .collect();
    assert!(
        open.is_empty(),
        "texts that promise certainty without a place in the list of `verdicts.rs`:\n{}",
        open.join("\n")
    );
    let idle: Vec<&&str> = parts().filter(|part| !found.iter().any(|(_, text)| matches(text, part))).collect();
    assert!(idle.is_empty(), "parts that no text has any more: {idle:?}");
}

/// The keys are explained and read by the program that checks certificates; the tests are there.
#[test]
fn listed_evidence_exists() {
    let read = |path: &Path| fs::read_to_string(path).unwrap_or_else(|_| panic!("{}", path.display()));
    let [page, program] =
        ["certificate.md", "check_certificate.py"].map(|name| read(&crate_folder("../../docs").join(name)));
    let (mut keys, mut tests) = (0, 0);
    for (evidence, _) in LISTED {
        match evidence {
            Certificate(names) => {
                for name in *names {
                    keys += 1;
                    assert!(page.contains(&format!("`{name}")), "docs/certificate.md does not explain `{name}`");
                    assert!(
                        program.contains(&format!("\"{name}\"")),
                        "docs/check_certificate.py does not read `{name}`"
                    );
                }
            }
            Test(file, name) => {
                tests += 1;
                let text = read(&crate_folder("..").join(file));
                assert!(text.contains(&format!("#[test]\nfn {name}(")), "{file} has no test `{name}`");
            }
            Open | Description => {}
        }
    }
    assert!(keys > 8 && tests > 8);
}
