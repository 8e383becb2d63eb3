//! The host against a driver like the image's.

mod attachment;
mod board;
mod data;
mod driver;
