//! The element `vehicle`: a car as a single-track model.

use super::rack_and_pinion::points;
use super::shared::car_checks::{check_tyres, check_wheels, least};
use super::shared::composite::Composite;
use super::shared::spline::check_points;
use super::shared::straight::check_moves;
use super::{Element, KeyError};
use kardan_math::units::Dimension;
use kardan_results::Symbol;
use kardan_schema::entries::{Entries, RawValue};
use kardan_schema::schema::{ElementKeys, Keys, Sign, Values, keys};

/// Of a tyre, N/rad.
const CORNERING: Dimension = Dimension::mechanical(1, 1, -2, -1);

keys! {
    /// A car as a single-track vehicle.
    element Vehicle("vehicle") {
        required {
            mass: Quantity(Dimension::MASS, Sign::Positive), "Mass.";
            yaw_inertia: Quantity(Dimension::INERTIA, Sign::Positive), "Moment of inertia about the vertical axis.";
            front_axle: Quantity(Dimension::LENGTH, Sign::Positive), "Distance from the centre of gravity forward to the front axle.";
            rear_axle: Quantity(Dimension::LENGTH, Sign::Positive), "Distance from the centre of gravity back to the rear axle.";
            front_stiffness: Quantity(CORNERING, Sign::Positive),
                "Cornering stiffness of the front axle, both tyres: side force for each angle of slip at none (\"80 kN/rad\").";
            rear_stiffness: Quantity(CORNERING, Sign::Positive), "The same of the rear axle.";
            steered_by: Body, "The rack, a mass, or the shaft that turns the front wheels; the road forces on the wheels act back on it.";
            speed: Formula(Dimension::VELOCITY),
                "Forward speed, zero or more: a number, or an expression of the time, signals, and velocities of the model.";
        }
        optional {
            steering_arm: Quantity(Dimension::LENGTH, Sign::NonZero),
                "Travel of the rack for a radian at the wheels (\"140 mm\"); needed where a mass steers, or `curve`.";
            steering_ratio: Number(Sign::NonZero), "Angle of the shaft over that of the wheels; needed where a shaft steers.";
            curve: Tables(WheelPoint), "Positions of the rack by angles of the wheels, in place of `steering_arm`: a smooth curve through them.";
            tyre: Choice(&["linear", "magic_formula", "tmeasy"]) = "linear",
                "The side force over the slip angle. `linear` uses small wheel angles, and its force has no limit; `magic_formula` is mu Fz sin(C \
                 atan(B a - E (B a - atan(B a)))), with B such that the slope is the stiffness, and exact angles; `tmeasy` rises over the tangent \
                 of the slip angle from that slope to the peak mu Fz at `peak_slip`, and falls from there to the sliding force.";
            shape: Number(Sign::Positive) = "1.3", "C of the Magic Formula.";
            curvature: Number(Sign::Any) = "0", "E of the Magic Formula, at most one.";
            peak_slip: Number(Sign::Positive),
                "With `tmeasy`: tangent of the slip angle at the largest side force, at mu = 1 and the static load; it scales with friction and \
                 load as the force does. At least twice that force over the stiffness; left out: three times.";
            slide_slip: Number(Sign::Positive), "The same from which the tyre slides, above `peak_slip`; left out: three times that.";
            slide_factor: Number(Sign::Positive) = "0.9", "With `tmeasy`: force of the sliding tyre over the largest one, at most one.";
            mu: Formula(Dimension::NONE),
                "Friction between tyres and road, above 0, at most 2: a number, a signal, or an expression of the time; needed with `magic_formula`, `tmeasy`, \
                 `braking` and `bore_torque`.";
            mu_rear: Formula(Dimension::NONE), "The same of the rear axle; left out: `mu`.";
            mu_left: Formula(Dimension::NONE), "The same of the wheels on the left, in place of `mu`; needs `mu_right` and `track`.";
            mu_right: Formula(Dimension::NONE), "The same of the wheels on the right.";
            braking: Formula(Dimension::FORCE),
                "Requested braking force of all wheels, zero or more. It does not change `speed`: let that fall by this force over the mass. A \
                 wheel brakes with at most its friction times its load. Left out: none.";
            brake_share: Number(Sign::NonNegative), "Part of it on the front axle, at most one; left out: in proportion to the axle loads.";
            scrub_radius: Quantity(Dimension::LENGTH, Sign::Any) = "0 m",
                "Scrub radius: distance of the front tyre contacts outside of their king-pin axes; unequal braking forces steer by it.";
            height: Quantity(Dimension::LENGTH, Sign::Positive),
                "Height of the centre of gravity: with it braking loads the front axle and cornering the outer wheels; needs `track`. Left out: \
                 loads stay at their static values.";
            roll_share: Number(Sign::NonNegative),
                "Part of the lateral load transfer in cornering on the front axle, at most one; left out: in proportion to the static axle loads.";
            roll_stiffness: Quantity(Dimension::STIFFNESS, Sign::Positive),
                "Torque for each radian of roll, of springs and stabilisers of both axles: with it the car rolls, and the load transfer to the \
                 outer wheels follows the roll; needs `height`, `roll_inertia` and `roll_damping`. Left out: it does not roll.";
            roll_damping: Quantity(Dimension::DAMPING, Sign::NonNegative), "Torque for each radian per second of roll, of the dampers of both axles.";
            roll_inertia: Quantity(Dimension::INERTIA, Sign::Positive), "Inertia about the longitudinal axis through the centre of gravity.";
            roll_height: Quantity(Dimension::LENGTH, Sign::Any) = "0 m", "Height of the roll axis.";
            load_sensitivity: Number(Sign::NonNegative) = "0",
                "Fraction by which friction falls when the load of a wheel doubles, below one.";
            relaxation_length: Quantity(Dimension::LENGTH, Sign::Positive),
                "Distance that a tyre rolls until its force reaches 63 % of its new value. With it standstill is allowed. Left out: the force \
                 follows without lag, and the speed has to stay above zero.";
            caster_trail: Quantity(Dimension::LENGTH, Sign::Any) = "0 m",
                "Distance of the front tyre contacts behind their king-pin axis.";
            pneumatic_trail: Quantity(Dimension::LENGTH, Sign::NonNegative) = "0 m",
                "Distance of the side force of the front tyres behind the middle of the contact patch, at small slip; with `magic_formula` it falls \
                 with the slip angle as cos(atan(B a)).";
            wheel_inertia: Quantity(Dimension::INERTIA, Sign::NonNegative) = "0 kg m^2", "Inertia of both front wheels about their king-pins.";
            bore_torque: Quantity(Dimension::TORQUE, Sign::Positive),
                "Torque of both front tyres turning at standstill, at mu = 1; needs `bore_stiffness`. Left out: none.";
            bore_stiffness: Quantity(Dimension::STIFFNESS, Sign::Positive), "Torque for each radian below that torque.";
            centring: Quantity(Dimension::STIFFNESS, Sign::NonNegative),
                "Torque for each radian at the wheels by which the weight of the car centres them (king-pin inclination). Left out: none.";
            wind: Formula(Dimension::FORCE), "Side force of the wind, to the left. Left out: none.";
            wind_arm: Quantity(Dimension::LENGTH, Sign::Any) = "0 m", "Distance of that force in front of the centre of gravity.";
            cross_slope: Formula(Dimension::NONE), "Rise of the road to the left for each metre. Left out: level.";
            track: Quantity(Dimension::LENGTH, Sign::Positive), "Distance between left and right wheels, for the speeds and the loads of the four.";
        }
    }
}

keys! {
    /// A point of the curve of a steering gear.
    table WheelPoint {
        required {
            angle: Quantity(Dimension::ANGLE, Sign::Any), "Angle of the front wheels.";
            position: Quantity(Dimension::LENGTH, Sign::Any), "Position of the rack there.";
        }
    }
}

pub(super) const VEHICLE: Element = Element {
    keyword: Vehicle::KEYWORD,
    summary: "A car on a road as a single-track vehicle, from standstill on, with linear tyres, the Magic Formula or TMeasy, and brakes: it is \
              steered by a mass or a shaft, and its forces act back on that.",
    sketch: r"
                 x (forward)             front wheels, delta >0: to the left
      y <--.     |      .-----------------(//)
           |  yaw >0    |   front_axle     |
           '-----(+)----'                  |  steering_arm, steering_ratio, curve
                  |   rear_axle          [steered_by]
                 (||)  rear wheels",
    signs: "ISO 8855: x forward, y to the left, yaw and wheels positive to the left, forces on the car positive to the left. Its parts are elements \
            that others may name: the mass `<name>_lateral` (`.v`: lateral velocity), the shafts `<name>_yaw` (`.phi`: heading, `.w`: yaw rate) and \
            `<name>_wheel` (angle of the front wheels), the gear `<name>_steering` with the force on the steering mass or shaft, the torques \
            `<name>_side` and `<name>_side_rear` of the tyres, states `<name>_front`, `<name>_rear` (tangent of the slip angle) and `<name>_bore` \
            (twist). Blocks and programs read `<name>.yaw_rate`, `.heading`, `.v_x`, `.v_y`, `.a_y`, `.x`, `.y` (of the centre of gravity), with \
            roll `.roll` and `.roll_rate` (shaft `<name>_roll`, to the right in a left turn), and with `track` the speeds of the wheels `.v_fl`, \
            `.v_fr`, `.v_rl`, `.v_rr`. Frictions given as signals or expressions are `.friction`, `.friction_rear`, `.friction_left` and \
            `.friction_right`. With separate wheels there are `.load_fl` and so on, `.grip_front` and `.grip_rear` (largest side forces), \
            `.braking_fl` and so on (backward), `.braking_left`, `.braking_right`, `.braking_lack` (requested less delivered braking force); of \
            TMeasy `.slip_front`, `.slip_rear` (slip over that of the peak).",
    symbol: Symbol::Vehicle,
    fields: Vehicle::FIELDS,
    example: "\
[vehicle.car]
mass = \"1500 kg\"
yaw_inertia = \"2500 kg m^2\"
front_axle = \"1.2 m\"
rear_axle = \"1.5 m\"
front_stiffness = \"90 kN/rad\"
rear_stiffness = \"110 kN/rad\"
steered_by = \"column\"
steering_ratio = 16
speed = \"30 m/s\"
relaxation_length = \"0.5 m\"
caster_trail = \"25 mm\"
pneumatic_trail = \"35 mm\"
",
    check,
    terms: |_, _| Vec::new(),
};

fn check(values: &Values) -> Vec<KeyError> {
    let mut out =
        [check_moves(values, &["steered_by"]), check_steering(values), check_tyres(values), check_wheels(values)]
            .concat();
    match values.formula("speed").and_then(|formula| least(formula)) {
        Some((what, least)) if least < 0.0 => {
            let message = format!("{what} is {least} m/s: this car does not drive backwards");
            out.push(KeyError::new("speed", message, "keep the speed at zero or more, `max(0 m/s, ...)`"));
        }
        Some((what, 0.0)) if !values.has("relaxation_length") => {
            let message = format!("{what} is 0 m/s, and a tyre without relaxation has no slip angle at standstill");
            out.push(KeyError::new("speed", message, "give the tyres a `relaxation_length`, such as \"0.5 m\""));
        }
        _ => {}
    }
    out
}

fn check_steering(values: &Values) -> Vec<KeyError> {
    let all: &[&'static str] = &["steering_arm", "steering_ratio", "curve"];
    let ways: Vec<&'static str> = all.iter().copied().filter(|key| values.has(key)).collect();
    let mass = values.translational;
    let mut out = match ways[..] {
        [first, second, ..] => {
            vec![KeyError::new(second, format!("both `{first}` and `{second}` are given"), "keep one of them")]
        }
        [] if mass => vec![KeyError::new(
            "steered_by",
            "no key defines the travel of the rack for an angle of the wheels",
            "add `steering_arm = \"140 mm\"`, or points of a `curve`",
        )],
        [] => vec![KeyError::new(
            "steered_by",
            "no key defines the angle of the shaft for an angle of the wheels",
            "add `steering_ratio = 16`",
        )],
        ["steering_ratio"] if mass => vec![KeyError::new(
            "steering_ratio",
            "a ratio is between two angles, and a mass steers",
            "write `steering_arm`, the travel of the rack for a radian at the wheels",
        )],
        [key] if !mass && key != "steering_ratio" => {
            vec![KeyError::new(key, "a shaft steers, which has no travel", "write `steering_ratio`")]
        }
        _ => Vec::new(),
    };
    out.extend(points(values).map(|points| check_points("curve", &points)).unwrap_or_default());
    out
}

/// The tables that a car expands to, by the keys of a model file; none if a required key is missing.
pub(super) fn parts(name: &str, entries: &Entries, steered_by_mass: bool) -> Option<Entries> {
    let needed = Vehicle::FIELDS.iter().filter(|field| field.required);
    if needed.into_iter().any(|field| entries.keyed(field.name).is_none()) {
        return None;
    }
    let car = Composite { name, entries };
    let mut out = Entries::default();
    car.body(&mut out);
    car.steering(&mut out, steered_by_mass);
    car.tyres(&mut out);
    car.wheel_forces(&mut out);
    car.brakes(&mut out);
    car.outside(&mut out);
    car.readings(&mut out);
    Some(out)
}

impl Composite<'_> {
    /// The moving parts; the lateral velocity is in axes that rotate with the car.
    fn body(&self, out: &mut Entries) {
        self.add(out, "mass", "lateral", &[("mass", self.own("mass"))]);
        self.add(out, "shaft", "yaw", &[("inertia", self.own("yaw_inertia"))]);
        self.add(out, "shaft", "wheel", &[("inertia", self.own("wheel_inertia"))]);
        let law = format!("-{} * {} * {}", self.own("mass"), self.speed(), self.of("yaw", "w"));
        self.push(out, "turning", &[("lateral", "1".into())], law);
        if self.rolls() {
            self.add(out, "shaft", "roll", &[("inertia", self.own("roll_inertia"))]);
            // The weight beside the axis increases the roll.
            let weight = format!("{} * 9.80665 m/s^2 * {} / (1 rad)", self.own("mass"), self.roll_arm());
            let keys = [
                ("shaft_1", self.part("roll")),
                ("stiffness", format!("{} - {weight}", self.own("roll_stiffness"))),
                ("damping", self.own("roll_damping")),
            ];
            self.add(out, "spring_damper", "suspension", &keys);
        }
    }

    /// A tyre force, which acts at the roll axis, under the centre of gravity.
    pub(in crate::element) fn at_tyres(&self) -> Vec<(&'static str, String)> {
        let roll = self.rolls().then(|| ("roll", self.roll_arm()));
        [("lateral", "1".to_string())].into_iter().chain(roll).collect()
    }

    fn steering(&self, out: &mut Entries, by_mass: bool) {
        let steered_by = self.entries.text("steered_by").unwrap_or_default().to_string();
        let wheel = self.part("wheel");
        if !by_mass {
            let keys = [("shaft_1", steered_by), ("shaft_2", wheel), ("ratio", self.own("steering_ratio"))];
            return self.add(out, "gear", "steering", &keys);
        }
        let mut keys = vec![("pinion", wheel), ("rack", steered_by)];
        if !self.has("curve") {
            keys.push(("radius", self.own("steering_arm")));
        }
        self.add(out, "rack_and_pinion", "steering", &keys);
        if let Some(points) = self.entries.get("curve") {
            let tables = out.table_mut("rack_and_pinion");
            tables.table_mut(&self.part("steering")).set("curve", points.clone());
        }
    }

    /// Lateral and forward velocity of the wheels of an axle along their own axes.
    fn slips(&self, front: bool) -> [String; 2] {
        let [u, v, r] = [self.speed(), self.at_axis(), self.of("yaw", "w")];
        let [delta, turn, trail] = [self.of("wheel", "phi"), self.of("wheel", "w"), self.own("caster_trail")];
        let [a, b] = [self.own("front_axle"), self.own("rear_axle")];
        match (front, self.slides()) {
            (false, _) => [format!("({v} - {b} * {r})"), u],
            (true, false) => [format!("({v} + {a} * {r} - {u} * {delta} - {trail} * {turn})"), u],
            (true, true) => {
                // Of the intersection of the king-pin axis with the road.
                let across = format!("({v} + ({a} + {trail}) * {r})");
                let lateral = format!("({across} * cos({delta}) - {u} * sin({delta}) - {trail} * ({r} + {turn}))");
                [lateral, format!("({u} * cos({delta}) + {across} * sin({delta}))")]
            }
        }
    }

    /// The slip angle of an axle (of TMeasy its tangent), and the state that defines it.
    fn slip_angle(&self, axle: &str) -> (String, Option<String>) {
        let [lateral, forward] = self.slips(axle == "front");
        let (tangent, rate) = if self.has("relaxation_length") {
            let z = self.of(axle, "z");
            let size = if self.slides() { format!("abs({forward})") } else { forward };
            let rate = format!("({lateral} - {size} * {z}) / {}", self.own("relaxation_length"));
            (z, Some(rate))
        } else {
            (format!("{lateral} / {forward}"), None)
        };
        (if self.slides() && !self.tmeasy() { format!("atan({tangent})") } else { tangent }, rate)
    }

    /// The largest side force of an axle.
    fn most(&self, axle: &str) -> String {
        if self.wheels() {
            return self.own(&format!("grip_{axle}"));
        }
        format!("{} * {}", self.friction(axle), self.load(axle))
    }

    /// The side force of an axle, and B times its slip angle.
    fn force(&self, axle: &str) -> (String, String) {
        let (angle, stiffness) = (self.slip_angle(axle).0, self.own(&format!("{axle}_stiffness")));
        if !self.slides() {
            return (format!("(-{stiffness} * {angle})"), String::new());
        }
        let most = self.most(axle);
        if self.tmeasy() {
            return (self.tmeasy_force(axle, &most), String::new());
        }
        let [c, e] = [self.own("shape"), self.own("curvature")];
        let ba = format!("({stiffness} * {angle} / ({c} * {most}))");
        (format!("(-{most} * sin({c} * atan({ba} - {e} * ({ba} - atan({ba})))))"), ba)
    }

    fn tyres(&self, out: &mut Entries) {
        for axle in ["front", "rear"] {
            if let (_, Some(rate)) = self.slip_angle(axle) {
                self.add(out, "state", axle, &[("rate", rate)]);
            }
        }
        if self.tmeasy() {
            self.share_slips(out, |axle| [self.slip_angle(axle).0, self.most(axle)]);
        }
        let (front, ba) = self.force("front");
        let [a, trail, pneumatic] = ["front_axle", "caster_trail", "pneumatic_trail"].map(|key| self.own(key));
        if self.slides() {
            let delta = self.of("wheel", "phi");
            let left = if self.tmeasy() { self.tmeasy_trail() } else { format!("cos(atan({ba}))") };
            let arm = format!("({trail} + {pneumatic} * {left})");
            self.push(out, "side", &self.at_tyres(), format!("{front} * cos({delta})"));
            let yaw = format!("{front} * (({a} + {trail}) * cos({delta}) - {arm})");
            self.add(out, "torque", "side_yaw", &[("shaft", self.part("yaw")), ("law", yaw)]);
            let aligning = format!("-{front} * {arm}");
            self.add(out, "torque", "aligning", &[("shaft", self.part("wheel")), ("law", aligning)]);
        } else {
            let arms = [("yaw", format!("{a} - {pneumatic}")), ("wheel", format!("-({trail} + {pneumatic})"))];
            self.push(out, "side", &[self.at_tyres(), arms.to_vec()].concat(), front);
        }
        let direction = [self.at_tyres(), vec![("yaw", format!("-{}", self.own("rear_axle")))]].concat();
        self.push(out, "side_rear", &direction, self.force("rear").0);
        self.bore(out);
    }

    /// The torque of steering at standstill: a bristle that deflects, slides at its limit, and relaxes as the tyre rolls.
    fn bore(&self, out: &mut Entries) {
        if self.has("centring") {
            let law = format!("-{} * {}", self.own("centring"), self.of("wheel", "phi"));
            self.add(out, "torque", "centring", &[("shaft", self.part("wheel")), ("law", law)]);
        }
        if !self.has("bore_torque") {
            return;
        }
        let (turn, z) = (format!("({} + {})", self.of("yaw", "w"), self.of("wheel", "w")), self.of("bore", "z"));
        let [stiffness, most] = [self.own("bore_stiffness"), self.own("bore_torque")];
        let rolled = format!("{} / {} * {z}", self.speed(), self.own("relaxation_length"));
        let slides = format!("abs({turn}) * {z} * {stiffness} / ({} * {most})", self.friction("front"));
        self.add(out, "state", "bore", &[("rate", format!("{turn} - {rolled} - {slides}"))]);
        let both = [("yaw", "1".to_string()), ("wheel", "1".to_string())];
        self.push(out, "boring", &both, format!("-{stiffness} * {z}"));
    }

    /// Wind and the road.
    fn outside(&self, out: &mut Entries) {
        if let Some(wind) = self.formula("wind") {
            self.push(out, "wind", &[("lateral", "1".into()), ("yaw", self.own("wind_arm"))], wind);
        }
        if let Some(weight) = self.downhill() {
            self.push(out, "slope", &[("lateral", "1".into())], weight);
        }
    }

    /// The weight component along a banked road.
    fn downhill(&self) -> Option<String> {
        let slope = self.formula("cross_slope")?;
        Some(format!("(-{} * 9.80665 m/s^2 * sin(atan({slope})))", self.own("mass")))
    }

    /// Signals of the car for blocks and programs.
    fn readings(&self, out: &mut Entries) {
        let [u, v, r] = [self.speed(), self.of("lateral", "v"), self.of("yaw", "w")];
        let axis = self.at_axis();
        let [psi, delta] = [self.of("yaw", "phi"), self.of("wheel", "phi")];
        let mut add = |name: &str, kind: &str, input: String| {
            let gain = (kind == "gain").then(|| ("gain", "1".to_string()));
            // The unit of the result contains no slip angle.
            let unit = (name == "a_y").then(|| ("unit", "m/s^2".to_string()));
            let keys = [("kind", kind.to_string()), ("input", input)].into_iter().chain(gain).chain(unit);
            let table = Entries::of_texts(keys);
            out.table_mut("block").set(&format!("{}.{name}", self.name), RawValue::Table(table));
        };
        add("yaw_rate", "gain", r.clone());
        add("heading", "gain", psi.clone());
        add("v_x", "gain", u.clone());
        add("v_y", "gain", v.clone());
        if self.rolls() {
            add("roll", "gain", self.of("roll", "phi"));
            add("roll_rate", "gain", self.of("roll", "w"));
        }
        let cosine = if self.slides() { format!(" * cos({delta})") } else { String::new() };
        let mut more: String =
            self.formula("wind").into_iter().chain(self.downhill()).map(|x| format!(" + {x}")).collect();
        more.extend(self.braked_aside().map(|x| format!(" - {x}")));
        let [front, rear] = ["front", "rear"].map(|axle| self.force(axle).0);
        add("a_y", "gain", format!("({front}{cosine} + {rear}{more}) / {}", self.own("mass")));
        self.frictions().into_iter().for_each(|(name, input)| add(name, "gain", input));
        self.braking_readings().into_iter().for_each(|(name, input)| add(name, "gain", input));
        add("x", "integrator", format!("{u} * cos({psi}) - {v} * sin({psi})"));
        add("y", "integrator", format!("{u} * sin({psi}) + {v} * cos({psi})"));
        if self.has("track") {
            let (half, a) = (format!("{} / 2 * {r}", self.own("track")), self.own("front_axle"));
            for (side, sign) in [("l", "-"), ("r", "+")] {
                let front = format!("({u} {sign} {half}) * cos({delta}) + ({axis} + {a} * {r}) * sin({delta})");
                add(&format!("v_f{side}"), "gain", front);
                add(&format!("v_r{side}"), "gain", format!("{u} {sign} {half}"));
            }
        }
    }
}
