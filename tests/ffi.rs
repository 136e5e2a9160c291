//! The C interface: its header, its arguments, its numbers, a host's functions, files, rays and renders; programs that
//! use it.

#![allow(unsafe_code)]

mod allocations;
mod arguments;
mod callbacks;
mod equality;
mod files;
mod header;
mod installed;
mod programs;
mod rays;
mod renders;
mod support;
