//! The flexor library on the PC.
