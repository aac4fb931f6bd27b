//! Gear loads and gear losses from measured motions.

use kardan_mechanics::reduce::LawTorques;

/// A gear with load-dependent loss. Its constraint is cut: with a motion z over the shafts that all other constraints allow, and
/// that moves the first body of the direction a by one against the others of this constraint, `T = zᵀ(inertias, dampers, … − inputs)` is what
/// the gear applies to that body, less `zᵀa` times its loss.
#[derive(Debug, Clone, Default)]
pub struct Teeth {
    /// a over the shafts: the loss acts against motion along it.
    pub row: Vec<(usize, f64)>,
    /// z
    pub cut: Vec<f64>,
    /// The fractions of the torque lost according to the file while the first body drives, and while it is driven.
    pub fixed: [f64; 2],
    /// Further loss as a function of the magnitudes of torque and speed; z then does not move the first body.
    pub loss: Option<LawTorques>,
    /// Speed below which the sign along them counts as unknown, rad/s.
    pub rest_speed: f64,
}

impl Teeth {
    pub(super) fn projection(&self, of: &[f64]) -> f64 {
        self.row.iter().map(|(shaft, a)| a * of[*shaft]).sum()
    }

    /// The loss of T, of κ of the torque on the first body.
    pub fn share_of_cut(&self, part: f64, back: bool) -> f64 {
        part / (1.0 + self.signed_lever(back) * part)
    }

    /// The inverse.
    pub fn part_of_share(&self, share: f64, back: bool) -> f64 {
        share / (1.0 - self.signed_lever(back) * share)
    }

    /// `zᵀa`, negative while the first body is driven.
    fn signed_lever(&self, back: bool) -> f64 {
        let lever = self.projection(&self.cut);
        if back { -lever } else { lever }
    }
}
