//! The requests of a model file: checked, designed, run for every variant, judged.

mod analyze;
mod bench;
mod check;
mod design;
mod equations;
mod identification;
mod loops;
mod measure;
mod operating_point;
mod prepare;
mod prepared;
mod progress;
mod project;
mod read;
mod requests;
mod run;
mod safety;
mod sweep;

pub use analyze::linearise::linearise;
pub use analyze::structure::{analyze, analyze_state_space};
pub use bench::{
    BenchRun, BenchSettings, PreparedBench, bench, bench_controller, closed_loop, prepare_bench, read_truth,
    truth_table,
};
pub use check::effort::{Effort, MANY_STEPS, expected_effort};
pub use design::designs::{DesignSettings, design};
pub use design::robustness::ToleranceBox;
pub use equations::form::EquationsForm;
pub use equations::forms::equations;
pub use identification::{IdentifySettings, LogFile, identify, write_values};
pub use loops::blocks::{listed_blocks, signal_graph};
pub use loops::margins::overrule;
pub use measure::figure::Figure;
pub use measure::requirement_verdict::Requirement;
pub use operating_point::working_point::{AnalyzeSettings, ParitySettings};
pub use prepared::{Prepared, PreparedVariant};
pub use progress::{Part, Progress, Silent};
pub use project::{Project, check, prepare};
pub use read::faults::NamedFault;
pub use read::tolerance::TOLERANCES;
pub use requests::analysis_spec::{AnalysisSpec, OperatingConditions, Site};
pub use requests::safety_spec::SafetySpec;
pub use requests::sweep_spec::SweepSpec;
pub use run::runs::{Settings, run};
pub use safety::SafetySettings;
pub use sweep::{Shard, SweepGoal, SweepPlan, SweepSettings, TakeRows, swept_model};
