//! `mirror_room` and `specular_room`: a furnished room; a mirror over the table shows the caustics on it from above. The
//! mirror is extremely glossy in the one and perfectly smooth in the other.

use super::obj::Obj;
use super::parts::{self, Strip};
use super::{File, scene};
use glam::{DAffine3, DQuat, DVec3, dvec3};

/// Height of the table's top.
const TABLE: f64 = 0.74;
/// Centre of the lamp, which shines on the table.
const LAMP: DVec3 = dvec3(-0.62, 1.12, -0.62);
/// Side of the square lamp.
const LAMP_SIDE: f64 = 0.02;
/// Centre of the brass ring's arc.
const RING: DVec3 = dvec3(0.02, TABLE, -0.72);

const MTL: &str = "\
newmtl wall
Kd 0.66 0.62 0.55

newmtl floor
Kd 0.30 0.20 0.13

newmtl cloth
Kd 0.70 0.68 0.64

newmtl wood
Kd 0.24 0.13 0.07

newmtl carpet
Kd 0.30 0.08 0.09

newmtl blue
Kd 0.10 0.22 0.50

newmtl lamp
Kd 0 0 0
Ke 5200 4700 3900

newmtl ceiling_light
Kd 0 0 0
Ke 2.6 2.5 2.3

newmtl brass
Kd 0 0 0
Ks 0.91 0.78 0.42
hrr_alpha_x 1e-3
hrr_alpha_y 1e-3

# Spun steel: rougher across the grooves than along.
newmtl steel
Kd 0 0 0
Ks 0.62 0.60 0.58
hrr_alpha_x 0.05
hrr_alpha_y 0.15

newmtl glass
Kd 0 0 0
Ks 1 1 1
Ni 1.5
illum 7

newmtl frosted
Kd 0 0 0
Ks 1 1 1
Ni 1.5
illum 7
hrr_alpha_x 0.08
hrr_alpha_y 0.08

# Extremely glossy: GGX roughness 1e-4, not squared.
newmtl mirror
Kd 0 0 0
Ks 0.95 0.95 0.95
illum 3
hrr_alpha_x 1e-4
hrr_alpha_y 1e-4
";

const TOML: &str = "\
[camera]
origin = [0, 1.5, 2.3]
target = [0, 1.0, -1.5]
fov_y  = 27.0

[film]
width  = 200
height = 150

[render]
max_depth = 24
time      = 60

[material.glass]
type = \"dielectric\"
ior  = 1.5

[material.frosted]
type  = \"dielectric\"
ior   = 1.5
alpha = 0.08

[material.mirror]
";

/// With a mirror of roughness 1e-4.
pub fn glossy() -> Vec<File> {
    let comment = "A furnished room: a glossy mirror shows the caustics on the table before it";
    let mut obj = Obj::new(comment);
    walls(&mut obj);
    furniture(&mut obj);
    framed_mirror(&mut obj);
    things(&mut obj);
    let mirror = "type  = \"conductor\"\neta   = [0.2, 0.2, 0.2]\nk     = [3.9, 3.9, 3.9]\nalpha = 1e-4\n";
    scene("mirror_room", obj, MTL, &toml(comment, "scene.obj", mirror))
}

/// The same with a perfectly smooth mirror: the caustics in it are found by merging alone.
pub fn specular() -> Vec<File> {
    let comment = "A furnished room: a perfectly smooth mirror shows the caustics on the table before it";
    let mirror = "type        = \"mirror\"\nreflectance = [0.95, 0.95, 0.95]\n";
    vec![("specular_room/scene.toml".into(), toml(comment, "../mirror_room/scene.obj", mirror))]
}

fn toml(comment: &str, obj: &str, mirror: &str) -> String {
    format!("# {comment}.\nobj = [\"{obj}\"]\n\n{TOML}{mirror}")
}

fn at(x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_translation(dvec3(x, y, z))
}

/// A closed room of 4 m by 4 m, seen from within.
fn walls(obj: &mut Obj) {
    let p = |x: f64, y: f64, z: f64| dvec3(x, y, z);
    let (w, back, front, h) = (2.0, -1.5, 2.5, 2.4);
    obj.part("floor", "floor");
    obj.quad([p(-w, 0.0, front), p(w, 0.0, front), p(w, 0.0, back), p(-w, 0.0, back)]);
    obj.part("ceiling", "wall");
    obj.quad([p(-w, h, back), p(w, h, back), p(w, h, front), p(-w, h, front)]);
    obj.part("walls", "wall");
    obj.quad([p(-w, 0.0, back), p(w, 0.0, back), p(w, h, back), p(-w, h, back)]);
    obj.quad([p(-w, 0.0, front), p(-w, 0.0, back), p(-w, h, back), p(-w, h, front)]);
    obj.quad([p(w, 0.0, back), p(w, 0.0, front), p(w, h, front), p(w, h, back)]);
    obj.quad([p(w, 0.0, front), p(-w, 0.0, front), p(-w, h, front), p(w, h, front)]);
    obj.part("ceiling_light", "ceiling_light");
    let y = h - 0.01;
    obj.quad([p(-0.5, y, 0.1), p(0.5, y, 0.1), p(0.5, y, 0.9), p(-0.5, y, 0.9)]);
}

/// A table, a sideboard, a carpet.
fn furniture(obj: &mut Obj) {
    obj.part("table", "wood");
    obj.cuboid(at(0.0, TABLE - 0.02, -0.7), dvec3(0.8, 0.0199, 0.42));
    for (x, z) in [(-0.75, -1.07), (0.75, -1.07), (-0.75, -0.33), (0.75, -0.33)] {
        obj.cuboid(at(x, 0.35, z), dvec3(0.025, 0.3495, 0.025));
    }
    obj.part("cloth", "cloth");
    let (x, z0, z1) = (0.7, -1.05, -0.36);
    let corner = |x: f64, z: f64| dvec3(x, TABLE + 0.0005, z);
    obj.quad([corner(-x, z1), corner(x, z1), corner(x, z0), corner(-x, z0)]);
    obj.part("sideboard", "wood");
    obj.cuboid(at(1.72, 0.4, -0.4), dvec3(0.25, 0.4, 0.7));
    obj.part("carpet", "carpet");
    obj.cuboid(at(0.0, 0.004, 0.9), dvec3(1.2, 0.004, 0.9));
}

/// Over the table, leaning forward by 14 degrees.
fn framed_mirror(obj: &mut Obj) {
    let (half, height, border) = (0.7, 0.84, 0.03);
    let lean = DQuat::from_rotation_x(f64::to_radians(14.0));
    let place = DAffine3::from_rotation_translation(lean, dvec3(0.0, 0.86, -1.46));
    let corner = |x: f64, y: f64| place.transform_point3(dvec3(x, y, 0.0));
    obj.part("mirror", "mirror");
    obj.quad_with_uv([corner(-half, 0.0), corner(half, 0.0), corner(half, height), corner(-half, height)]);
    parts::frame(obj, place, half, height, border, 0.015);
}

/// What lies on the table, and the lamp that shines on it.
fn things(obj: &mut Obj) {
    obj.part("glass_ball", "glass");
    obj.ball(dvec3(-0.34, TABLE + 0.0705, -0.5), 0.07, 32, 64);
    obj.part("frosted_ball", "frosted");
    obj.ball(dvec3(0.36, TABLE + 0.0605, -0.5), 0.06, 32, 64);
    obj.part("steel_ball", "steel");
    obj.ball(dvec3(0.5, TABLE + 0.0905, -0.86), 0.09, 32, 64);
    obj.part("book", "blue");
    let turned = DQuat::from_rotation_y(f64::to_radians(20.0));
    let place = DAffine3::from_rotation_translation(turned, dvec3(-0.45, TABLE + 0.021, -0.9));
    obj.cuboid(place, dvec3(0.11, 0.02, 0.08));
    Strip { center: RING, opens_to: LAMP, radius: 0.17, height: 0.07, thickness: 0.003, segments: 160 }
        .add(obj, "ring", "brass");
    parts::lamp(obj, LAMP, RING, LAMP_SIDE);
    let normal = (RING - LAMP).normalize();
    obj.part("lamp_shade", "blue");
    let shade = LAMP - normal * 0.02;
    obj.cuboid(
        DAffine3::from_rotation_translation(DQuat::from_rotation_arc(DVec3::Z, normal), shade),
        DVec3::new(0.03, 0.03, 0.015),
    );
    obj.part("lamp_pole", "blue");
    obj.cuboid(
        at(shade.x - 0.04, 0.5 * (TABLE + shade.y), shade.z),
        dvec3(0.006, 0.5 * (shade.y - TABLE), 0.006),
    );
}
