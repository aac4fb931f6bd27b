//! Loops with backlash: margins in contact are those of the model without backlash, and own laws at an operating point those of the plant that is linear by hand.

use kardan::results::{ChannelMargin, ContactMargins, Design};
use kardan::study::{self, DesignSettings, Silent};

use crate::common::close;

fn designed(source: &str) -> Design {
    study::design(source, &DesignSettings::default(), &Silent).unwrap_or_else(|all| panic!("{all:?}"))
}

#[track_caller]
fn same(found: &[ChannelMargin], expected: &[ChannelMargin]) {
    assert_eq!(found.len(), expected.len());
    for (one, other) in found.iter().zip(expected) {
        assert_eq!((&one.name, one.is_sensor), (&other.name, other.is_sensor));
        for (one, other) in [
            (one.disk, other.disk),
            (one.phase, other.phase),
            (one.gain[0], other.gain[0]),
            (one.gain[1], other.gain[1]),
        ] {
            // Both may be without end.
            if one != other {
                close(one, other, 1e-9, "a margin");
            }
        }
    }
}

/// Two motors behind teeth with backlash on one table, each with a speed loop, and a slow one of the angle of the table.
fn table(backlash: [&str; 2]) -> String {
    let mesh = |k: usize| {
        let key =
            if backlash[k - 1].is_empty() { String::new() } else { format!("backlash = \"{}\"\n", backlash[k - 1]) };
        format!(
            "[spring_damper.mesh{k}]\nshaft_1 = \"m{k}\"\nshaft_2 = \"table\"\nstiffness = \"400 N m/rad\"\ndamping = \"0.6 N m s/rad\"\n{key}"
        )
    };
    format!(
        "[shaft.m1]\ninertia = \"0.02 kg m^2\"\ndamping = \"0.03 N m s/rad\"\n[shaft.m2]\ninertia = \"0.03 kg m^2\"\ndamping = \"0.03 N m s/rad\"\n\
         [shaft.table]\ninertia = \"0.5 kg m^2\"\ndamping = \"0.2 N m s/rad\"\n{}{}[motor.d1]\nshaft = \"m1\"\n[motor.d2]\nshaft = \"m2\"\n\
         [control.servo]\nlaw = \"program\"\nsample_time = \"1 ms\"\ndelay = \"1 ms\"\n\
         commands = {{ d1 = \"-1.5 N m s/rad * m1.w - 4 N m/rad * m1.phi - 2 N m/rad * table.phi\", d2 = \"-1.5 N m s/rad * m2.w - 4 N m/rad * m2.phi\" }}\n",
        mesh(1),
        mesh(2)
    )
}

fn contact<'a>(design: &'a Design, closed: &[&str]) -> &'a ContactMargins {
    let margins = design.margins.as_ref().expect("margins");
    margins
        .contacts
        .iter()
        .find(|one| one.closed == closed)
        .unwrap_or_else(|| panic!("{closed:?}: {:?}", margins.contacts))
}

#[test]
fn margins_in_contact_equal_those_at_zero_backlash() {
    let width = "0.02 deg";
    let design = designed(&table([width, width]));
    assert!(
        design.notes.iter().any(|note| note.contains("`mesh1`, `mesh2` are open at the operating point")),
        "{:?}",
        design.notes
    );
    let margins = design.margins.as_ref().expect("margins");
    assert_eq!(margins.contacts.len(), 3);
    for (closed, tight) in
        [(vec!["mesh1", "mesh2"], ["", ""]), (vec!["mesh1"], ["", width]), (vec!["mesh2"], [width, ""])]
    {
        let (found, reference) = (contact(&design, &closed), designed(&table(tight)));
        let reference = reference.margins.expect("margins");
        assert_eq!((found.stable, found.flank.as_str()), (reference.stable, "either"));
        same(&found.channels, &reference.channels);
        close(
            found.multiloop.as_ref().expect("both").disk[0],
            reference.multiloop.expect("both").disk[0],
            1e-6,
            "both at once",
        );
    }
    assert!(
        margins.verdict.contains("All results above are with `mesh1`, `mesh2` open (backlash)."),
        "{}",
        margins.verdict
    );
    // With teeth open all is as without what stands behind them.
    let all = contact(&design, &["mesh1", "mesh2"]);
    assert!((all.channels[0].disk - margins.channels[0].disk).abs() > 1e-3, "contact changes the margins");
    // Without backlash there is nothing to choose.
    let tight = designed(&table(["", ""]));
    assert!(tight.margins.expect("margins").contacts.is_empty());
}

#[test]
fn a_loop_that_is_unstable_in_contact_is_reported() {
    let source = table(["0.02 deg", "0.02 deg"]).replace("- 2 N m/rad * table.phi", "+ 60 N m/rad * table.phi");
    let design = designed(&source);
    assert_eq!(contact(&design, &["mesh1", "mesh2"]).stable, Some(false));
    assert!(
        design.warnings.iter().any(|text| text.contains("in contact (on either flank): the loop is unstable")),
        "{:?}",
        design.warnings
    );
}

/// An arm under gravity, m g l = 40 N m; the plant that is linear by hand has the spring 40 cos 60° in place of gravity.
fn arm(gravity: &str, command: &str, at: &str) -> String {
    format!(
        "[shaft.arm]\ninertia = \"2 kg m^2\"\ndamping = \"0.5 N m s/rad\"\n{gravity}[motor.drive]\nshaft = \"arm\"\nlag = \"2 ms\"\n\
         [control.own]\nlaw = \"program\"\n{at}commands = {{ drive = \"{command}\" }}\nsample_time = \"2 ms\"\ndelay = \"2 ms\"\n"
    )
}

#[test]
fn an_own_law_has_the_margins_of_the_plant_at_its_operating_point() {
    let gravity = "[torque.gravity]\nshaft = \"arm\"\nlaw = \"-40 N m * sin(arm.phi)\"\n";
    let spring = "[spring_damper.by_hand]\nshaft_1 = \"arm\"\nstiffness = \"20 N m/rad\"\n";
    let at = "at = { \"arm.phi\" = \"60 deg\" }\n";
    let slope = 3.0 * 100.0 * (60.0_f64).to_radians().powi(2);
    let cubic = format!("-{slope} N m/rad * arm.phi - 12 N m s/rad * arm.w");
    for (own, by_hand) in [
        // A law that is linear: the plant alone is another one there.
        ("-300 N m/rad * arm.phi - 12 N m s/rad * arm.w", "-300 N m/rad * arm.phi - 12 N m s/rad * arm.w"),
        // One that bends: its slope there.
        ("-100 N m/rad^3 * arm.phi^3 - 12 N m s/rad * arm.w", cubic.as_str()),
    ] {
        let (found, expected) = (designed(&arm(gravity, own, at)), designed(&arm(spring, by_hand, "")));
        let [one, other] = [&found, &expected].map(|design| design.margins.as_ref().expect("margins"));
        assert_eq!(one.stable, Some(true));
        same(&one.channels, &other.channels);
        // 40 sin 60° would hold it, and that is not what it commands.
        let reported = found.notes.iter().any(|note| note.contains("equilibrium needs 34.641016 N m"));
        assert!(reported, "{:?}", found.notes);
    }
    // Without a point it is that at zero, where the cube has no slope.
    let zero = designed(&arm(gravity, "-100 N m/rad^3 * arm.phi^3 - 12 N m s/rad * arm.w", ""));
    let stiff =
        arm("[spring_damper.by_hand]\nshaft_1 = \"arm\"\nstiffness = \"40 N m/rad\"\n", "-12 N m s/rad * arm.w", "");
    same(&zero.margins.expect("margins").channels[..1], &designed(&stiff).margins.expect("margins").channels[..1]);
}
