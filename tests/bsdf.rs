//! Every BSDF draws what its density says, weighs it by its value, scatters no more than it gets, and is the same
//! seen from either end of a path.

use crate::support::Random;
use crate::support::chart::{Chart, Reflected, Refracted, Slopes};
use glam::DVec3;
use hrr::bsdf::{Bsdf, Conductor, Dielectric, Lambert, Reflectance};
use hrr::math::Spectrum;

mod coated;
mod distribution;
mod energy;
mod precision;
mod robustness;
mod smooth;
mod symmetry;

/// (alpha_x, alpha_y): from as rough as it gets to as smooth as is told from a mirror.
const ROUGHNESS: [(f64, f64); 9] = [
    (1.0, 1.0),
    (0.3, 0.3),
    (0.1, 0.1),
    (1e-2, 1e-2),
    (1e-4, 1e-4),
    (1e-7, 1e-7),
    (1e-4, 1e-2),
    (0.5, 0.05),
    (0.0, 1.0),
];

/// A model with all that a chart of its lobes needs to know.
struct Case {
    name: String,
    bsdf: Bsdf,
    slopes: Slopes,
    /// Index inside over outside; `None` for reflectors.
    ior: Option<f64>,
}

impl Case {
    /// Index of the medium on the side of `w`.
    fn index(&self, w: DVec3) -> f64 {
        if w.z > 0.0 { 1.0 } else { self.ior.unwrap_or(1.0) }
    }

    /// Charts of all directions that light from `wo` is scattered to.
    fn atlas(&self, wo: DVec3) -> Vec<Box<dyn Chart<DVec3>>> {
        let slopes = self.slopes;
        let mut atlas: Vec<Box<dyn Chart<DVec3>>> = vec![Box::new(Reflected { wo, slopes })];
        if let Some(ior) = self.ior {
            atlas.push(Box::new(Refracted { wo, ior, slopes }));
        }
        atlas
    }
}

/// A metal that absorbs differently in every channel.
const COPPER: Reflectance =
    Reflectance::Complex { eta: Spectrum::new(0.21, 1.0, 1.2), k: Spectrum::new(3.6, 2.6, 2.3) };

/// Facets that absorb nothing.
const WHITE: Reflectance = Reflectance::Schlick { f0: Spectrum::ONE };

fn conductor(reflectance: Reflectance, (alpha_x, alpha_y): (f64, f64)) -> Case {
    Case {
        name: format!("conductor ({alpha_x}, {alpha_y})"),
        bsdf: Bsdf::Conductor(Conductor::new(reflectance, alpha_x, alpha_y)),
        slopes: Slopes { alpha_x: alpha_x.max(1e-7), alpha_y: alpha_y.max(1e-7) },
        ior: None,
    }
}

fn dielectric(ior: f64, (alpha_x, alpha_y): (f64, f64)) -> Case {
    Case {
        name: format!("dielectric {ior} ({alpha_x}, {alpha_y})"),
        bsdf: Bsdf::Dielectric(Dielectric::new(ior, alpha_x, alpha_y)),
        slopes: Slopes { alpha_x: alpha_x.max(1e-7), alpha_y: alpha_y.max(1e-7) },
        ior: Some(ior),
    }
}

fn lambert() -> Case {
    Case {
        name: "lambert".into(),
        bsdf: Bsdf::Lambert(Lambert::new(Spectrum::new(0.2, 0.5, 1.0))),
        slopes: Slopes { alpha_x: 1.0, alpha_y: 1.0 },
        ior: None,
    }
}

/// All models that are not delta lobes.
fn cases() -> Vec<Case> {
    let mut cases = vec![
        lambert(),
        dielectric(0.7, (0.3, 0.3)),
        dielectric(1.01, (0.3, 0.3)),
        dielectric(2.4, (0.1, 0.1)),
    ];
    cases.extend(ROUGHNESS.map(|a| conductor(COPPER, a)));
    cases.extend(ROUGHNESS.map(|a| dielectric(1.5, a)));
    cases
}

/// The direction at an angle to +z (degrees), off all axes of symmetry.
fn at_angle(degrees: f64) -> DVec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let (y, x) = 1.1f64.sin_cos();
    DVec3::new(sin * x, sin * y, cos)
}

/// Directions to look from: along the normal, at 45, 85 and 89.9 degrees, and the same from below.
fn views() -> Vec<DVec3> {
    [0.0, 45.0, 85.0, 89.9].into_iter().map(at_angle).flat_map(|w| [w, DVec3::new(w.y, w.x, -w.z)]).collect()
}

/// A direction uniform on the sphere.
fn any_direction(rng: &mut Random) -> DVec3 {
    hrr::math::warp::square_to_sphere(rng.u2())
}
