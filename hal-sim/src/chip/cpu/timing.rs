//! Cycles of instructions (TRM section 3.3): what is between instructions.

/// What the instructions before left in the pipeline.
#[derive(Debug, Default)]
pub struct Pipeline {}
