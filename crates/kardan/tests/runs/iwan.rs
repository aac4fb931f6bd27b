//! Coulomb sliders that springs without inertia couple (series Iwan chains and networks), against closed forms and their defining equations.

use crate::common::{close, run_by, signal, time_of};
use kardan::results::Run;
use kardan::simulate::Method;

const METHODS: [Method; 4] = [Method::Automatic, Method::Taylor, Method::Dop853, Method::Radau];

/// Elements in series: `x = F/k + Σ max(0, F − c_i)/k_i` while F grows from nothing.
struct Chain {
    first: f64,
    elements: &'static [(f64, f64)],
}

impl Chain {
    /// ```text
    ///   a ~~k~~ n0 ==(k0 ∥ c0)== n1 ==(k1 ∥ c1)== ... |
    /// ```
    fn model(&self) -> String {
        let spring = |name: &str, from: &str, to: &str, values: String| {
            format!("[spring_damper.{name}]\nshaft_1 = \"{from}\"\nshaft_2 = \"{to}\"\n{values}\n")
        };
        let mut model = spring("k", "a", "n0", format!("stiffness = \"{} N m/rad\"", self.first));
        for (i, (stiffness, friction)) in self.elements.iter().enumerate() {
            let to = if i + 1 == self.elements.len() { "ground".into() } else { format!("n{}", i + 1) };
            let values = format!("stiffness = \"{stiffness} N m/rad\"\nfriction = \"{friction} N m\"");
            model += &format!("[shaft.n{i}]\n");
            model += &spring(&format!("e{i}"), &format!("n{i}"), &to, values);
        }
        model
    }

    /// The angle of the first loading.
    fn angle(&self, torque: f64) -> f64 {
        torque / self.first + self.elements.iter().map(|(k, c)| (torque - c).max(0.0) / k).sum::<f64>()
    }

    /// The torque of the first loading: its angle grows with it piece by piece.
    fn torque(&self, angle: f64) -> f64 {
        let mut limits: Vec<f64> = self.elements.iter().map(|(_, c)| *c).collect();
        limits.sort_by(f64::total_cmp);
        let from = limits.into_iter().filter(|c| self.angle(*c) <= angle).fold(0.0, f64::max);
        let soft: f64 = self.elements.iter().filter(|(_, c)| *c <= from).map(|(k, _)| 1.0 / k).sum();
        from + (angle - self.angle(from)) / (1.0 / self.first + soft)
    }

    /// What a full cycle between torques of this size takes.
    fn area(&self, torque: f64) -> f64 {
        self.elements.iter().map(|(k, c)| 4.0 * c * (torque - c).max(0.0) / k).sum()
    }
}

const CHAINS: [Chain; 2] = [
    Chain { first: 100.0, elements: &[(80.0, 0.2), (50.0, 0.5)] },
    Chain { first: 90.0, elements: &[(60.0, 0.9), (120.0, 0.3), (40.0, 0.6)] },
];

const AMPLITUDE: f64 = 1.5;

fn scenario(duration: f64, rows: u32, more: &str) -> String {
    format!(
        "[scenario]\nduration = \"{duration} s\"\noutput_step = \"{} s\"\nrelative_tolerance = 1e-11\n{more}\n",
        duration / f64::from(rows)
    )
}

/// Torque against angle: the first loading, then each half cycle from its turning point twice as long (Masing).
fn follows_masing(chain: &Chain, run: &Run, top: f64, tolerance: f64) {
    let most = chain.torque(top);
    for (row, time) in run.series.time.iter().enumerate() {
        let x = signal(run, "a.phi")[row];
        let expected = match *time {
            time if time <= 0.25 => chain.torque(x),
            // From the turning points at +A and −A.
            time if ((time - 0.25) / 0.5).floor() % 2.0 == 0.0 => most - 2.0 * chain.torque((top - x) / 2.0),
            _ => 2.0 * chain.torque((top + x) / 2.0) - most,
        };
        close(signal(run, "k.tau")[row], expected, tolerance, &format!("torque at {time}"));
    }
}

/// Driven along a sine by a prescribed angle: hysteresis, its area and each first slip in closed form.
#[test]
fn prescribed_chain_follows_masing() {
    for chain in &CHAINS {
        let top = chain.angle(AMPLITUDE);
        let drive = format!(
            "[shaft.a]\ninertia = \"1 kg m^2\"\n[prescribed_motion.drive]\nshaft = \"a\"\nangle = \"{top} rad * sin(2 * pi * 1 rad/s * t)\"\n"
        );
        let drive = drive.replace("2 * pi * 1 rad/s * t", "2 * pi * t / 1 s");
        let model = chain.model() + &drive + &scenario(2.25, 180, "");
        for method in METHODS {
            let run = run_by(&model, method, None);
            follows_masing(chain, &run, top, 1e-9);
            // A quarter of the first loading takes a quarter of a cycle between zero and the top: c (F − c)/k.
            let area = chain.area(AMPLITUDE);
            close(run.energy.dissipated, 2.25 * area, 1e-9, "the areas of two loops and the first loading");
            assert!(run.energy.residual.abs() <= 1e-9 * run.energy.dissipated, "{method:?} {:?}", run.energy);
            for (i, (_, c)) in chain.elements.iter().enumerate() {
                let begins = (chain.angle(*c) / top).asin() / std::f64::consts::TAU;
                close(time_of(&run, &format!("e{i} slips forward")), begins, 1e-9, "begins");
                let slips =
                    run.events.iter().filter(|event| event.description.starts_with(&format!("e{i} slips"))).count();
                assert_eq!(slips, 5, "{:?}", run.events);
            }
        }
    }
}

/// Swung by a large body on a spring of its own.
#[test]
fn swinging_chain_follows_masing() {
    let (inertia, omega) = (1e8, std::f64::consts::TAU);
    for chain in &CHAINS {
        let top = chain.angle(AMPLITUDE);
        let body = format!(
            "[shaft.a]\ninertia = \"{inertia} kg m^2\"\n[spring_damper.own]\nshaft_1 = \"a\"\nstiffness = \"{} N m/rad\"\n",
            inertia * omega * omega
        );
        let start = format!("initial = {{ \"a.w\" = \"{} rad/s\" }}", top * omega);
        let model = chain.model() + &body + &scenario(1.25, 100, &start);
        for method in METHODS {
            let run = run_by(&model, method, None);
            follows_masing(chain, &run, top, 1e-6);
            // Of the energy of the body: the loss itself is 1e-7 of it.
            assert!(run.energy.residual.abs() <= 1e-9 * 0.5 * inertia * (top * omega).powi(2), "{:?}", run.energy);
        }
    }
}

/// Two sliders on the ground joined by springs: the first drags the second, then both keep their torques.
///
/// ```text
///   a ~~s1~~ m1 ~~s2~~ m2        m1 and m2 rub on the ground with c1 and c2
/// ```
#[test]
fn joined_friction_elements_drag_each_other() {
    let (s1, s2, c1, c2, top) = (200.0, 80.0, 0.5, 0.7, 0.025);
    let node = |k: usize, from: &str, s: f64, c: f64| {
        format!(
            "[shaft.m{k}]\nfriction = \"{c} N m\"\n[spring_damper.s{k}]\nshaft_1 = \"{from}\"\nshaft_2 = \"m{k}\"\nstiffness = \"{s} N m/rad\"\n"
        )
    };
    let model = node(1, "a", s1, c1)
        + &node(2, "m1", s2, c2)
        + &format!(
            "[shaft.a]\ninertia = \"1 kg m^2\"\n[prescribed_motion.drive]\nshaft = \"a\"\nangle = \"{top} rad * sin(pi * t / 1 s)\"\n"
        )
        + &scenario(1.0, 100, "");
    // While x grows.
    let both = (c1 + c2) / s1 + c2 / s2;
    let loading = |x: f64| match x {
        x if s1 * x <= c1 => [0.0, 0.0],
        x if x <= both => [(s1 * x - c1) / (s1 + s2), 0.0],
        x => [x - (c1 + c2) / s1, x - (c1 + c2) / s1 - c2 / s2],
    };
    let [m1, m2] = loading(top);
    assert!(m2 > 0.0);
    for method in METHODS {
        let run = run_by(&model, method, None);
        for (row, time) in run.series.time.iter().enumerate() {
            let x = signal(&run, "a.phi")[row];
            let mut expected = loading(x);
            if *time > 0.5 {
                // m1 goes back once s1 (x − m1) = s2 (m1 − m2) − c1; m2 stays while s2 (m1 − m2) is above −c2.
                let back = |x: f64| (s1 * x + s2 * m2 + c1) / (s1 + s2);
                expected = [m1.min(back(x)), m2];
                assert!(s2 * (expected[0] - m2) > -c2);
            }
            for (name, value) in [("m1.phi", expected[0]), ("m2.phi", expected[1])] {
                close(signal(&run, name)[row], value, 1e-10, &format!("{name} at {time}"));
            }
        }
        assert!(run.energy.residual.abs() <= 1e-9 * run.energy.dissipated, "{:?}", run.energy);
    }
}

/// Networks of bodies and sliders: torques balance where nothing has an inertia, each is within its friction and at it against the motion where
/// it slips, and the energy closes; all methods agree.
#[test]
fn networks_satisfy_their_defining_equations() {
    let mut seed = 7u64;
    let mut random = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64
    };
    for network in 0..8 {
        let count = 2 + network;
        let mut model = "[shaft.a]\ninertia = \"0.4 kg m^2\"\n[shaft.b]\ninertia = \"0.7 kg m^2\"\n\
            [spring_damper.own]\nshaft_1 = \"b\"\nstiffness = \"9 N m/rad\"\n"
            .to_string();
        // What acts on each node, and what each rubs on.
        let mut acts = vec![Vec::new(); count];
        let mut on = Vec::new();
        let mut tie = |model: &mut String, name: String, (from, to): (usize, &str), value: String| {
            *model += &format!("[spring_damper.{name}]\nshaft_1 = \"m{from}\"\nshaft_2 = \"{to}\"\n{value}\"\n");
            let column = if name.starts_with('f') { "friction" } else { "tau" };
            acts[from].push((format!("{name}.{column}"), 1.0));
            if let Some(to) = to.strip_prefix('m').and_then(|to| to.parse::<usize>().ok()) {
                acts[to].push((format!("{name}.{column}"), -1.0));
            }
        };
        for k in 0..count {
            model += &format!("[shaft.m{k}]\n");
            let rubs = match (random() * 3.0) as usize {
                0 if k > 0 => format!("m{}", k - 1),
                1 => "b".to_string(),
                _ => "ground".to_string(),
            };
            let [friction, stiffness, other] = [0.1 + random(), 5.0 + 40.0 * random(), 3.0 + 30.0 * random()];
            tie(&mut model, format!("f{k}"), (k, &rubs), format!("friction = \"{friction:.3} N m"));
            let body = if random() < 0.6 { "a" } else { "b" };
            tie(&mut model, format!("s{k}"), (k, body), format!("stiffness = \"{stiffness:.2} N m/rad"));
            if k > 0 {
                let back = (random() * k as f64) as usize;
                let value = format!("stiffness = \"{other:.2} N m/rad");
                tie(&mut model, format!("t{k}"), (k, &format!("m{back}")), value);
            }
            on.push(rubs);
        }
        model += &scenario(4.0, 80, "initial = { \"a.w\" = \"3 rad/s\", \"b.w\" = \"-1 rad/s\" }");
        let first = run_by(&model, Method::Taylor, None);
        let flows = first.energy.dissipated;
        assert!(flows > 0.1, "{model} {:?}", first.energy);
        for method in METHODS {
            let run = run_by(&model, method, None);
            assert!(run.energy.residual.abs() <= 1e-9 * flows, "{method:?} {:?}", run.energy);
            for k in 0..count {
                let friction = signal(&run, &format!("f{k}.friction"));
                let zero = vec![0.0; friction.len()];
                let [own, other] = [format!("m{k}"), on[k].clone()].map(|shaft| match shaft.as_str() {
                    "ground" => zero.clone(),
                    shaft => signal(&run, &format!("{shaft}.w")).to_vec(),
                });
                let c = friction.iter().fold(0.0f64, |most, x| most.max(x.abs()));
                for (row, friction) in friction.iter().enumerate() {
                    let all: f64 = acts[k].iter().map(|(name, sign)| sign * signal(&run, name)[row]).sum();
                    close(all, 0.0, 1e-9, &format!("balance of m{k}"));
                    let speed = own[row] - other[row];
                    if speed.abs() > 1e-10 {
                        close(*friction, c * speed.signum(), 1e-9, &format!("{method:?} friction of m{k}"));
                    }
                }
            }
            for (signal, other) in run.series.signals.iter().zip(&first.series.signals) {
                if signal.name.ends_with(".phi") {
                    signal.values.iter().zip(&other.values).for_each(|(x, y)| close(*x, *y, 1e-8, &signal.name));
                }
            }
        }
    }
}
