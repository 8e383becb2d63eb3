//! Protocols of the papers, run on simulated or real devices.
//!
//! Lives here: one module per paper's protocol: its sessions, what is drawn at
//! random, what is compared. Not here: how a session runs (`run`), numbers of one
//! trial (`analysis`), the command (`cli`).
//! In: a device, a seed. Out: trials and what they show.

pub mod harris_wall;
