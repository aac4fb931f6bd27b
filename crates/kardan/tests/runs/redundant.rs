//! Constraints that hold the same motion: what moves is that of the independent ones, the split of the torques is told.

use crate::common::{at, close, prepared, run, signal};
use kardan::diagnostics::Severity;
use kardan::results::Run;
use kardan::study::{self, AnalyzeSettings, EquationsForm, Project, Silent};

/// Three shafts, a torque on the first, a spring from the last to the housing.
fn shafts(gears: &str) -> String {
    let shaft = |name: &str, inertia: &str| format!("[shaft.{name}]\ninertia = \"{inertia} kg m^2\"\n");
    shaft("a", "1")
        + &shaft("b", "0.5")
        + &shaft("c", "0.25")
        + "[spring_damper.s]\nshaft_1 = \"c\"\nshaft_2 = \"ground\"\nstiffness = \"3 N m/rad\"\ndamping = \"0.1 N m s/rad\"\n"
        + "[motor.m]\nshaft = \"a\"\n[scenario]\nduration = \"2 s\"\noutput_step = \"0.1 s\"\nrelative_tolerance = 1e-10\n"
        + "[[scenario.event]]\nat = \"0 s\"\nsignal = \"m.tau\"\nto = \"2 N m\"\n"
        + gears
}

fn gear(name: &str, from: &str, to: &str, ratio: &str, offset: &str) -> String {
    format!("[gear.{name}]\nshaft_1 = \"{from}\"\nshaft_2 = \"{to}\"\nratio = {ratio}\noffset = \"{offset} deg\"\n")
}

fn same_motion(run: &Run, other: &Run) {
    for name in ["a.phi", "b.phi", "c.phi", "a.w", "b.w", "c.w", "s.tau"] {
        let bits = |run: &Run| signal(run, name).iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(run), bits(other), "{name}");
    }
}

/// ```text
///   τ → [ a ]==2:1==[ b ]==3:1==[ c ]~~~~     one of two equal gears a-b more: the same motion to the last bit, each has half of the torque
///            ==2:1==
/// ```
#[test]
fn two_equal_gears_share_by_halves() {
    let bc = gear("bc", "b", "c", "3", "0");
    let one = run(&shafts(&(gear("one", "a", "b", "2", "5") + &bc)));
    let both = run(&shafts(&(gear("one", "a", "b", "2", "5") + &gear("two", "a", "b", "2", "5") + &bc)));
    same_motion(&one, &both);
    for time in [0.0, 0.7, 2.0] {
        let single = at(&one, "one.tau", time);
        assert!(single.abs() > 0.01);
        for name in ["one.tau", "two.tau", "one.a.tau", "two.a.tau"] {
            let sum = at(&one, if name.contains(".a.") { "one.a.tau" } else { "one.tau" }, time);
            assert_eq!(at(&both, name, time), 0.5 * sum, "{name} at {time}");
        }
        assert_eq!(at(&both, "bc.tau", time), at(&one, "bc.tau", time), "not shared");
    }
    let reported = |run: &Run| run.notes.iter().filter(|note| note.contains("`one`, `two`")).count();
    assert_eq!((reported(&one), reported(&both)), (0, 1), "{:?}", both.notes);
    assert!(both.energy.residual.abs() <= 1e-9 * both.energy.input.abs(), "{:?}", both.energy);
}

/// A ring of gears whose ratios agree, `ac = ab + 2 bc`. The torques on each shaft are those that its motion needs, and of all splits the
/// least squares are orthogonal to the dependency.
#[test]
fn ring_of_gears_balances_every_shaft_with_least_torques() {
    let ring = [("ab", "a", "b", 2.0), ("bc", "b", "c", 3.0), ("ac", "a", "c", 6.0)];
    let gears = ring.map(|(name, from, to, ratio)| gear(name, from, to, &ratio.to_string(), "0")).concat();
    let ring_run = run(&shafts(&gears));
    let open = run(&shafts(&(gear("ab", "a", "b", "2", "0") + &gear("bc", "b", "c", "3", "0"))));
    same_motion(&ring_run, &open);
    for time in [0.0, 0.4, 1.3, 2.0] {
        let tau = |run: &Run, name: &str| at(run, &format!("{name}.tau"), time);
        let [ab, bc, ac] = ["ab", "bc", "ac"].map(|name| tau(&ring_run, name));
        close(ab + 2.0 * bc - ac, 0.0, 1e-13, "orthogonal to the dependency");
        // What the open chain needs on each shaft.
        let (open_ab, open_bc) = (tau(&open, "ab"), tau(&open, "bc"));
        close(ab + ac, open_ab, 1e-13, "on a");
        close(-2.0 * ab + bc, -2.0 * open_ab + open_bc, 1e-13, "on b");
        close(-3.0 * bc - 6.0 * ac, -3.0 * open_bc, 1e-13, "on c");
    }
}

/// Offsets agree exactly, degrees included, or are refused by name, however small the difference is.
#[test]
fn offsets_agree_exactly_or_are_refused() {
    // a − 2b = −10°, b − 3c = −1/3°, a − 6c = −(10 + 2/3)°
    let ring = |offset: &str| {
        let gears =
            gear("ab", "a", "b", "2", "10") + &gear("bc", "b", "c", "3", "1/3") + &gear("ac", "a", "c", "6", offset);
        study::check(&shafts(&gears))
    };
    let fine = ring("32/3");
    assert!(fine.iter().all(|one| one.severity == Severity::Warning), "{fine:?}");
    assert!(fine.iter().any(|one| one.code == "constraint::redundant" && one.labels.len() == 3));
    let wrong = ring("10.66666666666666666666666666667");
    let wrong: Vec<_> = wrong.iter().filter(|one| one.severity == Severity::Error).collect();
    assert_eq!(wrong.len(), 1);
    assert_eq!(wrong[0].code, "constraint::dependent");
    for name in ["`ab`", "`ac`", "`bc`", "contradict"] {
        assert!(wrong[0].message.contains(name), "{}", wrong[0].message);
    }
}

/// `analyze` and `equations` know of the split: the class table names the row that follows, and multipliers per input are split as in a run.
#[test]
fn analysis_and_equations_show_the_split() {
    let bc = gear("bc", "b", "c", "3", "0");
    let source = |gears: &str| {
        shafts(&(gears.to_string() + &bc)).replace("[[scenario", "[analysis]\noutputs = [\"c.phi\"]\n[[scenario")
    };
    let (one, two) = (gear("one", "a", "b", "2", "0"), gear("two", "a", "b", "2", "0"));
    let analyze =
        |source: &str| Project::open(source).analyze(&AnalyzeSettings::default(), &Silent).expect("an analysis");
    let (single, both) = (analyze(&source(&one)), analyze(&source(&(one.clone() + &two))));
    let class = both.class.expect("a class");
    let row = class.constraints.iter().find(|row| row.element == "two").expect("the row that follows");
    assert!(row.equation.contains("which follows from one"), "{}", row.equation);
    assert!(
        both.notes.iter().any(|note| note.contains("`one`, `two`") && note.contains("not unique")),
        "{:?}",
        both.notes
    );
    let multipliers = |forces: Option<kardan::results::ConstraintForces>, name: &str| {
        let matrix = forces.expect("constraint forces").input_to_multiplier;
        let row = matrix.rows.iter().position(|row| row == name).expect("a row");
        matrix.values[row][0]
    };
    let whole = multipliers(single.constraint_forces, "one");
    assert!(whole.abs() > 0.1);
    for name in ["one", "two"] {
        close(multipliers(both.constraint_forces.clone(), name), 0.5 * whole, 1e-15, name);
    }
    let (text, _) = Project::open(source(&(one + &two))).equations(EquationsForm::Text).expect("equations");
    assert!(text.contains("two: a - 2 b = 0") && text.contains("not unique"), "{text}");
}

/// Redundant rows cost the motion nothing: states, reduced equations and steps are those of the independent ones.
#[test]
fn redundant_rows_are_enforced_once() {
    let many: String = (0..6).map(|k| gear(&format!("g{k}"), "a", "b", "2", "0")).collect();
    let variant = prepared(&shafts(&(many + &gear("bc", "b", "c", "3", "0")))).variants.remove(0);
    assert_eq!((variant.reduced.equations.constraints.len(), variant.reduced.redundant.len()), (2, 5));
    assert_eq!(variant.reduced.degrees_of_freedom(), 1);
    assert_eq!(variant.reduced.redundant_groups().len(), 1);
}

/// ```text
///   τ → [ a ]==2:1==[ b ]--rack 0.2 m--[ x ]      a row of speeds x' = 0.1 m a' beside: kept once, J a'' = τ with J = 1 + 1/4 + 0.1²
/// ```
#[test]
fn a_dependent_row_of_speeds_is_enforced_once() {
    let source = |rates: &str| {
        format!(
            "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\n[mass.x]\nmass = \"1 kg\"\n\
             [gear.g]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nratio = 2\n[rack_and_pinion.p]\npinion = \"b\"\nrack = \"x\"\nradius = \"0.2 m\"\n\
             [motor.m]\nshaft = \"a\"\n{rates}[scenario]\nduration = \"1 s\"\nsignals = {{ \"m.tau\" = \"1 N m\" }}\n"
        )
    };
    let row = |rates: &str| format!("[constraint.r]\nrates = {{ {rates} }}\n");
    let found = run(&source(&row("x = 1, a = \"-0.1 m\"")));
    for time in [0.3, 1.0] {
        close(at(&found, "a.w", time), time / 1.26, 1e-12, "speed");
        close(at(&found, "x.v", time), 0.1 * time / 1.26, 1e-12, "speed of the rack");
        // All that moves the mass: the rack, and the row beside it.
        close(at(&found, "p.x.f", time) + at(&found, "r.x.f", time), 0.1 / 1.26, 1e-12, "forces on the mass");
    }
    assert!(
        found.notes.iter().any(|note| note.contains("`g`, `p`, `r` restrict the same motion")),
        "{:?}",
        found.notes
    );
    let reported = |rates: &str| {
        let found = study::check(&source(rates));
        found.into_iter().find(|one| one.severity == Severity::Error).map(|one| (one.code, one.message))
    };
    assert_eq!(reported(&row("x = 1, a = \"-0.1 m\"")), None);
    // Another ratio holds everything.
    let no_motion = "the constraints leave no motion: 1 coordinates and 1 more constraints".to_string();
    assert_eq!(reported(&row("x = 1, a = \"-0.2 m\"")), Some(("constraint::no-motion", no_motion)));
    // Rows of speeds that say the same are kept once.
    let repeated = "[mass.y]\nmass = \"1 kg\"\n[mass.z]\nmass = \"1 kg\"\n".to_string()
        + &row("y = 1, z = -1")
        + &row("y = -2, z = 2").replace(".r]", ".s]");
    assert_eq!(reported(&repeated), None);
}
