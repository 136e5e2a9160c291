//! `cornell`: the classic box, with a metal box in place of the short block.

use super::obj::Obj;
use super::{File, scene};
use glam::{DAffine3, DQuat, DVec3, dvec3};

const MTL: &str = "\
newmtl white
Kd 0.73 0.72 0.68

newmtl red
Kd 0.61 0.06 0.05

newmtl green
Kd 0.13 0.44 0.10

newmtl lamp
Kd 0 0 0
Ke 30 22 13

# A metal of GGX roughness 0.1 that reflects Ks.
newmtl metal
Kd 0 0 0
Ks 0.95 0.90 0.82
hrr_alpha_x 0.1
hrr_alpha_y 0.1
";

const TOML: &str = "\
# The classic box: diffuse walls, a small lamp in the ceiling, a diffuse block and one of rough metal.
obj = [\"scene.obj\"]

[camera]
origin = [0, 1, 4.6]
target = [0, 1, 0]
fov_y  = 33.0

[film]
width  = 200
height = 200

[render]
iterations = 64
";

pub fn files() -> Vec<File> {
    let mut obj = Obj::new("Cornell box, 2 m wide, open towards +z");
    let p = |x: f64, y: f64, z: f64| dvec3(x, y, z);
    obj.part("floor", "white");
    obj.quad([p(-1.0, 0.0, 1.0), p(1.0, 0.0, 1.0), p(1.0, 0.0, -1.0), p(-1.0, 0.0, -1.0)]);
    obj.part("ceiling", "white");
    obj.quad([p(-1.0, 2.0, -1.0), p(1.0, 2.0, -1.0), p(1.0, 2.0, 1.0), p(-1.0, 2.0, 1.0)]);
    obj.part("back", "white");
    obj.quad([p(-1.0, 0.0, -1.0), p(1.0, 0.0, -1.0), p(1.0, 2.0, -1.0), p(-1.0, 2.0, -1.0)]);
    obj.part("left", "red");
    obj.quad([p(-1.0, 0.0, 1.0), p(-1.0, 0.0, -1.0), p(-1.0, 2.0, -1.0), p(-1.0, 2.0, 1.0)]);
    obj.part("right", "green");
    obj.quad([p(1.0, 0.0, -1.0), p(1.0, 0.0, 1.0), p(1.0, 2.0, 1.0), p(1.0, 2.0, -1.0)]);
    obj.part("lamp", "lamp");
    let (x, z, y) = (0.24, 0.19, 1.995);
    obj.quad([p(-x, y, -z), p(x, y, -z), p(x, y, z), p(-x, y, z)]);
    obj.part("block", "white");
    obj.cuboid(block(dvec3(-0.35, 0.6, -0.3), 17.0), dvec3(0.3, 0.6, 0.3));
    obj.part("metal_block", "metal");
    obj.cuboid(block(dvec3(0.37, 0.3, 0.3), -18.0), dvec3(0.3, 0.3, 0.3));
    scene("cornell", obj, MTL, TOML)
}

/// A box's place, turned about the vertical.
fn block(center: DVec3, degrees: f64) -> DAffine3 {
    DAffine3::from_rotation_translation(DQuat::from_rotation_y(f64::to_radians(degrees)), center)
}
