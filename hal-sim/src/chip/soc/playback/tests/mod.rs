//! What firmware's tape room does to the registers, done by hand.

mod crowded;
mod disturbed;
mod scene;
mod slips;
mod tape;
mod upsets;
