//! What several scenes have in common: lamps, bent strips, frames.

use super::obj::Obj;
use glam::{DAffine3, DVec3, dvec3};
use std::f64::consts::TAU;

/// Colours of the rooms of a caustic, and what shines in them.
pub const MTL: &str = "\
newmtl floor
Kd 0.62 0.58 0.52

newmtl wall
Kd 0.22 0.34 0.38

newmtl wood
Kd 0.20 0.11 0.06

newmtl red
Kd 0.65 0.09 0.06

newmtl blue
Kd 0.10 0.22 0.50

newmtl lamp
Kd 0 0 0
Ke 8000 7200 6100

newmtl sky
Kd 0 0 0
Ke 0.45 0.53 0.65
";

/// A square lamp that faces a point.
pub fn lamp(obj: &mut Obj, center: DVec3, faces: DVec3, side: f64) {
    let normal = (faces - center).normalize();
    let x = DVec3::Y.cross(normal).normalize() * (side * 0.5);
    let y = normal.cross(x);
    obj.part("lamp", "lamp");
    obj.quad([center - x - y, center + x - y, center + x + y, center - x + y]);
}

/// Four wooden bars around a picture: local x from -`half` to `half`, y from 0 to `height`; `depth`: half of the bars'.
pub fn frame(obj: &mut Obj, place: DAffine3, half: f64, height: f64, border: f64, depth: f64) {
    obj.part("frame", "wood");
    let mut bar = |x: f64, y: f64, half_x: f64, half_y: f64| {
        obj.cuboid(place * DAffine3::from_translation(dvec3(x, y, 0.0)), dvec3(half_x, half_y, depth));
    };
    let outer = half + border;
    bar(0.0, -0.5 * border, outer, 0.5 * border);
    bar(0.0, height + 0.5 * border, outer, 0.5 * border);
    bar(-half - 0.5 * border, 0.5 * height, 0.5 * border, 0.5 * height);
    bar(half + 0.5 * border, 0.5 * height, 0.5 * border, 0.5 * height);
}

/// A standing strip bent to half a circle.
pub struct Strip {
    /// Of the circle, at the height of what the strip stands on.
    pub center: DVec3,
    /// Where its open side is.
    pub opens_to: DVec3,
    /// Of its inner side.
    pub radius: f64,
    pub height: f64,
    pub thickness: f64,
    pub segments: usize,
}

impl Strip {
    pub fn add(&self, obj: &mut Obj, name: &str, material: &str) {
        let away = self.center - self.opens_to;
        let middle = away.x.atan2(away.z);
        let span = 0.5 * TAU;
        let end = self.segments;
        let radial = |step: usize| {
            let phi = middle + span * (step as f64 / end as f64 - 0.5);
            dvec3(phi.sin(), 0.0, phi.cos())
        };
        let (low, high) = (DVec3::Y * 0.0005, DVec3::Y * self.height);
        let inner = |step: usize| self.center + radial(step) * self.radius;
        let outer = |step: usize| self.center + radial(step) * (self.radius + self.thickness);
        obj.part(name, material);
        obj.sheet(end, |s| {
            let s = end - s;
            (inner(s) + low, inner(s) + high, -radial(s))
        });
        obj.sheet(end, |s| (outer(s) + low, outer(s) + high, radial(s)));
        obj.sheet(end, |s| (outer(s) + high, inner(s) + high, DVec3::Y));
        obj.quad([inner(0) + low, outer(0) + low, outer(0) + high, inner(0) + high]);
        obj.quad([outer(end) + low, inner(end) + low, inner(end) + high, outer(end) + high]);
    }
}
