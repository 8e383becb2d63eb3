//! The host against a driver like the image's.

mod attachment;
mod board;
mod cost;
mod data;
mod driver;
