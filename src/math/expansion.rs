//! The exact sign of a sum of floats.
