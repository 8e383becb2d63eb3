//! Control laws compared on random wearers.
