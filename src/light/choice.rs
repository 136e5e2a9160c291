//! Which light next-event estimation asks at a place: by about how much light each may throw there.
//!
//! Triangles that touch are one lamp, in a sphere and a cone around their normals, as in a node of a light tree [Conty Estevez &
//! Kulla 2018, section 4.1]. What is in between is not known, so a share of the choices goes by power, and no light is left out.

use super::lamp::Lamp;
use crate::geometry::{Mesh, SurfacePoint};
use crate::math::{Discrete, luminance, warp};
use glam::DVec3;

/// Lamps up to which all are looked at for each choice. With more, lights are chosen by power: the roulette over their points
/// serves these.
pub(super) const MOST: usize = 16;
/// Share of the choices that go by power. With 0.1 there is more noise where the lamp that seems to be the brightest is hidden
/// (benches/record/integrators.md).
const BY_POWER: f64 = 0.3;

/// Places of the surface that are looked at to tell whether to choose by place.
const PLACES: u32 = 1024;
/// Multiples of this fill the unit cube evenly: powers of the root of x^4 = x + 1.
const EVEN: DVec3 = DVec3::new(0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3);

/// A place that is lit.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    /// Mesh coordinates.
    pub position: DVec3,
    /// Unit normal, on the side that is looked at.
    pub normal: DVec3,
    /// Whether light from behind counts as well.
    pub passes: bool,
}

/// How a lamp lights its surroundings.
#[derive(Debug, Clone)]
pub(super) enum Shape {
    /// Emitting triangles.
    Area {
        /// Middle of a sphere around them.
        center: DVec3,
        /// Its radius.
        radius: f64,
        /// Middle of a cone around their normals.
        axis: DVec3,
        /// Sine of its half angle; 1 from a right angle on.
        spread: f64,
        /// Whether the back faces emit as well.
        two_sided: bool,
        /// Luminance of radiance times area, W/sr.
        intensity: f64,
    },
    /// A lamp without size.
    Lamp(Lamp),
    /// Light from one direction, and its luminance across it, W/m^2.
    Directional(DVec3, f64),
    /// Light from all around, and a half of its luminance from all directions, W/m^2.
    Sky(f64),
}

/// Lights that are chosen as one.
#[derive(Debug, Clone)]
pub(super) struct Group {
    /// Numbers of the lights.
    pub lights: Vec<u32>,
    /// Their choice by power.
    pub pick: Discrete,
    /// Their probability by power, among all lights.
    pub by_power: f64,
    /// How they light their surroundings.
    pub shape: Shape,
}

/// The choice among at most [`MOST`] lamps.
#[derive(Debug, Clone)]
pub(super) struct Choice {
    groups: Vec<Group>,
    /// Index of each light's group.
    group_of: Vec<u8>,
}

impl Choice {
    /// `None` where there is no choice, or too much of it.
    pub fn new(groups: Vec<Group>, lights: usize) -> Option<Self> {
        if !(2..=MOST).contains(&groups.len()) {
            return None;
        }
        let mut group_of = vec![0; lights];
        for (i, group) in groups.iter().enumerate() {
            group.lights.iter().for_each(|&light| group_of[light as usize] = i as u8);
        }
        Some(Self { groups, group_of })
    }

    /// What choosing by power costs: the second moment of light straight from lamps over the square of its mean, in the mean over
    /// the places of the scene's surface that any lamp faces, were nothing in between. 1: no choice is better.
    pub fn unevenness(&self, mesh: &Mesh) -> f64 {
        let areas = (0..mesh.triangles.len() as u32).map(|triangle| mesh.area(triangle));
        let Some(pick) = Discrete::new(areas) else { return 1.0 };
        let (mut sum, mut count) = (0.0, 0.0);
        for i in 0..PLACES {
            let u = (EVEN * f64::from(i + 1)).fract();
            let uv = warp::square_to_triangle(u.truncate());
            let point = SurfacePoint::at_barycentric(mesh, pick.sample(u.z) as u32, uv.x, uv.y);
            for normal in [point.ng, -point.ng] {
                let place = Place { position: point.position, normal, passes: false };
                let lights = || self.groups.iter().map(|group| (group.shape.irradiance(&place), group));
                let mean: f64 = lights().map(|(light, _)| light).sum();
                let moment: f64 =
                    lights().map(|(light, group)| (light / mean).powi(2) / group.by_power).sum();
                if moment.is_finite() {
                    (sum, count) = (sum + moment, count + 1.0);
                }
            }
        }
        if count > 0.0 { sum / count } else { 1.0 }
    }

    /// A light for a place, and its preference there; `pick` is uniform in [0,1).
    pub fn sample(&self, place: &Place, pick: f64) -> (u32, f64) {
        let mut light = [0.0; MOST];
        let mut sum = 0.0;
        for (light, group) in light.iter_mut().zip(&self.groups) {
            *light = group.shape.irradiance(place);
            sum += *light;
        }
        let (last, mut index, mut rest) = (self.groups.len() - 1, 0, pick);
        loop {
            let group = &self.groups[index];
            let probability = group.probability(light[index], sum);
            if rest < probability || index == last {
                let within = (rest / probability).clamp(0.0, 1.0 - f64::EPSILON);
                return (group.lights[group.pick.sample(within)], probability / group.by_power);
            }
            rest -= probability;
            index += 1;
        }
    }

    /// How much more often than by power a light is chosen for a place.
    pub fn preference(&self, place: &Place, light: u32) -> f64 {
        let wanted = self.group_of[light as usize] as usize;
        let (mut sum, mut brings) = (0.0, 0.0);
        for (index, group) in self.groups.iter().enumerate() {
            let light = group.shape.irradiance(place);
            brings = if index == wanted { light } else { brings };
            sum += light;
        }
        let group = &self.groups[wanted];
        group.probability(brings, sum) / group.by_power
    }
}

impl Group {
    /// The probability of choosing it where it brings `light`, of `sum` that all bring.
    #[inline(always)]
    fn probability(&self, light: f64, sum: f64) -> f64 {
        let share = light / sum;
        // Where nothing is expected, or something without bounds, all goes by power.
        if share >= 0.0 && sum < f64::INFINITY {
            BY_POWER * self.by_power + (1.0 - BY_POWER) * share
        } else {
            self.by_power
        }
    }
}

impl Shape {
    /// About how much light arrives at a place, W/m^2, if nothing is in between.
    #[inline(always)]
    fn irradiance(&self, place: &Place) -> f64 {
        match self {
            &Self::Area { center, radius, axis, spread, two_sided, intensity } => {
                // I cos cos / d^2, in which both cosines grow by what the sphere takes up of the distance: what faces a part of it
                // only is lit as well. No roots: this is done for every lamp at every vertex.
                let to = center - place.position;
                let (distance2, facing) = (to.length_squared(), -axis.dot(to));
                let leave = if two_sided { facing.abs() } else { facing } + radius;
                let leave = if spread > 0.0 { leave + spread * distance2.sqrt() } else { leave };
                let bounded = distance2 + radius * radius;
                intensity * leave.max(0.0) * (place.cos(to) + radius).max(0.0) / (bounded * bounded)
            }
            Self::Lamp(lamp) => {
                let to = lamp.position - place.position;
                let distance2 = to.length_squared();
                let w = to * (1.0 / distance2.sqrt());
                luminance(lamp.intensity(-w)) * place.cos(w).max(0.0) / distance2
            }
            Self::Directional(direction, irradiance) => irradiance * place.cos(-*direction).max(0.0),
            Self::Sky(irradiance) => *irradiance,
        }
    }
}

impl Place {
    /// The cosine to a direction, times its length.
    #[inline(always)]
    fn cos(&self, w: DVec3) -> f64 {
        let cos = self.normal.dot(w);
        if self.passes { cos.abs() } else { cos }
    }
}
