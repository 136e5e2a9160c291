//! Orthonormal frames.

use glam::DVec3;

/// A right-handed orthonormal frame; columns in world space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// First tangent.
    pub x: DVec3,
    /// Second tangent.
    pub y: DVec3,
    /// Normal (or axis).
    pub z: DVec3,
}

impl Frame {
    /// Any frame around a unit vector; exact to rounding for every direction [Duff et al. 2017, eq. in listing 3].
    #[inline(always)]
    pub fn from_z(z: DVec3) -> Self {
        let sign = 1f64.copysign(z.z);
        let a = -1.0 / (sign + z.z);
        let b = z.x * z.y * a;
        Self {
            x: DVec3::new(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x),
            y: DVec3::new(b, sign + z.y * z.y * a, -z.y),
            z,
        }
    }

    /// The frame around `z` whose x axis is nearest to `tangent`; any frame when `tangent` is zero or parallel to `z`.
    #[inline(always)]
    pub fn from_z_tangent(z: DVec3, tangent: DVec3) -> Self {
        let t = tangent - z * z.dot(tangent);
        let len2 = t.length_squared();
        if !(len2 > 1e-20 * tangent.length_squared()) {
            return Self::from_z(z);
        }
        let x = t * (1.0 / len2.sqrt());
        Self { x, y: z.cross(x), z }
    }

    /// World to local.
    #[inline(always)]
    pub fn to_local(&self, v: DVec3) -> DVec3 {
        DVec3::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// Local to world.
    #[inline(always)]
    pub fn to_world(&self, v: DVec3) -> DVec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_orthonormal_and_invert() {
        let near_south = DVec3::new(1e-9, -1e-9, -1.0).normalize();
        for z in [DVec3::Z, DVec3::NEG_Z, near_south, DVec3::new(1.0, -2.0, 0.5).normalize()] {
            for f in [Frame::from_z(z), Frame::from_z_tangent(z, DVec3::new(0.3, 0.1, 0.9))] {
                assert!((f.x.cross(f.y) - f.z).length() < 1e-14, "{f:?}");
                assert!(f.x.dot(f.y).abs() < 1e-14 && (f.x.length() - 1.0).abs() < 1e-14);
                let v = DVec3::new(0.2, -0.7, 1.3);
                assert!((f.to_world(f.to_local(v)) - v).length() < 1e-14);
            }
        }
        assert_eq!(Frame::from_z_tangent(DVec3::Z, DVec3::Z), Frame::from_z(DVec3::Z));
    }
}
