//! Tests the host with a driver like the image's.

mod attachment;
mod board;
mod data;
mod driver;
