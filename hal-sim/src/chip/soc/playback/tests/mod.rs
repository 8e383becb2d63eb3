//! Performs the register accesses of the firmware's tape module by hand.

mod crowded;
mod disturbed;
mod scene;
mod slips;
mod tape;
mod upsets;
