//! `glossy_corridor`: glossy walls on both sides of a glossy floor. Light reaches the eye over several glossy surfaces in
//! turn, which is where the roulette, which judges by the eye side's lobe alone, has least to offer.

use super::obj::Obj;
use super::parts;
use super::{File, scene};
use glam::{DAffine3, DQuat, DVec3, dvec3};

const MTL: &str = "\
# Polished stone, by its reflection alone.
newmtl floor
Kd 0 0 0
Ks 0.35 0.33 0.30
hrr_alpha_x 0.08
hrr_alpha_y 0.08

newmtl ceiling
Kd 0.70 0.68 0.62

newmtl end
Kd 0.55 0.38 0.24

newmtl red
Kd 0.65 0.09 0.06

newmtl blue
Kd 0.10 0.22 0.50

newmtl wood
Kd 0.20 0.11 0.06

newmtl lamp
Kd 0 0 0
Ke 300 270 230

newmtl panel
Kd 0 0 0
Ke 1.6 1.7 1.9

# Brushed by hand; GGX roughness, not squared.
newmtl metal
Kd 0 0 0
Ks 0.90 0.88 0.84
hrr_alpha_x 0.02
hrr_alpha_y 0.02

newmtl copper
Kd 0 0 0
Ks 0.93 0.62 0.50
hrr_alpha_x 0.005
hrr_alpha_y 0.005
";

const TOML: &str = "\
obj = [\"scene.obj\"]

[camera]
origin = [0.12, 1.25, 2.9]
target = [0, 0.75, -2.0]
fov_y  = 40.0

[film]
width  = 200
height = 150

[render]
max_depth = 24
time      = 60
";

pub fn files() -> Vec<File> {
    let comment = "A corridor between glossy walls, over a glossy floor";
    let mut obj = Obj::new(comment);
    let p = |x: f64, y: f64, z: f64| dvec3(x, y, z);
    let (w, h, near, far) = (0.8, 1.9, 3.2, -3.0);
    obj.part("floor", "floor");
    obj.quad([p(-w, 0.0, near), p(w, 0.0, near), p(w, 0.0, far), p(-w, 0.0, far)]);
    obj.part("ceiling", "ceiling");
    obj.quad([p(-w, h, far), p(w, h, far), p(w, h, near), p(-w, h, near)]);
    obj.part("ends", "end");
    obj.quad([p(-w, 0.0, far), p(w, 0.0, far), p(w, h, far), p(-w, h, far)]);
    obj.quad([p(w, 0.0, near), p(-w, 0.0, near), p(-w, h, near), p(w, h, near)]);
    obj.part("walls", "metal");
    obj.quad([p(-w, 0.0, near), p(-w, 0.0, far), p(-w, h, far), p(-w, h, near)]);
    obj.quad([p(w, 0.0, far), p(w, 0.0, near), p(w, h, near), p(w, h, far)]);
    obj.part("panel", "panel");
    let y = h - 0.01;
    obj.quad([p(-0.25, y, 0.6), p(0.25, y, 0.6), p(0.25, y, 1.6), p(-0.25, y, 1.6)]);
    obj.part("copper_ball", "copper");
    obj.ball(dvec3(-0.32, 0.2205, -0.9), 0.22, 48, 96);
    obj.part("red_ball", "red");
    obj.ball(dvec3(0.42, 0.1605, -0.35), 0.16, 32, 64);
    obj.part("blue_box", "blue");
    let turned = DQuat::from_rotation_y(f64::to_radians(30.0));
    let place = DAffine3::from_rotation_translation(turned, dvec3(0.3, 0.2005, -1.9));
    obj.cuboid(place, DVec3::splat(0.2));
    parts::lamp(&mut obj, dvec3(0.45, 1.5, -1.6), dvec3(-0.2, 0.2, -0.7), 0.06);
    scene("glossy_corridor", obj, MTL, &format!("# {comment}.\n{TOML}"))
}
