//! Comparisons and studies, separate from the firmware.
//!
//! `bench` measures the device's algorithms and cycles; `accuracy` and `tracking` compare muscle
//! models and control laws, `stability` maps where methods fail, `ladder` judges the selection of
//! muscle models, `limb` compares recruitments of an arm. `laboratory` has the parts that studies
//! share: declarations, draws, the runner, pages; `catalog` lists the studies and `experiments` the
//! declarations of the program. A paper's study is named after its authors and year: `hamana2022`,
//! `lee2020`, `harris2017`, `sierotowicz2023`, `buatier2024`; `distributed` is a muscle under
//! several electrodes. `detail` judges the level of detail of simulated limbs. `wearer_files` compares what a controller does with different
//! wearer files; `faults` injects faults; `flags` compares compiler flags
//! of the images; `figures` draws charts. `subjects` are the muscles
//! on which models are compared. Declarations are in `host-tool/experiments/`.

pub mod accuracy;
pub mod bench;
pub mod buatier2024;
pub mod catalog;
pub mod detail;
pub mod distributed;
pub mod experiments;
pub mod faults;
pub mod figures;
pub mod flags;
pub mod hamana2022;
pub mod hands;
pub mod harris2017;
pub mod laboratory;
pub mod ladder;
pub mod lee2020;
pub mod limb;
pub mod sierotowicz2023;
pub mod stability;
mod subjects;
pub mod tracking;
pub mod wearer_files;
