//! The four wheels of a car: loads, braking forces and the remaining side forces.

use super::composite::Composite;
use kardan_schema::entries::Entries;

/// Names of axles and sides, with the letters of the wheels.
pub(in crate::element) const AXLES: [(&str, &str); 2] = [("front", "f"), ("rear", "r")];
const SIDES: [(&str, &str); 2] = [("left", "l"), ("right", "r")];

/// Least side force of a wheel over its static load: the slope of a root is infinite at zero.
const LEAST: &str = "0.000001";

impl Composite<'_> {
    /// Whether its wheels differ: in load, braking force or friction.
    pub(in crate::element) fn wheels(&self) -> bool {
        ["braking", "height", "mu_left", "mu_right"].into_iter().any(|key| self.has(key))
    }

    /// Whether left and right may differ.
    fn has_sides(&self) -> bool {
        self.has("track") && (self.has("height") || self.has("mu_left"))
    }

    fn weight(&self) -> String {
        format!("({} * 9.80665 m/s^2)", self.own("mass"))
    }

    /// The requested braking force, N.
    fn braking_force(&self) -> Option<String> {
        self.formula("braking").map(|braking_force| format!("max(0 N, {braking_force})"))
    }

    /// The load of an axle, N.
    fn axle_load(&self, axle: &str) -> String {
        if self.has("braking") && self.has("height") { self.own(&format!("load_{axle}")) } else { self.load(axle) }
    }

    /// Shared expressions of forces: loads, braking forces, and the largest side forces of the axles.
    pub(in crate::element) fn wheel_forces(&self, out: &mut Entries) {
        if !self.wheels() {
            return;
        }
        self.loads(out);
        if let Some(braking_force) = self.braking_force() {
            for (axle, f) in AXLES {
                let half = format!("({braking_force} * {} / 2)", self.brake_share(axle));
                for (l, (side, opposite)) in [("l", ("left", "right")), ("r", ("right", "left"))] {
                    let [own, rest] = [side, opposite].map(|side| self.limit(axle, side));
                    let value = format!("min({own}, max({half}, 2 * {half} - {rest}))");
                    self.share(out, &format!("braking_{f}{l}"), value);
                }
            }
        }
        let slides = if self.slides() { &AXLES[..] } else { &[] };
        for (axle, f) in slides {
            let left = |(side, l): (&str, &str)| {
                let limit = self.limit(axle, side);
                if !self.has("braking") {
                    return limit;
                }
                let least = format!("({} / 2 * {LEAST})^2", self.load(axle));
                format!("sqrt(max({least}, ({limit})^2 - {}^2))", self.own(&format!("braking_{f}{l}")))
            };
            self.share(out, &format!("grip_{axle}"), SIDES.map(left).join(" + "));
        }
    }

    /// Loads of axles and wheels.
    fn loads(&self, out: &mut Entries) {
        let (weight, [a, b]) = (self.weight(), ["front_axle", "rear_axle"].map(|key| self.own(key)));
        if let (Some(braking_force), true) = (self.braking_force(), self.has("height")) {
            // The requested force, limited to that of the tyres at static load.
            let [front, rear] = ["front", "rear"].map(|axle| format!("{} * {}", self.friction(axle), self.load(axle)));
            let moved = format!("min({braking_force}, {front} + {rear}) * {} / ({a} + {b})", self.own("height"));
            self.share(out, "load_front", format!("min({weight}, {} + {moved})", self.load("front")));
            self.share(out, "load_rear", format!("max(0 N, {} - {moved})", self.load("rear")));
        }
        for (axle, f) in AXLES {
            let load = self.axle_load(axle);
            for (l, sign) in [("l", "-"), ("r", "+")] {
                let half = format!("{load} / 2");
                let value = match self.has("height") && self.has("track") {
                    true => format!("min({load}, max(0 N, {half} {sign} {}))", self.moved_aside(axle)),
                    false => half,
                };
                self.share(out, &format!("load_{f}{l}"), value);
            }
        }
    }

    /// The load transfer from the left wheel of an axle to the right one in a left turn.
    fn moved_aside(&self, axle: &str) -> String {
        let [m, h, track] = ["mass", "height", "track"].map(|key| self.own(key));
        let at_rest = format!("{} / {}", self.load(axle), self.weight());
        let own = match (self.has("roll_share"), axle) {
            (true, "front") => self.own("roll_share"),
            (true, _) => format!("(1 - {})", self.own("roll_share")),
            (false, _) => at_rest.clone(),
        };
        let force = format!("{m} * {} * {}", self.speed(), self.of("yaw", "w"));
        if !self.rolls() {
            return format!("{force} * {h} / {track} * {own}");
        }
        // Springs and dampers transmit the roll moment, the links of the axles the forces at their height.
        let [c, d] = ["roll_stiffness", "roll_damping"].map(|key| self.own(key));
        let rolled = format!("({c} * {} + {d} * {})", self.of("roll", "phi"), self.of("roll", "w"));
        format!("({rolled} * {own} + {force} * {} * {at_rest}) / {track}", self.own("roll_height"))
    }

    /// The share of an axle in the requested braking force.
    fn brake_share(&self, axle: &str) -> String {
        match (self.has("brake_share"), axle) {
            (true, "front") => self.own("brake_share"),
            (true, _) => format!("(1 - {})", self.own("brake_share")),
            (false, _) => format!("({} / {})", self.axle_load(axle), self.weight()),
        }
    }

    /// The largest force of a wheel in any direction.
    fn limit(&self, axle: &str, side: &str) -> String {
        let load = self.own(&format!("load_{}{}", &axle[..1], &side[..1]));
        let friction = self.friction_of(axle, side);
        if !self.has("load_sensitivity") {
            return format!("{friction} * {load}");
        }
        let more = format!("(2 * {load} / {} - 1)", self.load(axle));
        format!("{friction} * max(0, 1 - {} * {more}) * {load}", self.own("load_sensitivity"))
    }

    /// Effects of braking: lateral force, yaw moment and moment about the king-pins.
    pub(in crate::element) fn brakes(&self, out: &mut Entries) {
        if !self.has("braking") {
            return;
        }
        let [fl, fr, rl, rr] = ["fl", "fr", "rl", "rr"].map(|wheel| self.own(&format!("braking_{wheel}")));
        let (delta, [a, trail]) = (self.of("wheel", "phi"), ["front_axle", "caster_trail"].map(|key| self.own(key)));
        let [sine, cosine] = match self.slides() {
            true => [format!("sin({delta})"), format!("cos({delta})")],
            false => [delta, "1".into()],
        };
        let mut yaw = format!("-({a} + {trail}) * {sine} * ({fl} + {fr})");
        if self.has_sides() {
            let (track, scrub) = (self.own("track"), self.own("scrub_radius"));
            let arm = format!("(({track} / 2 - {scrub}) * {cosine} + {scrub})");
            yaw = format!("{yaw} + {arm} * ({fl} - {fr}) + {track} / 2 * ({rl} - {rr})");
            if self.has("scrub_radius") {
                let law = format!("{scrub} * ({fl} - {fr})");
                self.add(out, "torque", "scrub", &[("shaft", self.part("wheel")), ("law", law)]);
            }
        }
        self.push(out, "braking", &self.at_tyres(), format!("-{}", self.braked_aside().unwrap_or_default()));
        self.add(out, "torque", "braking_yaw", &[("shaft", self.part("yaw")), ("law", yaw)]);
    }

    /// The component of the front braking force to the right while the front wheels are steered to the left.
    pub(in crate::element) fn braked_aside(&self) -> Option<String> {
        self.has("braking").then(|| {
            let delta = self.of("wheel", "phi");
            let side_factor = if self.slides() { format!("sin({delta})") } else { delta };
            format!("({} + {}) * {side_factor}", self.own("braking_fl"), self.own("braking_fr"))
        })
    }

    /// Signals of braking: names and expressions.
    pub(in crate::element) fn braking_readings(&self) -> Vec<(&'static str, String)> {
        let Some(braking_force) = self.braking_force() else { return Vec::new() };
        let side = |l: &str| ["f", "r"].map(|f| self.own(&format!("braking_{f}{l}"))).join(" + ");
        let [left, right] = ["l", "r"].map(side);
        let lack = format!("{braking_force} - ({left} + {right})");
        vec![("braking_left", left), ("braking_right", right), ("braking_lack", lack)]
    }
}
