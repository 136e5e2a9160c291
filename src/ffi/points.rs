//! Points in a host's memory, in either precision.

use super::pointer::Strided;
use super::segment::{HRR_DOUBLE3, HRR_FLOAT3, MAX_DOUBLE};
use super::status::{Failure, Outcome};
use glam::{DVec3, Vec3};
use std::ffi::c_void;

/// Three floats or three doubles each.
#[derive(Debug, Clone, Copy)]
pub(super) enum Points {
    Floats(Strided<[f32; 3]>),
    Doubles(Strided<[f64; 3]>),
}

impl Points {
    pub unsafe fn new(
        first: *const c_void,
        stride: usize,
        count: usize,
        format: u32,
        name: &str,
    ) -> Outcome<Self> {
        // SAFETY: passed on.
        unsafe {
            match format {
                HRR_FLOAT3 => Strided::new(first.cast(), stride, count, name).map(Self::Floats),
                HRR_DOUBLE3 => Strided::new(first.cast(), stride, count, name).map(Self::Doubles),
                _ => Err(Failure::argument(format!("position_format is {format}: it is 0 or 1"))),
            }
        }
    }

    /// The `index`-th; as the error when it is of no use.
    pub unsafe fn get(&self, index: usize) -> Result<DVec3, DVec3> {
        // SAFETY: the caller vouches that `index` is below the count.
        let (p, fits) = unsafe {
            match self {
                Self::Floats(floats) => (Vec3::from_array(floats.get(index)).as_dvec3(), true),
                Self::Doubles(doubles) => {
                    let p = DVec3::from_array(doubles.get(index));
                    (p, p.abs().max_element() <= MAX_DOUBLE)
                }
            }
        };
        if fits && p.is_finite() { Ok(p) } else { Err(p) }
    }
}
