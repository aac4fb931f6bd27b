//! Faults during a run: sensors, motors, control units.

use std::sync::Arc;

use kardan_expr::expr::{Graph, OfTime, Part, Pieces};
use kardan_math::units::Dimension;
use kardan_mechanics::assemble::Weakened;
use kardan_mechanics::reduce::Reduced;
use kardan_results::signal_name::SignalName;

/// The fault of a sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SensorFaultKind {
    /// It outputs no number (NaN).
    Lost,
    /// It keeps its last reading.
    Stuck,
    /// Its reading has this offset, SI.
    Offset(f64),
    /// Its reading drifts at this rate, SI per second.
    Drift(f64),
    /// White Gaussian noise of that standard deviation is added to each reading, SI.
    Noise(f64),
    /// It reads with the opposite sign.
    Reversed,
}

/// The fault of a motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MotorFaultKind {
    /// Its torque is scaled by this factor: zero where it is dead, negative where it is reversed.
    Scaled(f64),
    /// It has no torque but brakes, N m s/rad: its windings are short-circuited.
    Braking(f64),
    /// Its supply is low: its torque limit is scaled by this factor.
    Undervoltage(f64),
    /// Its torque stays at the value at the begin of the fault.
    Stuck,
}

/// The fault of a spring, or of elastic teeth; permanent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MechanicalFaultKind {
    /// Spring and damper have no torque any more.
    Broken,
    /// The relaxed angle changes by this much, SI: teeth jump, a hub slips.
    Jump(f64),
}

/// The fault of a control unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum UnitFaultKind {
    /// It computes nothing and commands zero, then restarts.
    Reset,
    /// It computes no new commands; its last commands remain.
    Missed,
    /// New sensor readings do not arrive: it computes with the last ones.
    Stale,
    /// Its commands are delayed by a random time between zero and this, s.
    Jitter(f64),
}

/// A fault in a window of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Failing<Kind> {
    /// The sensor or the signal that is read (`wg_encoder`, `rk.phi`), the motor, or the controller.
    pub name: String,
    /// The kind of fault.
    pub kind: Kind,
    /// Begin, s.
    pub at: f64,
    /// End, s; infinite if it does not end.
    pub until: f64,
}

impl<Kind> Failing<Kind> {
    /// Whether it is active at a time.
    pub fn is_active(&self, time: f64) -> bool {
        (self.at..self.until).contains(&time)
    }

    /// Whether both are active at some time.
    pub fn overlaps<Other>(&self, other: &Failing<Other>) -> bool {
        other.at < self.until && self.at < other.until
    }
}

/// Adds faults of parts; the name of a part for which two of them would be active at the same time, if there is one.
fn add<Kind: Clone>(
    declared: &mut Vec<Failing<Kind>>,
    added: &[Failing<Kind>],
    is_same: impl Fn(&Failing<Kind>, &Failing<Kind>) -> bool,
) -> Result<(), String> {
    for fault in added {
        if let Some(existing) = declared.iter().find(|existing| is_same(existing, fault) && fault.overlaps(existing)) {
            return Err(existing.name.clone());
        }
        declared.push(fault.clone());
    }
    Ok(())
}

/// Zero, and from each of some times on another number.
pub(super) fn in_steps(name: String, steps: impl IntoIterator<Item = (f64, f64)>) -> Option<OfTime> {
    let mut graph = Graph::default();
    let time = graph.new_symbol("t".into(), Dimension::TIME);
    let symbol = graph.new_symbol(name.clone(), Dimension::NONE);
    let pieces = Pieces::new(steps.into_iter().map(|(at, value)| (at, [value, 0.0, 0.0, 0.0])));
    let part = Part { name, dimension: Dimension::NONE, pieces, reported: false };
    OfTime::new(graph, time, vec![(symbol, Arc::new(part))], symbol, Dimension::NONE)
}

/// A sensor of sampled controllers that fails.
pub type SensorFault = Failing<SensorFaultKind>;
/// A motor that fails.
pub type MotorFault = Failing<MotorFaultKind>;
/// A fault of a spring, a damper or elastic teeth.
pub type MechanicalFault = Failing<MechanicalFaultKind>;
/// A controller with a sample time whose unit fails.
pub type UnitFault = Failing<UnitFaultKind>;

impl SensorFault {
    /// Whether it is a fault of the signal that a controller reads under this name.
    ///
    /// ```
    /// use kardan_simulate::{SensorFault, SensorFaultKind};
    /// let fault = SensorFault { name: "wg_encoder".into(), kind: SensorFaultKind::Lost, at: 0.5, until: 0.6 };
    /// assert!(fault.concerns("wg_encoder.phi") && !fault.concerns("cs_encoder.phi"));
    /// ```
    pub fn concerns(&self, signal: &str) -> bool {
        self.name == signal || self.name == SignalName::new(signal).element
    }
}

/// All faults of a run; each part has at most one at a time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Faults {
    /// Sensors of sampled controllers.
    pub sensors: Vec<SensorFault>,
    /// Motors.
    pub motors: Vec<MotorFault>,
    /// Units of sampled controllers.
    pub units: Vec<UnitFault>,
    /// Springs and dampers.
    pub mechanics: Vec<MechanicalFault>,
}

impl Faults {
    /// When a fault begins or ends, s.
    pub fn times(&self) -> impl Iterator<Item = f64> {
        fn of<Kind>(faults: &[Failing<Kind>]) -> impl Iterator<Item = f64> {
            faults.iter().flat_map(|fault| [fault.at, fault.until])
        }
        of(&self.sensors).chain(of(&self.motors)).chain(of(&self.units)).chain(of(&self.mechanics))
    }

    /// Whether there are no faults.
    pub fn is_empty(&self) -> bool {
        self.times().next().is_none()
    }

    /// These and others; the part for which two of them would be active at the same time, if there is one.
    ///
    /// # Errors
    /// Such a part, by its name.
    pub fn with(&self, added: &Self) -> Result<Self, String> {
        let mut out = self.clone();
        add(&mut out.sensors, &added.sensors, |a, b| a.concerns(&b.name) || b.concerns(&a.name))?;
        add(&mut out.motors, &added.motors, |a, b| a.name == b.name)?;
        add(&mut out.units, &added.units, |a, b| a.name == b.name)?;
        add(&mut out.mechanics, &added.mechanics, |a, b| a.name == b.name)?;
        Ok(out)
    }

    /// The equations with the faults of springs and dampers; `None` if there are none.
    pub fn weakened(&self, reduced: &Reduced) -> Option<Reduced> {
        if self.mechanics.is_empty() {
            return None;
        }
        let mut out = reduced.clone();
        for fault in &self.mechanics {
            let own: &mut Weakened = out.equations.failing.entry(fault.name.clone()).or_default();
            let step = |what: &str, value: f64| in_steps(format!("{}.{what}", fault.name), [(fault.at, value)]);
            match fault.kind {
                MechanicalFaultKind::Broken => own.share = step("share", -1.0).map(Arc::new),
                MechanicalFaultKind::Jump(by) => own.moved = step("jump", by).map(Arc::new),
            }
        }
        Some(out)
    }

    /// The faults of springs and teeth that begin at a time, as text.
    pub fn mechanics_at(&self, time: f64) -> Vec<String> {
        let describe = |fault: &MechanicalFault| match fault.kind {
            MechanicalFaultKind::Broken => format!("{} breaks", fault.name),
            MechanicalFaultKind::Jump(by) => format!("{} jumps by {by}", fault.name),
        };
        self.mechanics.iter().filter(|fault| fault.at == time).map(describe).collect()
    }

    /// The events, with their times: each begin and each end.
    pub fn events(&self) -> Vec<(f64, String)> {
        let mut out = Vec::new();
        let mut add = |name: &str, at: f64, until: f64, what: &str| {
            out.push((at, format!("{name} {what}")));
            out.push((until, format!("{name} works again")));
        };
        for fault in &self.sensors {
            let what = match fault.kind {
                SensorFaultKind::Lost => "supplies no reading",
                SensorFaultKind::Stuck => "keeps its last reading",
                SensorFaultKind::Offset(_) => "reads with an offset",
                SensorFaultKind::Drift(_) => "begins to drift",
                SensorFaultKind::Noise(_) => "becomes noisy",
                SensorFaultKind::Reversed => "reads with the opposite sign",
            };
            add(&fault.name, fault.at, fault.until, what);
        }
        for fault in &self.motors {
            let what = match fault.kind {
                MotorFaultKind::Scaled(0.0) => "supplies no torque".to_string(),
                MotorFaultKind::Scaled(part) => format!("gives {part} of its torque"),
                MotorFaultKind::Braking(_) => "is short-circuited and brakes".into(),
                MotorFaultKind::Undervoltage(part) => format!("reaches {part} of its torque limit"),
                MotorFaultKind::Stuck => "keeps its torque and ignores commands".into(),
            };
            add(&fault.name, fault.at, fault.until, &what);
        }
        for fault in &self.units {
            let what = match fault.kind {
                UnitFaultKind::Reset => "is reset and commands zero",
                UnitFaultKind::Missed => "computes no new commands; its last commands remain",
                UnitFaultKind::Stale => "gets no new readings",
                UnitFaultKind::Jitter(_) => "commands with a varying delay",
            };
            add(&fault.name, fault.at, fault.until, what);
        }
        out
    }
}
