//! Maps of where each method fails, with the predicted boundary beside the found one.

pub mod wall_loop;
