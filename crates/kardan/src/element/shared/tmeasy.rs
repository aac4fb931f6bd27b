//! The side force of TMeasy (G. Rill, Road Vehicle Dynamics): a fraction up to its peak, from there on a cubic, then what slides.

use super::car::Car;
use super::wheels::AXLES;
use crate::entries::Entries;

/// The slip of the peak, where none is given, over that at which the slope at no slip would reach the force of the peak.
pub(in crate::element) const PEAK: f64 = 3.0;
/// The slip from which on the tyre slides, where none is given, over that of the peak.
pub(in crate::element) const SLIDE: f64 = 3.0;

impl Car<'_> {
    /// The slope at no slip times the slip of the peak, over the force there: so long as friction and load change, that slip goes with the force.
    fn steepness(&self, axle: &str) -> String {
        match self.has("peak_slip") {
            true => {
                let stiffness = self.own(&format!("{axle}_stiffness"));
                format!("({stiffness} * 1 rad * {} / {})", self.own("peak_slip"), self.load(axle))
            }
            false => format!("{PEAK}"),
        }
    }

    /// The slip from which on it slides over that of the peak.
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

    /// Slips over those of the peaks, as laws share them, from the tangents of slip angles and the largest forces.
    pub(in crate::element) fn share_slips(&self, out: &mut Entries, of: impl Fn(&str) -> [String; 2]) {
        for (axle, _) in AXLES {
            let ([tangent, most], stiffness) = (of(axle), self.own(&format!("{axle}_stiffness")));
            let value = format!("{stiffness} * 1 rad * {tangent} / ({} * ({most}))", self.steepness(axle));
            self.share(out, &format!("slip_{axle}"), value);
        }
    }

    /// The side force of an axle of which this is the largest one.
    pub(in crate::element) fn tmeasy_force(&self, axle: &str, most: &str) -> String {
        let (slip, k) = (self.own(&format!("slip_{axle}")), self.steepness(axle));
        let x = format!("max(-1, min(1, {slip}))");
        let up = format!("{k} * {x} / (1 + abs({x}) * (abs({x}) + {k} - 2))");
        let w = format!("min(1, max(0, abs({slip}) - 1) / ({} - 1))", self.slides_at(axle));
        let down = format!("(1 - (1 - {}) * ({w})^2 * (3 - 2 * {w}))", self.own("slide_factor"));
        format!("(-{most} * {up} * {down})")
    }

    /// The part of the pneumatic trail that is left, none from the peak on.
    pub(in crate::element) fn tmeasy_trail(&self) -> String {
        format!("max(0, 1 - abs({}))", self.own("slip_front"))
    }
}
