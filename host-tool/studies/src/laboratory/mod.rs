//! Common machinery of all experiments, whichever paper they replicate.
//!
//! Contains declarations, conditions, threshold searches, draws and sweeps, results and their page.
//! The protocol and analysis of a particular paper belong to `experiments`, running a session to
//! `host_core::run`, hypothesis tests to `host_core::statistics`. Takes a declaration and a device;
//! writes a folder with `result.json` and its page.

mod advice;
mod check;
mod claims;
mod comparison;
mod condition;
mod conduct;
mod decides;
mod declaration;
mod draw;
mod error;
mod experiment;
mod judged;
mod kept;
mod measure;
mod notes;
mod numbers;
mod open_loop;
mod page;
mod paper_claims;
mod protocol;
mod quoted;
mod result;
mod results;
mod run;
pub mod search;
mod sheet;
mod sources;
mod study;
mod sweep;
mod wearer;
mod wearers;
mod written;

pub use check::MOST_DRAWS;
pub use claims::{Case, Reach, Share, Verdict, shares};
pub use comparison::{Comparison, comparison};
pub use condition::{Condition, Texts};
pub use conduct::{ConductedTrial, Course, Operator, ProtocolEnd};
pub use decides::{DecidingClaim, Field};
pub use declaration::{Claim, Declaration};
pub use error::LaboratoryError;
pub use experiment::{Experiment, TrialMeasures};
pub use judged::{DrawClaim, Range};
pub use kept::{compared_files, differs};
pub use measure::{MEASURES, Measure, Needs};
pub(crate) use notes::{ElectrodeLog, LOAD_OHM, Notes};
pub use numbers::{LARGE_T, large_t};
pub use open_loop::DeviceCheck;
pub use page::{headline, publish, rebuild_page};
pub use paper_claims::{ClaimStanding, PaperClaim, paper_claims};
pub use protocol::{Place, Step, Wearer};
pub use quoted::quote_for_shell;
pub use result::{Outcome, Preregistration, Row, ShownCondition};
pub use results::{
    NamedResult, ResultRow, ResultValue, declaration_differences, result_rows, results_body,
    results_text,
};
pub use run::{RunProgress, Runnable, WithUnits, merge_drawing, run_drawing, seed_and_draws};
pub use sheet::{Band, Bar, Curve, Grid, Matrix, Plot, Plots, Sheet, SheetAxis, SheetContent};
pub(crate) use study::line;
pub use study::{Lines, Study, StudyIdentity};
pub use sweep::{
    ComputedUnits, Drawing, Shard, Sweep, SweepResult, merge, merge_shards, parse_number,
    read_shard,
};
