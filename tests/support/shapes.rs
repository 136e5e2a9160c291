//! Random rays, triangles and closed surfaces for tests of ray queries.

use super::Random;
use glam::{DQuat, DVec2, DVec3};
use hrr::geometry::{Mesh, SurfacePoint};
use std::f64::consts::TAU;

impl Random {
    /// Uniform in the cube [-1,1)^3.
    pub fn in_cube(&mut self) -> DVec3 {
        DVec3::new(self.u1(), self.u1(), self.u1()) * 2.0 - 1.0
    }

    /// Uniform on the sphere.
    pub fn direction(&mut self) -> DVec3 {
        let (z, phi) = (self.u1() * 2.0 - 1.0, self.u1() * TAU);
        DVec2::from_angle(phi).extend(0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z
    }

    /// A direction on either side of a plane, at angles from steep to so flat (cosine `least`) that all are equally
    /// likely on a logarithmic scale.
    pub fn grazing(&mut self, normal: DVec3, least: f64) -> DVec3 {
        let cos = least.powf(self.u1()).copysign(self.u1() - 0.5);
        let (x, y) = normal.any_orthonormal_pair();
        let (sin_phi, cos_phi) = (self.u1() * TAU).sin_cos();
        (normal * cos + (x * cos_phi + y * sin_phi) * (1.0 - cos * cos).sqrt()).normalize()
    }

    /// Barycentric coordinates, uniform in the triangle.
    pub fn barycentric(&mut self) -> DVec2 {
        let p = self.u2();
        if p.x + p.y > 1.0 { 1.0 - p } else { p }
    }

    /// A rotation.
    pub fn rotation(&mut self) -> DQuat {
        DQuat::from_axis_angle(self.direction(), self.u1() * TAU)
    }

    /// A point on a random triangle of a mesh; no barycentric weight is below `margin`.
    pub fn surface_point(&mut self, mesh: &Mesh, margin: f64) -> SurfacePoint {
        let triangle = (self.u1() * mesh.triangles.len() as f64) as u32;
        let b = self.barycentric() * (1.0 - 3.0 * margin) + margin;
        SurfacePoint::at_barycentric(mesh, triangle, b.x, b.y)
    }
}

/// A mesh of one material.
pub fn mesh(positions: &[DVec3], triangles: &[[u32; 3]]) -> Mesh {
    Mesh {
        positions: positions.iter().map(|p| p.as_vec3()).collect(),
        triangles: triangles.to_vec(),
        materials: vec![0; triangles.len()],
        ..Mesh::default()
    }
}

/// Unconnected triangles in the cube [-1,1]^3, of sizes up to `size`.
pub fn soup(random: &mut Random, triangles: u32, size: f64) -> Mesh {
    let corners = |_| {
        let (center, size) = (random.in_cube() * (1.0 - size), size * random.u1());
        [random.in_cube(), random.in_cube(), random.in_cube()].map(|p| center + p * size)
    };
    let positions: Vec<DVec3> = (0..triangles).flat_map(corners).collect();
    let indices: Vec<[u32; 3]> = (0..triangles).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    mesh(&positions, &indices)
}

/// Moves all vertices.
pub fn moved(mut mesh: Mesh, place: impl Fn(DVec3) -> DVec3) -> Mesh {
    for p in &mut mesh.positions {
        *p = place(p.as_dvec3()).as_vec3();
    }
    mesh
}

/// The cube [-1,1]^3, each side cut into `n` x `n` squares of two triangles. Front faces outside.
pub fn cube(n: u32) -> Mesh {
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let first = positions.len() as u32;
            for j in 0..=n {
                for i in 0..=n {
                    let mut p = DVec3::splat(sign);
                    p[(axis + 1) % 3] = 2.0 * f64::from(i) / f64::from(n) - 1.0;
                    p[(axis + 2) % 3] = 2.0 * f64::from(j) / f64::from(n) - 1.0;
                    positions.push(p);
                }
            }
            for j in 0..n {
                for i in 0..n {
                    let a = first + j * (n + 1) + i;
                    let [b, c, d] = [a + 1, a + n + 1, a + n + 2];
                    triangles.extend(if sign > 0.0 {
                        [[a, b, d], [a, d, c]]
                    } else {
                        [[a, d, b], [a, c, d]]
                    });
                }
            }
        }
    }
    mesh(&positions, &triangles)
}

/// A convex approximation of the unit sphere: a cube with its vertices pushed out.
pub fn ball(n: u32) -> Mesh {
    let mut ball = moved(cube(n), |p| p / p.length());
    for pair in 0..ball.triangles.len() / 2 {
        // Of a square's two diagonals, one makes a ridge and the other a valley.
        let [first, second] = [ball.triangles[2 * pair], ball.triangles[2 * pair + 1]];
        let shared = |v: &u32| first.contains(v) && second.contains(v);
        let apex = |t: [u32; 3]| t.iter().position(|v| !shared(v)).unwrap();
        let (i, other) = (apex(first), second[apex(second)]);
        let [tip, left, right] = [first[i], first[(i + 1) % 3], first[(i + 2) % 3]];
        let height = ball.positions[other as usize].as_dvec3() - ball.positions[tip as usize].as_dvec3();
        if height.dot(ball.scaled_normal(2 * pair as u32)) > 0.0 {
            ball.triangles[2 * pair] = [tip, left, other];
            ball.triangles[2 * pair + 1] = [tip, other, right];
        }
    }
    ball
}

/// A tetrahedron that is flat along z: its edges there are as sharp as `height` says. Front faces outside.
pub fn wedge(height: f64) -> Mesh {
    let positions = [
        DVec3::new(1.0, 0.0, 0.0),
        DVec3::new(-0.5, 0.9, 0.0),
        DVec3::new(-0.5, -0.9, 0.0),
        DVec3::Z * height,
    ];
    mesh(&positions, &[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
}
