//! A room with a caustic on its floor and a glossy mirror for a wall: light vertices and eye vertices as a renderer
//! would have them.

use glam::{DVec3, Vec3};
use hrr::math::Frame;
use hrr::roulette::Lobe;
use hrr::sampler::counter::{mix, unit};

fn u(i: u64, k: u64) -> f64 {
    unit(mix(mix(i ^ 0x0051_ab5e) ^ k))
}

/// Light vertices: seven of ten on the walls of [-1,1]^3, three of ten in a caustic on the floor (z = -1).
pub fn light_vertices(n: usize) -> Vec<Vec3> {
    (0..n as u64)
        .map(|i| {
            let (a, b) = (u(i, 1) * 2.0 - 1.0, u(i, 2) * 2.0 - 1.0);
            if u(i, 3) < 0.3 {
                // A cardioid, the caustic of a round metal strip, blurred outwards.
                let phi = std::f64::consts::PI * a;
                let r = 0.25 * (1.0 - phi.cos()) + 0.01 * b * b * b;
                return DVec3::new(r * phi.cos(), r * phi.sin(), -1.0).as_vec3();
            }
            let side = if u(i, 4) < 0.5 { -1.0 } else { 1.0 };
            let mut p = [a as f32, b as f32, side];
            p.rotate_right((u(i, 5) * 3.0) as usize);
            Vec3::from_array(p)
        })
        .collect()
}

/// An eye vertex on the mirror.
#[derive(Clone)]
pub struct EyeVertex {
    pub position: DVec3,
    pub lobes: [Lobe; 1],
    pub key: u64,
}

/// Eye vertices on the mirror y = 1 as a camera at (0, -0.9, 0.2) sees it; neighbours in the list are neighbours on
/// the mirror, as in an image.
pub fn eye_vertices(n: usize, alpha_x: f64, alpha_y: f64) -> Vec<EyeVertex> {
    let width = (n as f64).sqrt() as u64;
    (0..n as u64)
        .map(|i| {
            let (column, row) = ((i % width) as f64, (i / width) as f64);
            let w = width as f64;
            let position =
                DVec3::new((column + u(i, 6)) / w * 1.6 - 0.8, 1.0, (row + u(i, 7)) / w * 0.8 - 0.8);
            eye_vertex(position, alpha_x, alpha_y, mix(i))
        })
        .collect()
}

/// The eye vertex in a place on the mirror.
pub fn eye_vertex(position: DVec3, alpha_x: f64, alpha_y: f64, key: u64) -> EyeVertex {
    let normal = Frame { x: DVec3::X, y: DVec3::Z, z: DVec3::NEG_Y };
    let wo = (DVec3::new(0.0, -0.9, 0.2) - position).normalize();
    EyeVertex { position, lobes: [Lobe::from_ggx_reflection(&normal, wo, alpha_x, alpha_y, 1.0)], key }
}

/// Processor seconds that this thread has had: what its neighbours took does not count. (`/proc`'s schedstat moves in
/// steps of 4 ms, and the best of many runs would be the one that lost a step.)
pub fn cpu_seconds() -> f64 {
    #[cfg(unix)]
    {
        let now = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
        now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9
    }
    #[cfg(not(unix))]
    {
        static START: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
        START.get_or_init(std::time::Instant::now).elapsed().as_secs_f64()
    }
}
