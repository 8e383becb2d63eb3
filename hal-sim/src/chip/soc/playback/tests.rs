//! What firmware's tape room does to the registers, done by hand.

mod scene;
mod tape;
