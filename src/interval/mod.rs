//! Where a line meets a primitive, in `f64` with a bound on what that is off; where the bound does not
//! decide, real arithmetic does.

#[cfg(test)]
mod bounds;
pub(crate) mod plane;
pub(crate) mod sphere;
pub(crate) mod triangle;
