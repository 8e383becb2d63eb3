//! Programs whose cost is known, on the core with flat memory.
