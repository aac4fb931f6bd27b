//! What a model file asks for: checked, designed, run for every variant, judged.

mod accuracy;
mod analysis;
mod analyze;
mod asked;
mod bench;
mod checks;
mod circuit;
mod computed;
mod coupling;
mod descriptor;
mod design;
mod effort;
mod equations;
mod events;
mod explore;
mod faults;
mod held;
mod identification;
mod known;
mod linearise;
mod margins;
mod margins_over;
mod massless;
mod measure;
mod others;
mod passage;
mod placement;
mod places;
mod prepare;
mod prepared;
mod progress;
mod project;
mod proof;
mod read;
mod redundant;
mod requirement;
mod robustness;
mod run;
mod scenario;
mod sensitivity;
mod signals;
mod source_signals;
mod spectrum;
mod stepped_loop;
mod strain;
mod summary;

pub use analysis::{AnalysisSpec, Site};
pub use analyze::{analyze, analyze_state_space};
pub use asked::TOLERANCES;
pub use bench::{
    BenchRun, BenchSettings, PreparedBench, bench, bench_controller, closed_loop, given_truth, prepare_bench,
    read_truth,
};
pub use design::{DesignSettings, design};
pub use effort::{Effort, MANY_STEPS, expected_effort};
pub use equations::{EquationsForm, equations};
pub use identification::{IdentifySettings, LogFile, identify, written};
pub use linearise::linearise;
pub use margins::overrule;
pub use prepared::{Prepared, PreparedVariant};
pub use progress::{Part, Progress, Silent};
pub use project::{Project, check, prepare};
pub use requirement::Requirement;
pub use robustness::ToleranceBox;
pub use run::{Settings, run};
pub use signals::AnalyzeSettings;
