//! The C library: nothing but the core, whose `rt_` functions it exports.

#![no_std]

extern crate raykern_core as _;
