//! The C interface: its header, its arguments, its numbers, programs that use it.

#![allow(unsafe_code)]

mod arguments;
mod equality;
mod header;
mod programs;
mod support;
