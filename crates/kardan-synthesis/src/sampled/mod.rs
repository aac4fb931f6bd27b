//! Control at a sample time: laws as firmware runs them, the exact map of the sampled loop, its margins, and the design of
//! laws that know the sample time, the delay and the lag of the motors.

mod blocks;
mod event_sequence;
mod exact_map;
mod filter;
mod firmware;
mod hold;
mod interaction;
mod jump;
mod lifted;
mod loop_map;
mod margins;
mod memory;
mod noise;
mod part;
mod places;
mod plant;
mod regulator_block;
mod regulator_data;
mod responses;
mod schedule_cache;
mod scheduled;

pub use blocks::{BesideBlocks, LinearTask, LoopBlocks};
pub use event_sequence::SampledLoopError;
pub use exact_map::ExactMap;
pub(super) use filter::filter;
pub use firmware::sampled;
pub(super) use firmware::sampled_with;
pub(super) use hold::{on_their_way, zoh_plant};
pub(super) use interaction::{Problem, Solution, Target};
pub use lifted::Lifted;
pub use loop_map::{SampledLoop, Slowest};
pub use margins::{Change, GAINS, LIMIT_STEP, Limit, Survey};
pub(super) use memory::{archive_health, entries, position_loop_in, sensors_in};
pub use noise::reading_variance;
pub use part::{SampledPart, Teller, Wire};
pub(super) use places::{FirstOrderPlant, Places};
pub use plant::{LoopPlant, Reads, SlowSensor, VariedPlant};
pub(super) use regulator_block::RegulatorBlock;
pub(super) use regulator_data::{GovernorData, RegulatorData};
pub use responses::{ControlLoop, Readings};
pub(super) use schedule_cache::ScheduleCache;
use scheduled::Scheduled;
pub(super) use scheduled::{PERIOD, ScheduleData, turning};
