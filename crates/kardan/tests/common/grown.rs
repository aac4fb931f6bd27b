//! Models that have one kind of entry many times: beside each other, in a chain of names, in a circle of names.

#![allow(dead_code)] // tests and benches use their own parts

/// One kind of entry, and the model with so many of them.
pub type Kind = (&'static str, fn(usize) -> String);

const BODY: &str =
    "[shaft.a]\ninertia = \"1 kg m^2\"\n\n[motor.m]\nshaft = \"a\"\n\n[scenario]\nduration = \"10 ms\"\n\n";

/// The model with one entry for each number.
fn with(count: usize, entry: impl Fn(usize) -> String) -> String {
    std::iter::once(BODY.to_string()).chain((0..count).map(entry)).collect()
}

/// The same, in a table or a list that is opened and closed.
fn table_of(open: &str, count: usize, entry: impl Fn(usize) -> String, close: &str) -> String {
    [with(0, |_| String::new()), open.into(), (0..count).map(entry).collect(), close.into()].concat()
}

fn signal(name: &str, value: &str) -> String {
    format!("[signal.{name}]\nkind = \"expression\"\nvalue = \"{value}\"\n\n")
}

fn block(name: &str, kind: &str, input: &str, keys: &str) -> String {
    format!("[block.{name}]\nkind = \"{kind}\"\ninput = \"{input}\"\nsample_time = \"1 ms\"\n{keys}\n\n")
}

/// The name of the entry before one, or of what the chain begins with.
fn before(k: usize, first: &str) -> String {
    k.checked_sub(1).map_or_else(|| first.to_string(), |k| format!("x{k}"))
}

/// Entries that stand beside each other, or that many others name; `check` takes about as many times longer as there are more of them.
pub const WIDE: &[Kind] = &[
    ("parameters", |n| table_of("[parameters]\n", n, |k| format!("x{k} = \"{} kg\"\n", k + 1), "")),
    ("parameters of one", |n| table_of("[parameters]\np = \"1 kg\"\n", n, |k| format!("x{k} = \"{k} * p\"\n"), "")),
    ("springs", |n| {
        with(n, |k| {
            format!("[spring_damper.x{k}]\nshaft_1 = \"a\"\nshaft_2 = \"ground\"\nstiffness = \"1 N m/rad\"\n\n")
        })
    }),
    ("springs with backlash", |n| {
        with(n, |k| {
            let ends = "shaft_1 = \"a\"\nshaft_2 = \"ground\"\nstiffness = \"1 N m/rad\"";
            format!("[spring_damper.x{k}]\n{ends}\nbacklash = \"{} mrad\"\n\n", k + 1)
        })
    }),
    ("stops", |n| with(n, |k| format!("[end_stop.x{k}]\nshaft_1 = \"a\"\nupper = \"{} rad\"\n\n", k + 1))),
    ("brakes", |n| with(n, |k| format!("[brake.x{k}]\nshaft = \"a\"\ntorque = \"{} N m\"\n\n", k + 1))),
    ("clutches", |n| {
        with(n, |k| format!("[clutch.x{k}]\nshaft_1 = \"a\"\nshaft_2 = \"ground\"\ntorque = \"{} N m\"\n\n", k + 1))
    }),
    ("dependent constraints", |n| {
        let row = |k: usize| format!("[constraint.x{k}]\ncoefficients = {{ a = {}, b = -{} }}\n\n", k + 1, 2 * (k + 1));
        table_of("[shaft.b]\ninertia = \"1 kg m^2\"\n\n", n, row, "")
    }),
    ("torques of tables", |n| {
        let table = |k: usize| {
            let points = format!("points = {{ x = [\"0 rad\", \"1 rad\"], value = [\"0 N m\", \"{} N m\"] }}", k + 1);
            format!("[table.x{k}]\n{points}\n\n[torque.t{k}]\nshaft = \"a\"\nlaw = \"-x{k}(a.phi)\"\n\n")
        };
        with(n, table)
    }),
    ("machines", |n| {
        let machine = |k: usize| {
            let states = "states = [\"p\", \"q\"]\nsample_time = \"1 ms\"";
            let way = format!("{{ from = \"p\", to = \"q\", when = \"a.phi > {} rad\" }}", k + 1);
            format!("[block.x{k}]\nkind = \"state_machine\"\n{states}\ntransitions = [{way}]\n\n")
        };
        with(n, machine)
    }),
    ("motors", |n| with(n, |k| format!("[motor.x{k}]\nshaft = \"a\"\n\n"))),
    ("disturbances", |n| with(n, |k| format!("[disturbance.x{k}]\nshaft = \"a\"\n\n"))),
    ("torques", |n| with(n, |k| format!("[torque.x{k}]\nshaft = \"a\"\nlaw = \"-{} N m * sin(a.phi)\"\n\n", k + 1))),
    ("sensors", |n| with(n, |k| format!("[sensor.x{k}]\nmeasures = \"angle\"\nshaft = \"a\"\n\n"))),
    ("signals of time", |n| {
        with(n, |k| format!("[signal.x{k}]\nkind = \"sine\"\namplitude = \"{} N m\"\nfrequency = \"1 Hz\"\n\n", k + 1))
    }),
    ("expressions of time", |n| with(n, |k| signal(&format!("x{k}"), &format!("{} N m * sin(2 pi t / 1 s)", k + 1)))),
    ("formulas", |n| with(n, |k| signal(&format!("x{k}"), &format!("{} * a.phi", k + 1)))),
    ("blocks", |n| with(n, |k| block(&format!("x{k}"), "gain", "a.phi", &format!("gain = {}", k + 1)))),
    ("filters", |n| with(n, |k| block(&format!("x{k}"), "low_pass", "a.phi", "time_constant = \"10 ms\""))),
    ("monitors", |n| {
        let monitor = |k| {
            let limit = format!("residual = \"a.phi\"\nthreshold = \"{} rad\"\nsample_time = \"1 ms\"\n\n", k + 1);
            format!("[block.x{k}]\nkind = \"monitor\"\n{limit}")
        };
        with(n, monitor)
    }),
    ("transitions of a machine", |n| machine(n.div_ceil(7))),
    ("tables", |n| {
        let points = "points = { x = [\"0 rad\", \"1 rad\"], value = [\"0 N m\", \"1 N m\"] }";
        with(n, |k| format!("[table.x{k}]\n{points}\n\n"))
    }),
    ("events", |n| {
        let event = |k: usize| {
            format!(
                "[[scenario.event]]\nat = \"{} us\"\nsignal = \"m.tau\"\nto = \"1 N m\"\n\n",
                (k + 1) as f64 / 100.0
            )
        };
        table_of("", n, event, "")
    }),
    ("faults", |n| with(n, |k| format!("[fault.x{k}]\nmotor = \"m\"\nkind = \"dead\"\nat = \"{} us\"\n\n", k + 1))),
    ("requirements", |n| {
        with(n, |k| format!("[[requirement]]\nsignal = \"a.phi\"\nmeasure = \"max\"\nbelow = \"{} rad\"\n\n", k + 1))
    }),
    ("figures", |n| with(n, |k| format!("[[figure]]\nname = \"x{k}\"\nsignal = \"a.phi\"\nmeasure = \"max\"\n\n"))),
    ("plots", |n| with(n, |k| format!("[[plot]]\nname = \"x{k}\"\ntitle = \"x\"\nsignals = [\"a.phi\"]\n\n"))),
    ("variants", |n| {
        let open = "[parameters]\np = \"1 kg m^2\"\n\n[shaft.b]\ninertia = \"p\"\n\n";
        table_of(open, n, |k| format!("[[variant]]\nname = \"x{k}\"\nset = {{ p = \"{} kg m^2\" }}\n\n", k + 1), "")
    }),
    ("varied values of a sweep", |n| {
        let varied = |k: usize| {
            let spring =
                format!("[spring_damper.x{k}]\nshaft_1 = \"a\"\nshaft_2 = \"ground\"\nstiffness = \"p{k}\"\n\n");
            spring + &format!("[[sweep.vary]]\nparameter = \"p{k}\"\nfrom = \"1 N m/rad\"\nto = \"2 N m/rad\"\n\n")
        };
        let parameters: String = (0..n).map(|k| format!("p{k} = \"1 N m/rad\"\n")).collect();
        table_of(&format!("[parameters]\n{parameters}\n[sweep]\nsamples = 2\n\n"), n, varied, "")
    }),
];

/// Entries each of which names the one before it.
pub const CHAINS: &[Kind] = &[
    ("parameters in a chain", |n| {
        table_of("[parameters]\nstart = \"1 kg\"\n", n, |k| format!("x{k} = \"1 * {}\"\n", before(k, "start")), "")
    }),
    ("parameters in a chain from behind", |n| {
        let parameter = |k: usize| format!("x{} = \"1 * {}\"\n", n - 1 - k, before(n - 1 - k, "start"));
        table_of("[parameters]\n", n, parameter, "start = \"1 kg\"\n")
    }),
    ("signals of time in a chain", |n| with(n, |k| signal(&format!("x{k}"), &format!("{} + 1 s", before(k, "t"))))),
    ("signals of time in a chain from behind", |n| {
        with(n, |k| signal(&format!("x{}", n - 1 - k), &format!("{} + 1 s", before(n - 1 - k, "t"))))
    }),
    ("sines in a chain", |n| with(n, |k| signal(&format!("x{k}"), &format!("sin({})", before(k, "t / 1 s"))))),
    ("formulas in a chain", |n| with(n, |k| signal(&format!("x{k}"), &format!("sin({})", before(k, "a.phi"))))),
    ("formulas of the two before", |n| {
        let two = |k: usize| format!("{} + 0.5 * {}", before(k, "a.phi"), before(k.saturating_sub(1), "a.phi"));
        with(n, |k| signal(&format!("x{k}"), &two(k)))
    }),
    ("formulas of the two before with sines", |n| {
        let two = |k: usize| format!("sin({}) + sin({})", before(k, "a.phi"), before(k.saturating_sub(1), "a.phi"));
        with(n, |k| signal(&format!("x{k}"), &two(k)))
    }),
    ("blocks in a chain", |n| with(n, |k| block(&format!("x{k}"), "gain", &before(k, "a.phi"), "gain = 1.5"))),
    ("blocks in a chain from behind", |n| {
        with(n, |k| block(&format!("x{}", n - 1 - k), "gain", &before(n - 1 - k, "a.phi"), "gain = 1.5"))
    }),
    ("delays in a chain", |n| with(n, |k| block(&format!("x{k}"), "delay", &before(k, "a.phi"), "time = \"1 ms\""))),
    ("filters in a chain", |n| {
        with(n, |k| block(&format!("x{k}"), "low_pass", &before(k, "a.phi"), "time_constant = \"10 ms\""))
    }),
    ("leads in a chain", |n| {
        with(n, |k| block(&format!("x{k}"), "lead_lag", &before(k, "a.phi"), "lead = \"4 ms\"\nlag = \"2 ms\""))
    }),
    ("formulas in a chain to a torque", |n| {
        let torque = format!("[torque.t]\nshaft = \"a\"\nlaw = \"-1 N m/rad * x{}\"\n", n - 1);
        let angle = |k: usize| format!("1 rad * sin({})", before(k, "a.phi"));
        table_of("", n, |k| signal(&format!("x{k}"), &angle(k)), &torque)
    }),
    ("formulas in a chain to a law", |n| {
        let law = format!("[control.c]\nlaw = \"program\"\ncommands = {{ m = \"-1 N m/rad * x{}\" }}\n", n - 1);
        let angle = |k: usize| format!("1 rad * sin({})", before(k, "a.phi"));
        table_of("", n, |k| signal(&format!("x{k}"), &angle(k)), &law)
    }),
    ("controllers of one shaft", |n| {
        let pair = |k: usize| {
            format!(
                "[motor.x{k}]\nshaft = \"a\"\n\n[control.c{k}]\nlaw = \"program\"\ncommands = {{ x{k} = \"-{} N m s/rad * a.w\" }}\n\n",
                k + 1
            )
        };
        with(n, pair)
    }),
    ("filters in a loop", |n| {
        let law = format!("[control.c]\nlaw = \"program\"\ncommands = {{ m = \"-0.01 N m s/rad * x{}\" }}\n", n - 1);
        let filter = |k: usize| {
            let input = before(k, "a.w");
            format!("[block.x{k}]\nkind = \"low_pass\"\ninput = \"{input}\"\ntime_constant = \"10 ms\"\n\n")
        };
        table_of("", n, filter, &law)
    }),
    ("sampled filters in a loop", |n| {
        let law = format!(
            "[control.c]\nlaw = \"program\"\nsample_time = \"1 ms\"\ncommands = {{ m = \"-0.01 N m s/rad * x{}\" }}\n",
            n - 1
        );
        table_of("", n, |k| block(&format!("x{k}"), "low_pass", &before(k, "a.w"), "time_constant = \"10 ms\""), &law)
    }),
    ("formulas of products of the two before", |n| {
        let two = |k: usize| {
            let both = [before(k, "a.phi"), before(k.saturating_sub(1), "a.phi")];
            format!("1 rad * sin({} * {} / (1 rad^2))", both[0], both[1])
        };
        with(n, |k| signal(&format!("x{k}"), &two(k)))
    }),
    ("formulas of the ten before", |n| {
        let ten = |k: usize| (k.saturating_sub(10)..k).fold("a.phi".to_string(), |sum, k| sum + &format!(" + x{k}"));
        with(n, |k| signal(&format!("x{k}"), &ten(k)))
    }),
    ("figures in a chain", |n| {
        let figure = |k: usize| format!("[[figure]]\nname = \"x{k}\"\nvalue = \"{} + 1 rad\"\n\n", before(k, "start"));
        table_of("[[figure]]\nname = \"start\"\nsignal = \"a.phi\"\nmeasure = \"max\"\n\n", n, figure, "")
    }),
    ("holds of formulas in a chain", |n| {
        let pair = |k: usize| {
            let own = signal(&format!("f{k}"), &format!("{} + 1 rad", before(k, "a.phi")));
            own + &block(&format!("x{k}"), "hold", &format!("f{k}"), "")
        };
        with(n, pair)
    }),
    ("saturations in a chain", |n| {
        let keys = "low = \"-1 rad\"\nhigh = \"1 rad\"";
        with(n, |k| block(&format!("x{k}"), "saturation", &before(k, "a.phi"), keys))
    }),
];

/// Entries that name each other in a circle, which is told.
pub const CIRCLES: &[Kind] = &[
    ("parameters in a circle", |n| table_of("[parameters]\n", n, |k| format!("x{k} = \"1 * x{}\"\n", (k + 1) % n), "")),
    ("signals of time in a circle", |n| with(n, |k| signal(&format!("x{k}"), &format!("x{} + 1 N m", (k + 1) % n)))),
    ("formulas in a circle", |n| with(n, |k| signal(&format!("x{k}"), &format!("a.phi + x{}", (k + 1) % n)))),
    ("blocks in a circle", |n| {
        with(n, |k| block(&format!("x{k}"), "gain", &format!("x{}", (k + 1) % n), "gain = 0.5\nunit = \"rad\""))
    }),
];

/// Entries that speak against each other, which each of them tells in a message of its own.
pub const REFUSED: &[Kind] = &[
    ("events at one time", |n| {
        with(n, |_| "[[scenario.event]]\nat = \"1 ms\"\nsignal = \"m.tau\"\nto = \"1 N m\"\n\n".into())
    }),
    ("signals that are not there", |n| {
        with(n, |k| format!("[[requirement]]\nsignal = \"b{k}.phi\"\nmeasure = \"max\"\nbelow = \"1 rad\"\n\n"))
    }),
    ("figures in a circle", |n| with(n, |k| format!("[[figure]]\nname = \"x{k}\"\nvalue = \"x{}\"\n\n", (k + 1) % n))),
    ("names that are not there", |n| with(n, |k| signal(&format!("x{k}"), &format!("nothing{k} + a.phi")))),
    ("parameters that are not there", |n| with(n, |k| format!("[disturbance.x{k}]\nshaft = \"b{k}\"\n\n"))),
];

/// Coupled bodies: the linear algebra of their equations takes longer than a number of times as many.
pub const COUPLED: &[Kind] = &[
    ("masses", |n| with(n, |k| format!("[mass.x{k}]\nmass = \"1 kg\"\n\n"))),
    ("states", |n| with(n, |k| format!("[state.x{k}]\nrate = \"1 Hz * sin(a.phi)\"\n\n"))),
    ("shafts", |n| with(n, |k| format!("[shaft.x{k}]\ninertia = \"1 kg m^2\"\n\n"))),
    ("gears in a chain", |n| {
        let gear = |k: usize| {
            let own = format!("[shaft.x{k}]\ninertia = \"1 kg m^2\"\n\n[gear.g{k}]\n");
            own + &format!("shaft_1 = \"{}\"\nshaft_2 = \"x{k}\"\nratio = 1\n\n", before(k, "a"))
        };
        with(n, gear)
    }),
    ("springs in a chain", |n| {
        let spring = |k: usize| {
            let own = format!("[shaft.x{k}]\ninertia = \"1 kg m^2\"\n\n[spring_damper.g{k}]\n");
            own + &format!("shaft_1 = \"{}\"\nshaft_2 = \"x{k}\"\nstiffness = \"1 N m/rad\"\n\n", before(k, "a"))
        };
        with(n, spring)
    }),
];

/// A machine in which seven ways lead out of each state.
fn machine(states: usize) -> String {
    let names: Vec<String> = (0..states).map(|k| format!("\"s{k}\"")).collect();
    let way = |k: usize, step: usize| {
        let when = format!("a.phi > {} rad and a.phi < {} rad", 10 * step + k % 7, 10 * step + k % 7 + 5);
        format!("{{ from = \"s{k}\", to = \"s{}\", when = \"{when}\" }},\n", (k + step) % states)
    };
    let ways: String = (0..states).flat_map(|k| (1..8).map(move |step| way(k, step))).collect();
    let keys = format!("kind = \"state_machine\"\nsample_time = \"1 ms\"\nstates = [{}]\n", names.join(", "));
    format!("{BODY}[block.x]\n{keys}transitions = [\n{ways}]\n")
}

/// Texts within texts, so deep: what a reader follows into.
pub const NESTED: &[Kind] = &[
    ("lists in lists", |n| format!("{BODY}[parameters]\nx = {}{}\n", "[".repeat(n), "]".repeat(n))),
    ("tables in tables", |n| format!("{BODY}[parameters]\nx = {}1{}\n", "{ x = ".repeat(n), " }".repeat(n))),
    ("keys in keys", |n| format!("{BODY}[parameters{}]\nx = 1\n", ".x".repeat(n))),
    ("parentheses", |n| format!("{BODY}{}", signal("x", &format!("{}a.phi{}", "(".repeat(n), ")".repeat(n))))),
    ("functions of functions", |n| {
        format!("{BODY}{}", signal("x", &format!("{}a.phi{}", "sin(".repeat(n), ")".repeat(n))))
    }),
    ("signs", |n| format!("{BODY}{}", signal("x", &format!("{}a.phi", "-".repeat(n))))),
    ("powers", |n| format!("{BODY}{}", signal("x", &format!("2{}", "^1".repeat(n))))),
    ("terms", |n| format!("{BODY}{}", signal("x", &format!("a.phi{}", " + a.phi".repeat(n))))),
    ("factors", |n| format!("{BODY}{}", signal("x", &format!("a.phi{}", " * 2".repeat(n))))),
    ("conditions", |n| {
        format!("{BODY}{}", signal("x", &format!("if(a.phi > 0 rad{}, 1, 0)", " and a.phi > 0 rad".repeat(n))))
    }),
];
