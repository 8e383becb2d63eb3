//! What people look at: figures, tables and one self-contained HTML page.
//!
//! Here: SVG figures (declared for `plot`), [`page`] and [`picture`]. Not here: the
//! numbers (`analysis`) and the data (`record`). The page needs no network,
//! script or font file. Nothing in it is typed in: every number comes from the
//! run, from a [`PaperRow`] with its source, or from an [`Assumption`].
//! In: a [`Report`]. Out: `report.html` and `summary.json`.

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
    CompareRow, Compared, FileDifference, KeyChange, TrialRow, compare_body, compare_rows,
    compare_text, session_differences,
};
pub use edges::edges_figure;
pub use html::{Html, Piece};
pub use limb::draw_bones;
pub use overview::picture as overview_picture;
pub use page::{document, figure, page};
pub use summary::write;
pub use tables::force_remarks;

use crate::record::{Assumption, PaperRow, Run};

/// Everything a page shows.
#[derive(Clone, Copy, Debug)]
pub struct Report<'a> {
    /// The data.
    pub run: &'a Run,
    /// What a paper printed for the same trials; may be empty.
    pub paper: &'a [PaperRow],
    /// What was put into a simulation and what came out; may be empty.
    pub assumptions: &'a [Assumption],
    /// The command line that repeats the run, typed in its folder.
    pub command: &'a str,
}

impl<'a> Report<'a> {
    /// Everything that a record shows.
    #[must_use]
    pub fn of(run: &'a Run) -> Self {
        Self {
            run,
            paper: &run.paper,
            assumptions: &run.assumptions,
            command: run.how_to_reproduce(),
        }
    }
}
