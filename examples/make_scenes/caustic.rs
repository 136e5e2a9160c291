//! `caustic_mirror`, `caustic_mirror_aniso` and `glass_caustic`: a caustic on the floor, and a standing mirror that
//! leans forward and shows it from above.

use super::obj::Obj;
use super::parts::{self, Strip};
use super::{File, scene};
use glam::{DAffine3, DQuat, DVec3, dvec3};

/// Centre of what makes the caustic, on the floor.
const STAGE: DVec3 = dvec3(0.0, 0.0, -0.78);
/// Centre of the lamp: to the left of the picture, and behind the plane of the mirror, which it must not shine on.
const LAMP: DVec3 = dvec3(-1.12, 0.62, -1.39);
/// Side of the square lamp.
const LAMP_SIDE: f64 = 0.02;

/// The mirror and the strip in terms of MTL, for programs that know nothing of `scene.toml`.
const METALS: &str = "
# Extremely glossy: GGX roughness 1e-4, not squared.
newmtl mirror
Kd 0 0 0
Ks 0.95 0.95 0.95
illum 3
hrr_alpha_x 1e-4
hrr_alpha_y {alpha_y}

newmtl brass
Kd 0 0 0
Ks 0.91 0.78 0.42
hrr_alpha_x 1e-3
hrr_alpha_y 1e-3
";

const GLASS: &str = "
newmtl mirror
Kd 0 0 0
Ks 0.95 0.95 0.95
illum 3
hrr_alpha_x 1e-4
hrr_alpha_y 1e-4

newmtl glass
Kd 0 0 0
Ks 1 1 1
Ni 1.5
illum 7
";

const CAMERA: &str = "\
[camera]
origin = [0, 1.3, 2.6]
target = [0, 0.34, -1.3]
up     = [0, 1, 0]
fov_y  = 21.0

[film]
width  = 200
height = 150

[render]
max_depth = 24
time      = 60
";

/// A brass strip under a small lamp; its caustic is seen in a mirror of roughness 1e-4.
pub fn mirror() -> Vec<File> {
    let comment = "A lamp, a brass strip, and a mirror that shows the caustic it throws on the floor";
    let toml = format!("# {comment}.\nobj = [\"scene.obj\"]\n\n{CAMERA}{}", metals_toml("1e-4"));
    scene(
        "caustic_mirror",
        with_strip(comment),
        &(parts::MTL.to_owned() + &METALS.replace("{alpha_y}", "1e-4")),
        &toml,
    )
}

/// The same with a mirror that is brushed: rougher along its height than along its width.
pub fn mirror_aniso() -> Vec<File> {
    let comment = "A lamp, a brass strip, and a brushed mirror that shows the caustic it throws on the floor";
    let toml = format!("# {comment}.\nobj = [\"scene.obj\"]\n\n{CAMERA}{}", metals_toml("1e-2"));
    let mtl = parts::MTL.to_owned() + &METALS.replace("{alpha_y}", "1e-2");
    scene("caustic_mirror_aniso", with_strip(comment), &mtl, &toml)
}

/// A glass ball in place of the strip.
pub fn glass() -> Vec<File> {
    let comment = "A lamp, a glass ball, and a mirror that shows the caustic it throws on the floor";
    let mut obj = room(comment);
    obj.part("ball", "glass");
    obj.ball(STAGE + dvec3(-0.12, 0.1602, -0.05), 0.16, 64, 128);
    let toml = format!(
        "# {comment}.\nobj = [\"scene.obj\"]\n\n{CAMERA}{}\n[material.glass]\ntype = \"dielectric\"\nior  = 1.5\n",
        mirror_toml("1e-4")
    );
    scene("glass_caustic", obj, &(parts::MTL.to_owned() + GLASS), &toml)
}

fn mirror_toml(alpha_y: &str) -> String {
    format!(
        "\n[material.mirror]\ntype  = \"conductor\"\neta   = [0.2, 0.2, 0.2]\nk     = [3.9, 3.9, 3.9]\n\
         alpha = [1e-4, {alpha_y}]\n"
    )
}

fn metals_toml(alpha_y: &str) -> String {
    // Brass, after its measured index at 650, 550 and 450 nm.
    format!(
        "{}\n[material.brass]\ntype  = \"conductor\"\neta   = [0.44, 0.54, 1.17]\nk     = [3.70, 2.72, 1.80]\n\
         alpha = 1e-3\n",
        mirror_toml(alpha_y)
    )
}

/// Everything but the object in the middle.
fn room(comment: &str) -> Obj {
    let mut obj = Obj::new(comment);
    let p = |x: f64, y: f64, z: f64| dvec3(x, y, z);
    obj.part("floor", "floor");
    obj.quad([p(-3.0, 0.0, 3.0), p(3.0, 0.0, 3.0), p(3.0, 0.0, -1.8), p(-3.0, 0.0, -1.8)]);
    obj.part("wall", "wall");
    obj.quad([p(-3.0, 0.0, -1.8), p(3.0, 0.0, -1.8), p(3.0, 2.4, -1.8), p(-3.0, 2.4, -1.8)]);
    stand(&mut obj);
    obj.part("red_ball", "red");
    obj.ball(dvec3(-0.52, 0.1, -0.6), 0.1, 32, 64);
    obj.part("blue_box", "blue");
    let turned = DQuat::from_rotation_y(f64::to_radians(25.0));
    obj.cuboid(DAffine3::from_rotation_translation(turned, dvec3(0.6, 0.08, -1.12)), DVec3::splat(0.08));
    parts::lamp(&mut obj, LAMP, STAGE, LAMP_SIDE);
    // A dim panel overhead keeps shadows from being black.
    obj.part("sky", "sky");
    obj.quad([p(-0.6, 1.7, -1.0), p(0.6, 1.7, -1.0), p(0.6, 1.7, 0.2), p(-0.6, 1.7, 0.2)]);
    obj
}

/// The mirror in its frame between two posts.
fn stand(obj: &mut Obj) {
    let (width, height, border): (f64, f64, f64) = (1.46, 0.92, 0.025);
    // Local x to the right, y up along the mirror, z out of it; it leans forward by 14 degrees.
    let lean = DQuat::from_rotation_x(f64::to_radians(14.0));
    let place = DAffine3::from_rotation_translation(lean, dvec3(0.0, 0.06, -1.47));
    let at = |x: f64, y: f64| place.transform_point3(dvec3(x, y, 0.0));
    let half = 0.5 * width;
    obj.part("mirror", "mirror");
    obj.quad_with_uv([at(-half, 0.0), at(half, 0.0), at(half, height), at(-half, height)]);
    parts::frame(obj, place, half, height, border, border * 0.6);
    let outer = half + border;
    obj.part("posts", "wood");
    let pivot = at(0.0, 0.5 * height);
    for side in [-1.0, 1.0] {
        let x = side * (outer + 0.03);
        obj.cuboid(DAffine3::from_translation(dvec3(x, 0.29, pivot.z)), dvec3(0.015, 0.29, 0.015));
        obj.cuboid(DAffine3::from_translation(dvec3(x, 0.015, pivot.z)), dvec3(0.02, 0.015, 0.16));
    }
}

fn with_strip(comment: &str) -> Obj {
    let mut obj = room(comment);
    Strip { center: STAGE, opens_to: LAMP, radius: 0.34, height: 0.13, thickness: 0.004, segments: 240 }
        .add(&mut obj, "strip", "brass");
    obj
}
