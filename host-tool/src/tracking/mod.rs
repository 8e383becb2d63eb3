//! Control laws compared on random wearers.
//!
//! Lives here: a campaign's plants (`plant`), the nominal wearer that laws know
//! (`wearer`), targets and the part of them in reach (`target`, `reach`), who
//! drives (`driver`), one trial (`trial`).
//! Not here: laws (`firmware::control`, `firmware::methods::control`), fingers
//! (`hal_sim::body`), pictures (`report`), the command line (`cli::chart`).
//! In: laws with their numbers, seeds. Out: angles, errors, who wins.

pub mod driver;
pub mod plant;
pub mod reach;
pub mod target;
pub mod trial;
pub mod wearer;
