//! `brushed_funnel`: a funnel of brushed steel, which widens upwards, shows the caustic on the floor before it. Its grooves
//! run around it: extremely glossy along them, a hundred times rougher across.

use super::obj::Obj;
use super::parts::{self, Strip};
use super::{File, scene};
use glam::{DAffine3, DQuat, DVec3, dvec3};
use std::f64::consts::TAU;

/// Centre of the brass strip's arc, on the floor.
const STAGE: DVec3 = dvec3(0.0, 0.0, -0.62);
/// Centre of the lamp, beside the funnel.
const LAMP: DVec3 = dvec3(-1.3, 0.65, -0.9);
/// Side of the square lamp.
const LAMP_SIDE: f64 = 0.02;
/// The funnel's axis, its height, and its radii below and above.
const FUNNEL: (DVec3, f64, [f64; 2]) = (dvec3(0.0, 0.02, -1.75), 0.95, [0.62, 0.86]);

/// The metals in terms of MTL, beside the common colours.
const METALS: &str = "
# Brushed steel; GGX roughness, not squared, along the grooves and across them.
newmtl steel
Kd 0 0 0
Ks 0.92 0.91 0.89
hrr_alpha_x 1e-4
hrr_alpha_y 1e-2

newmtl brass
Kd 0 0 0
Ks 0.91 0.78 0.42
hrr_alpha_x 1e-3
hrr_alpha_y 1e-3
";

const TOML: &str = "\
obj = [\"scene.obj\"]

[camera]
origin = [0, 1.15, 2.3]
target = [0, 0.36, -1.2]
fov_y  = 21.0

[film]
width  = 200
height = 150

[render]
max_depth = 24
time      = 60
";

pub fn files() -> Vec<File> {
    let comment = "A lamp, a brass strip, and a brushed funnel that shows the caustic it throws on the floor";
    let mut obj = Obj::new(comment);
    let p = |x: f64, y: f64, z: f64| dvec3(x, y, z);
    obj.part("floor", "floor");
    obj.quad([p(-3.0, 0.0, 3.0), p(3.0, 0.0, 3.0), p(3.0, 0.0, -2.8), p(-3.0, 0.0, -2.8)]);
    obj.part("wall", "wall");
    obj.quad([p(-3.0, 0.0, -2.8), p(3.0, 0.0, -2.8), p(3.0, 2.6, -2.8), p(-3.0, 2.6, -2.8)]);
    obj.part("sky", "sky");
    obj.quad([p(-0.6, 1.7, -0.8), p(0.6, 1.7, -0.8), p(0.6, 1.7, 0.4), p(-0.6, 1.7, 0.4)]);
    funnel(&mut obj);
    obj.part("red_ball", "red");
    obj.ball(dvec3(-0.55, 0.1, -0.5), 0.1, 32, 64);
    obj.part("blue_box", "blue");
    let turned = DQuat::from_rotation_y(f64::to_radians(25.0));
    obj.cuboid(DAffine3::from_rotation_translation(turned, dvec3(0.62, 0.08, -0.62)), DVec3::splat(0.08));
    Strip { center: STAGE, opens_to: LAMP, radius: 0.24, height: 0.12, thickness: 0.004, segments: 240 }
        .add(&mut obj, "strip", "brass");
    parts::lamp(&mut obj, LAMP, STAGE, LAMP_SIDE);
    shade(&mut obj);
    scene("brushed_funnel", obj, &(parts::MTL.to_owned() + METALS), &format!("# {comment}.\n{TOML}"))
}

/// An open funnel on a wooden foot; its inside is wood too.
fn funnel(obj: &mut Obj) {
    let (axis, height, [below, above]) = FUNNEL;
    let steps = 192;
    let around = |step: usize| {
        let phi = TAU * (step % steps) as f64 / steps as f64;
        dvec3(phi.sin(), 0.0, phi.cos())
    };
    // Perpendicular to the side, which leans outward.
    let normal = |step: usize| (around(step) * height - DVec3::Y * (above - below)).normalize();
    let high = DVec3::Y * height;
    obj.part("funnel", "steel");
    obj.sheet_with_uv(steps, |s| (axis + around(s) * below, axis + around(s) * above + high, normal(s)));
    obj.part("lining", "wood");
    let thickness = 0.012;
    obj.sheet(steps, |s| {
        let s = steps - s;
        let inner = |radius: f64| around(s) * (radius - thickness);
        (axis + inner(below), axis + inner(above) + high, -normal(s))
    });
    obj.sheet(steps, |s| {
        (axis + around(s) * above + high, axis + around(s) * (above - thickness) + high, DVec3::Y)
    });
    obj.part("foot", "wood");
    let foot = |s: usize| axis + around(s) * (below - 0.04);
    obj.sheet(steps, |s| (foot(s) - DVec3::Y * axis.y, foot(s), around(s)));
    obj.sheet(steps, |s| (foot(s), axis + around(s) * below, -DVec3::Y));
}

/// A board beside the lamp: the funnel shows what the lamp shines on, and not the lamp.
fn shade(obj: &mut Obj) {
    let ahead = ((STAGE - LAMP) * dvec3(1.0, 0.0, 1.0)).normalize();
    let towards_funnel = DVec3::Y.cross(ahead);
    let (length, away) = (0.14, 0.024);
    let middle = LAMP + ahead * (0.5 * length - 0.02) + towards_funnel * away;
    let turned = DQuat::from_rotation_arc(DVec3::X, ahead);
    obj.part("shade", "wood");
    obj.cuboid(DAffine3::from_rotation_translation(turned, middle), dvec3(0.5 * length, 0.2, 0.002));
}
