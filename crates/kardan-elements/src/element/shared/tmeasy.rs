//! The side force of TMeasy (G. Rill, Road Vehicle Dynamics): a rational function up to its peak, then a cubic, then the sliding force.

use super::composite::Composite;
use super::wheels::AXLES;
use kardan_schema::entries::Entries;

/// Default peak slip over the slip at which the initial slope would reach the peak force.
pub(in crate::element) const PEAK: f64 = 3.0;
/// Default slip from which the tyre slides, over the peak slip.
pub(in crate::element) const SLIDE: f64 = 3.0;

impl Composite<'_> {
    /// The initial slope times the peak slip, over the peak force: while friction and load change, the peak slip is proportional to the force.
    fn steepness(&self, axle: &str) -> String {
        match self.has("peak_slip") {
            true => {
                let stiffness = self.own(&format!("{axle}_stiffness"));
                format!("({stiffness} * 1 rad * {} / {})", self.own("peak_slip"), self.load(axle))
            }
            false => format!("{PEAK}"),
        }
    }

    /// The slip from which the tyre slides, over the peak slip.
    fn slides_at(&self, axle: &str) -> String {
        match (self.has("slide_slip"), self.has("peak_slip")) {
            (true, true) => format!("({} / {})", self.own("slide_slip"), self.own("peak_slip")),
            (true, false) => {
                let stiffness = self.own(&format!("{axle}_stiffness"));
                format!("({} * {stiffness} * 1 rad / ({PEAK} * {}))", self.own("slide_slip"), self.load(axle))
            }
            (false, _) => format!("{SLIDE}"),
        }
    }

    /// Slips over the peak slips, as shared expressions of laws, from the tangents of slip angles and the largest forces.
    pub(in crate::element) fn share_slips(&self, out: &mut Entries, of: impl Fn(&str) -> [String; 2]) {
        for (axle, _) in AXLES {
            let ([tangent, most], stiffness) = (of(axle), self.own(&format!("{axle}_stiffness")));
            let value = format!("{stiffness} * 1 rad * {tangent} / ({} * ({most}))", self.steepness(axle));
            self.share(out, &format!("slip_{axle}"), value);
        }
    }

    /// The side force of an axle with this largest force.
    pub(in crate::element) fn tmeasy_force(&self, axle: &str, most: &str) -> String {
        let (slip, k) = (self.own(&format!("slip_{axle}")), self.steepness(axle));
        let x = format!("max(-1, min(1, {slip}))");
        let up = format!("{k} * {x} / (1 + abs({x}) * (abs({x}) + {k} - 2))");
        let w = format!("min(1, max(0, abs({slip}) - 1) / ({} - 1))", self.slides_at(axle));
        let down = format!("(1 - (1 - {}) * ({w})^2 * (3 - 2 * {w}))", self.own("slide_factor"));
        format!("(-{most} * {up} * {down})")
    }

    /// The remaining part of the pneumatic trail, zero from the peak on.
    pub(in crate::element) fn tmeasy_trail(&self) -> String {
        format!("max(0, 1 - abs({}))", self.own("slip_front"))
    }
}
