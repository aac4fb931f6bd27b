//! Control at a sample time: laws as firmware runs them, the exact map of the sampled loop, its margins, and the design of
//! laws that know the sample time, the delay and the lag of the motors.

mod filter;
mod firmware;
mod hold;
mod interaction;
mod lifted;
mod loop_map;
mod margins;
mod noise;
mod part;
mod places;
mod plant;
mod runner;
mod scheduled;

pub(super) use filter::filter;
pub use firmware::{Block, Clock, Firmware, sampled};
pub(super) use firmware::{entries, keep_health, side_by_side};
pub(super) use hold::{hold_plant, on_their_way};
pub(super) use interaction::{Problem, Solution, Target};
pub use lifted::Lifted;
pub use loop_map::{SampledLoop, SampledLoopError, Slowest};
pub use margins::{Change, Limit, Survey};
pub use noise::reading_variance;
pub use part::{SampledPart, Wire};
pub use plant::{LoopPlant, Reads, SlowSensor, VariedPlant};
pub(super) use runner::{GovernorData, RegulatorData, Runner};
use scheduled::Scheduled;
pub(super) use scheduled::{PERIOD, ScheduleData, Turned, turning};
