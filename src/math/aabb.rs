//! Axis-aligned boxes in the precision they are stored in.

use glam::{DVec3, Vec3};

/// An axis-aligned box; empty when `min > max`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// Lower corner, world units.
    pub min: Vec3,
    /// Upper corner, world units.
    pub max: Vec3,
}

impl Aabb {
    /// The box that holds nothing and grows from there.
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The smallest box around points; [`Aabb::EMPTY`] for none.
    pub fn around(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Self { min: b.min.min(p), max: b.max.max(p) })
    }

    /// The smallest box around both.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// True when the box holds no point.
    pub fn is_empty(&self) -> bool {
        self.min.cmpgt(self.max).any()
    }

    /// Centre; meaningless for an empty box.
    pub fn center(&self) -> DVec3 {
        (self.min.as_dvec3() + self.max.as_dvec3()) * 0.5
    }

    /// Radius of the sphere around [`Aabb::center`] through the corners; 0 for an empty box.
    pub fn radius(&self) -> f64 {
        if self.is_empty() { 0.0 } else { (self.max.as_dvec3() - self.min.as_dvec3()).length() * 0.5 }
    }
}
