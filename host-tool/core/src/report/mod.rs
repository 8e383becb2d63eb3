//! Reports for people: figures, tables and one self-contained HTML page.
//!
//! This module has SVG figures (declared with `plot`), [`page`] and [`overview_picture`]. The
//! numbers are computed in `analysis`, and the data are in `record`. The page needs no network,
//! script or font file. Every number on it comes from the run, from a [`PaperRow`] with its source, or from an
//! [`Assumption`].
//!
//! Input: a [`Report`]. Output: `report.html` and `summary.json`.

mod bars;
mod compare;
mod doses;
mod edges;
mod hand;
mod html;
mod lanes;
mod limb;
mod overview;
mod page;
mod summary;
mod tables;
mod trajectory;

pub use compare::{
    CompareRow, ComparedRecord, FileDifference, KeyChange, TrialRow, compare_body, compare_rows,
    compare_text, session_differences,
};
pub use edges::edges_figure;
pub use html::{Html, Piece};
pub use limb::draw_bones;
pub use overview::picture as overview_picture;
pub use page::{document, figure, page};
pub use summary::{write, write_on};
pub use tables::force_remarks;

use crate::record::{Assumption, PaperRow, Run};

/// The content of a page.
#[derive(Clone, Copy, Debug)]
pub struct Report<'a> {
    /// Run that the page reports, with its data.
    pub run: &'a Run,
    /// Values that a paper reports for the same trials, for comparison; may be empty.
    pub paper: &'a [PaperRow],
    /// Assumptions behind a simulation, and outcomes that it computed; may be empty.
    pub assumptions: &'a [Assumption],
    /// Command line that repeats the run when typed in its folder.
    pub command: &'a str,
}

impl<'a> Report<'a> {
    /// Returns the report of a run, with the paper's values and the assumptions that its record
    /// contains.
    #[must_use]
    pub fn from_run(run: &'a Run) -> Self {
        Self {
            run,
            paper: &run.paper,
            assumptions: &run.assumptions,
            command: run.how_to_reproduce(),
        }
    }
}
