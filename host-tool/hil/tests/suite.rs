//! Tests of captures, the fit and whole reports, with seeds.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::indexing_slicing,
    reason = "a test fails where an assumption does"
)]

mod capture;
mod cases;
mod common;
mod continuous;
mod merge;
mod seeds;
mod variety;
