//! All lights of a scene: choosing one, and a point on it.

use super::choice::{Choice, Group, Place, Shape};
use super::distant::{DistantPoint, Surroundings};
use super::lamp::{Cone, Lamp, LampPoint};
use super::{AreaLights, EmitterPoint, Environment, LightPoint, LightSource};
use crate::geometry::{Mesh, SurfacePoint};
use crate::material::Material;
use crate::math::{Discrete, Spectrum, luminance};
use crate::settings::LightChoice;
use glam::{DVec2, DVec3};

/// How much larger the sphere around the scene is than its bounds.
const MARGIN: f64 = 1.0 + 1e-5;

/// [`Choice::unevenness`] above which lights are chosen by place. Below, what that gains is little, as the choices of a pixel's
/// samples are spread evenly, and is lost again by more shadow rays (benches/record/integrators.md).
const UNEVEN: f64 = 2.0;

/// All lights of a scene.
#[derive(Debug, Clone, Default)]
pub struct Lights {
    /// Emitting triangles; their densities have the share of light picks that they get.
    pub area: AreaLights,
    /// Share of light picks that emitting triangles get, 0..=1.
    area_share: f64,
    others: Vec<Other>,
    /// Among `others`.
    pick: Discrete,
    surroundings: Surroundings,
    /// Index in `others`.
    environment: Option<usize>,
    /// What next-event estimation goes by; `None`: by power.
    choice: Option<Choice>,
}

/// A light that is no surface.
#[derive(Debug, Clone)]
enum Other {
    Lamp(Lamp),
    Directional { direction: DVec3, irradiance: Spectrum },
    Environment(Environment),
}

impl Lights {
    /// Collects emitting triangles and `sources`; those that give no light are left out. Of environments the first
    /// counts.
    pub fn new(mesh: &Mesh, materials: &[Material], sources: &[LightSource]) -> Self {
        let mut area = AreaLights::new(mesh, materials);
        let bounds = mesh.bounds();
        let center = if bounds.is_empty() { DVec3::ZERO } else { bounds.center() };
        let radius = (bounds.radius() * MARGIN).max(f64::MIN_POSITIVE.sqrt());
        let surroundings = Surroundings { center, radius };
        let (mut others, mut powers, mut environment) = (Vec::new(), Vec::new(), None);
        for source in sources {
            let other = match source {
                &LightSource::Point { position, intensity } => {
                    Other::Lamp(Lamp { position: position - mesh.origin, intensity, cone: None })
                }
                &LightSource::Spot { position, direction, intensity, inner, outer } => {
                    let cone = Cone { axis: direction, cos_inner: inner.cos(), cos_outer: outer.cos() };
                    Other::Lamp(Lamp { position: position - mesh.origin, intensity, cone: Some(cone) })
                }
                &LightSource::Directional { direction, irradiance } => {
                    Other::Directional { direction, irradiance }
                }
                LightSource::Environment { color, image } => {
                    if environment.is_some() {
                        continue;
                    }
                    let Some(sky) = Environment::new(*color, image.clone()) else { continue };
                    Other::Environment(sky)
                }
            };
            let power = match &other {
                Other::Lamp(lamp) => lamp.power(),
                Other::Directional { irradiance, .. } => luminance(*irradiance) / surroundings.density(),
                Other::Environment(sky) => sky.total() / surroundings.density(),
            };
            if !(power > 0.0) {
                continue;
            }
            if matches!(other, Other::Environment(_)) {
                environment = Some(others.len());
            }
            others.push(other);
            powers.push(power);
        }
        let pick = Discrete::new(powers).unwrap_or_default();
        let area_share = match (area.is_empty(), others.is_empty()) {
            (false, true) => 1.0,
            (true, _) => 0.0,
            (false, false) => area.power() / (area.power() + pick.total()),
        };
        area.scale_densities(area_share);
        Self { area, area_share, others, pick, surroundings, environment, choice: None }
    }

    /// From here on next-event estimation chooses as said.
    pub fn chosen_by(mut self, rule: LightChoice, mesh: &Mesh) -> Self {
        let by_place = || Choice::new(self.groups()?, self.len());
        self.choice = match rule {
            LightChoice::Power => None,
            LightChoice::Place => by_place(),
            LightChoice::Auto => by_place().filter(|choice| choice.unevenness(mesh) > UNEVEN),
        };
        self
    }

    /// True when nothing gives light.
    pub fn is_empty(&self) -> bool {
        self.area.is_empty() && self.others.is_empty()
    }

    /// Whether there are emitting triangles only.
    pub fn only_area(&self) -> bool {
        self.others.is_empty()
    }

    /// The sphere that distant light comes through.
    pub fn surroundings(&self) -> &Surroundings {
        &self.surroundings
    }

    /// Number of emitting triangles and other lights.
    pub fn len(&self) -> usize {
        self.area.len() + self.others.len()
    }

    /// How many lights of equal power the lamps of emitting triangles (those that touch are one), point and spot lights amount
    /// to: the square of the sum of their powers over the sum of the squares; 0 where there are none.
    pub fn near_count(&self) -> f64 {
        let lamps = (0..self.others.len()).filter(|&i| matches!(self.others[i], Other::Lamp(_)));
        let (mut sum, mut squares) = (self.area_share, self.area_share.powi(2) * self.area.concentration());
        for share in lamps.map(|i| self.probability(i)) {
            (sum, squares) = (sum + share, squares + share * share);
        }
        if squares > 0.0 { sum * sum / squares } else { 0.0 }
    }

    /// For each light, something that is equal where light is sent in similar ways.
    pub(super) fn kinds(&self) -> impl Iterator<Item = (u32, [i16; 3])> {
        // Every other light is a kind of its own, told from materials by its number's last bit.
        let others = (0..self.others.len() as u32).map(|i| (u32::MAX - i, [0; 3]));
        self.area.kinds().chain(others)
    }

    /// Lights that are chosen as one. `None` where there are too many.
    fn groups(&self) -> Option<Vec<Group>> {
        let mut groups = self.area.groups(self.area_share)?;
        groups.extend(self.others.iter().enumerate().filter_map(|(i, other)| {
            let shape = match other {
                Other::Lamp(lamp) => Shape::Lamp(*lamp),
                Other::Directional { direction, irradiance } => {
                    Shape::Directional(*direction, luminance(*irradiance))
                }
                Other::Environment(sky) => Shape::Sky(0.5 * sky.total()),
            };
            let pick = Discrete::new([1.0])?;
            Some(Group { lights: vec![self.number(i)], pick, by_power: self.probability(i), shape })
        }));
        Some(groups)
    }

    /// Chooses a light for next-event estimation at a place: its number, and [`Lights::preference`] of it. `None` when there is
    /// none. `pick` is uniform in [0,1).
    #[inline]
    pub fn choose_for(&self, place: impl FnOnce() -> Place, pick: f64) -> Option<(u32, f64)> {
        match &self.choice {
            None => self.choose(pick).map(|number| (number, 1.0)),
            Some(choice) => Some(choice.sample(&place(), pick)),
        }
    }

    /// How much more often than by [`LightPoint::pdf`] next-event estimation draws points of a light for a place.
    #[inline]
    pub fn preference(&self, place: impl FnOnce() -> Place, number: u32) -> f64 {
        self.choice.as_ref().map_or(1.0, |choice| choice.preference(&place(), number))
    }

    /// A point on some light, `None` when there is none. `pick` and `u` are uniform in [0,1).
    #[inline]
    pub fn sample(&self, pick: f64, u: DVec2) -> Option<LightPoint> {
        self.choose(pick).map(|number| self.point_on(number, u))
    }

    /// The number of a light, by power.
    #[inline(always)]
    fn choose(&self, pick: f64) -> Option<u32> {
        if self.others.is_empty() {
            return self.area.choose(pick);
        }
        if pick < self.area_share {
            return self.area.choose(pick / self.area_share);
        }
        Some(self.number(self.pick.sample((pick - self.area_share) / (1.0 - self.area_share))))
    }

    /// A point on a light; `u` is uniform in the unit square.
    #[inline]
    pub fn point_on(&self, number: u32, u: DVec2) -> LightPoint {
        let Some(index) = (number as usize).checked_sub(self.area.len()) else {
            return LightPoint::Surface(self.area.point_on(number, u));
        };
        let probability = self.probability(index);
        match &self.others[index] {
            Other::Lamp(lamp) => LightPoint::Lamp(LampPoint { lamp: *lamp, probability, number }),
            &Other::Directional { direction, irradiance: radiance } => LightPoint::Distant(DistantPoint {
                direction,
                radiance,
                pdf: probability,
                delta: true,
                number,
            }),
            Other::Environment(sky) => LightPoint::Distant(sky.at(sky.sample(u), probability, number)),
        }
    }

    /// The emitter's side of a point that a path has hit, `None` when its triangle does not emit.
    #[inline(always)]
    pub fn at(&self, point: &SurfacePoint) -> Option<EmitterPoint> {
        self.area.at(point)
    }

    /// What a path that leaves the scene in a unit direction finds; `None` without an environment.
    pub fn sky(&self, direction: DVec3) -> Option<DistantPoint> {
        let index = self.environment?;
        let Other::Environment(sky) = &self.others[index] else { return None };
        Some(sky.at(direction, self.probability(index), self.number(index)))
    }

    fn probability(&self, other: usize) -> f64 {
        (1.0 - self.area_share) * self.pick.probability(other)
    }

    fn number(&self, other: usize) -> u32 {
        (self.area.len() + other) as u32
    }
}
