//! Code shared by several elements.

pub(super) mod branch;
pub(super) mod car;
pub(super) mod car_checks;
pub(super) mod composite;
pub(super) mod contact;
pub(super) mod gear_loss;
pub(super) mod kind;
pub(super) mod losses;
pub(super) mod prescribed;
pub(super) mod shafts;
pub(super) mod spline;
pub(super) mod straight;
pub(super) mod tmeasy;
pub(super) mod wheels;
