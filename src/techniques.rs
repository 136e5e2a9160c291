//! How often each technique tries a path, and with which lobes the roulette judges light vertices.

use crate::bsdf::Transport;
use crate::light::{EmissionGuide, LightPoint};
use crate::math::luminance;
use crate::mis::Heuristic;
use crate::roulette::{Lobe, LobePrecision, Range, probability, probability_in};
use crate::sampler::Sampler;
use crate::settings::Settings;
use crate::subpath::walk::{Rules, Walk};
use crate::subpath::{Role, Storing, Total, Vertex, World, from_light};
use glam::DVec3;
use std::f64::consts::FRAC_1_PI;
use std::ops::Deref;
use std::sync::Arc;

/// How often each technique tries a path, per eye sample: the m of docs/theory.md section 6. A technique that is off
/// has 0.
#[derive(Debug, Clone)]
pub struct Techniques {
    /// How they share a path.
    pub heuristic: Heuristic,
    /// m_0: the eye subpath hits an emitter, or the sky. (No eye subpath hits lamps without size.)
    pub eye_hits: f64,
    /// m_1: next-event estimation, relative to emission, which draws its points from the same density.
    pub next_event: f64,
    /// m_{k-1}, of light vertices that are seen at all: light subpaths seen by the camera, light subpaths over eye samples.
    pub light_image: f64,
    /// m_s, 2 <= s <= k-2, where the roulette is off: of light vertices of any kind.
    pub base: f64,
    /// The rest of m_1: points of lights that are not distant, judged by the roulette.
    pub emitters: Option<EmitterRoulette>,
    /// m_s where the roulette is on.
    pub roulette: Option<Roulette>,
    /// How light vertices are merged with eye vertices.
    pub merging: Option<Merging>,
    /// Which light vertices the roulette, merging and the camera use: a probability that is part of their m.
    pub storing: Storing,
    /// Where light subpaths are sent; `None`: by the cosine.
    pub guide: Option<Arc<EmissionGuide>>,
}

/// Vertex merging: light vertices near an eye vertex count as if they were it.
#[derive(Debug, Clone, Copy)]
pub struct Merging {
    /// n_L, the number of light subpaths emitted.
    pub light_subpaths: f64,
    /// How near, world units.
    pub radius: f64,
}

impl Merging {
    /// eta = n_L pi r^2: how many light subpaths end in an eye vertex's disc, per unit of their density.
    pub fn eta(&self) -> f64 {
        self.light_subpaths * std::f64::consts::PI * self.radius * self.radius
    }
}

/// Where and how hard the roulette plays.
#[derive(Debug, Clone, Copy)]
pub struct Roulette {
    /// m_s / P: light subpaths that an eye sample counts for having tried. All samples of a pixel judge the same light
    /// vertices, so that for the weights many of them share these, though each one really tries them all.
    pub light_subpaths: f64,
    /// C, world units squared.
    pub constant: f64,
    /// Most that C times a vertex's lobes may have on their axes, world units squared: heavier lobes are scaled down to
    /// it. Infinity: no limit.
    pub most: f64,
    /// Largest GGX roughness at which it plays.
    pub max_alpha: f64,
    /// How lobes are made and judged.
    pub numerics: Numerics,
}

/// How the roulette's lobes are made and judged: part of P, and so of the query and of every weight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Numerics {
    /// Shape of the ranges.
    pub range: Range,
    /// Factor on how much lobes are widened at grazing angles.
    pub widening: f64,
    /// Weight of an even lobe under that of reflection, as a share of it; not where light passes.
    pub floor: f64,
    /// Arithmetic of the probabilities.
    pub precision: LobePrecision,
}

impl Numerics {
    /// What the default settings say.
    pub const DEFAULT: Self =
        Self { range: Range::Ellipsoid, widening: 1.0, floor: 0.0, precision: LobePrecision::F64 };

    /// What settings say.
    pub fn of(settings: &Settings) -> Self {
        Self {
            range: settings.range,
            widening: settings.lobe_widening,
            floor: settings.lobe_floor,
            precision: settings.lobe_precision,
        }
    }
}

impl Roulette {
    /// m_s of an edge with this offset (light - eye).
    pub fn density(&self, lobes: &Lobes, offset: DVec3) -> f64 {
        let precision = self.numerics.precision;
        self.light_subpaths * probability_in(precision, lobes, self.constant, lobes.position, offset)
    }
}

/// The roulette over points of lights, at eye vertices with lobes.
#[derive(Debug, Clone, Copy)]
pub struct EmitterRoulette {
    /// N, points drawn, those of distant lights included.
    pub points: f64,
    /// M, eye samples of a pixel, which judge the same points.
    pub samples: f64,
    /// C, world units squared.
    pub constant: f64,
}

impl EmitterRoulette {
    /// Its part of m_1, for a point at an offset (light - eye): about as many different points as the samples of a pixel
    /// keep, for each of them.
    pub fn density(&self, lobes: &[Lobe], offset: DVec3) -> f64 {
        let p = probability(lobes, self.constant, offset);
        self.points * p / (1.0 + (self.samples - 1.0) * p)
    }
}

/// The roulette's lobes at a vertex: of reflection, and of transmission where light passes, or else of a diffuse base and
/// the floor under reflection. (There are no more than two, for what is copied with every eye vertex.)
#[derive(Debug, Clone, Copy)]
pub struct Lobes {
    list: [Lobe; 2],
    count: usize,
    /// The vertex.
    position: DVec3,
}

impl Lobes {
    /// Where the roulette is off.
    pub const NONE: Self = Self { list: [Lobe::NONE; 2], count: 0, position: DVec3::ZERO };

    fn push(&mut self, lobe: Lobe) {
        self.list[self.count] = lobe;
        self.count += 1;
    }

    /// Scales them down until the sum of their weights is at most `most`.
    fn limit(&mut self, most: f64) {
        let sum: f64 = self.iter().map(Lobe::weight).sum();
        if sum > most {
            self.list.iter_mut().for_each(|lobe| *lobe = lobe.with_weight(lobe.weight() * (most / sum)));
        }
    }
}

impl Deref for Lobes {
    type Target = [Lobe];

    fn deref(&self) -> &[Lobe] {
        &self.list[..self.count]
    }
}

impl Techniques {
    /// All of them off.
    pub fn none(heuristic: Heuristic) -> Self {
        Self {
            heuristic,
            eye_hits: 0.0,
            next_event: 0.0,
            emitters: None,
            light_image: 0.0,
            base: 0.0,
            roulette: None,
            merging: None,
            storing: Storing::ALL,
            guide: None,
        }
    }

    /// The lobes by which the roulette judges light vertices, at a vertex seen from `w_eye`; none where it is off.
    pub fn lobes(&self, vertex: &Vertex, w_eye: DVec3) -> Lobes {
        let mut lobes = Lobes::NONE;
        let (Some(roulette), Some(glossy)) = (&self.roulette, vertex.bsdf.glossy()) else { return lobes };
        let Numerics { range, widening, floor, .. } = roulette.numerics;
        let (alpha_x, alpha_y) = (glossy.alpha_x, glossy.alpha_y);
        if alpha_x.max(alpha_y) > roulette.max_alpha {
            return lobes;
        }
        // The frame's z on the viewer's side: of the model itself, only which side is inside changes with that.
        let mut frame = vertex.frame;
        let outside = frame.z.dot(w_eye) >= 0.0;
        if !outside {
            (frame.x, frame.z) = (-frame.x, -frame.z);
        }
        lobes.position = vertex.point.position;
        let alpha = (alpha_x, alpha_y);
        let reflected = Lobe::from_ggx_reflection_widened(&frame, w_eye, alpha, 1.0, widening);
        let transmitted = glossy.eta.map(|eta| {
            let eta = if outside { eta } else { 1.0 / eta };
            Lobe::from_ggx_transmission_widened(&frame, w_eye, alpha, eta, 1.0, widening)
        });
        let axes = [Some(reflected), transmitted];
        let mut even = 0.0;
        for lobe in axes.into_iter().flatten() {
            // Without a weight nothing would ever be kept, though there may be light beside the axis.
            let axis = lobe.frame().z;
            let weight = luminance(vertex.factor(w_eye, axis)) * vertex.cos_ng(axis);
            if weight > 0.0 {
                let lobe = lobe.with_weight(weight);
                even += floor * lobe.with_equal_range(Range::Sphere).weight();
                lobes.push(lobe.with_equal_range(range));
            }
        }
        if let Some(albedo) = vertex.bsdf.diffuse_base() {
            // Half of the greatest value of f cos, the mean over the hemisphere.
            even += 0.5 * FRAC_1_PI * luminance(albedo);
        }
        if even > 0.0 && lobes.count < lobes.list.len() {
            lobes.push(Lobe::sphere(even));
        }
        lobes.limit(roulette.most / roulette.constant);
        lobes
    }

    /// The part of m_1 that [`Techniques::emitters`] has at an eye vertex. `offset`: from there to the light's point;
    /// `None`: it is distant.
    pub fn emitter_points(&self, lobes: &Lobes, offset: Option<DVec3>) -> f64 {
        match (&self.emitters, offset) {
            (Some(emitters), Some(offset)) if !lobes.is_empty() => emitters.density(lobes, offset),
            _ => 0.0,
        }
    }

    /// m_1, likewise. `preference`: [`Lights::preference`](crate::light::Lights::preference) of the light there.
    pub fn direct(&self, lobes: &Lobes, offset: Option<DVec3>, preference: f64) -> f64 {
        self.next_event * preference + self.emitter_points(lobes, offset)
    }

    /// m_s of an edge between two surfaces, neither of them delta: where the roulette is off, and, over the probability
    /// of storing the light-side one, where it plays. `lobes`: those of the eye-side vertex; `offset`: from there to
    /// the light-side vertex.
    pub fn connection(&self, lobes: &Lobes, offset: DVec3) -> Total {
        match &self.roulette {
            Some(roulette) if !lobes.is_empty() => {
                Total { stored: roulette.density(lobes, offset), ..Total::default() }
            }
            _ => Total::known(self.base),
        }
    }

    /// The probability with which a light vertex was stored.
    pub fn stored(&self, light: &Walk) -> f64 {
        self.storing.probability(Role::Stored, light.origins[0])
    }

    /// 1 or 0: whether the camera is connected to a light vertex.
    pub fn seen(&self, light: &Walk) -> f64 {
        self.storing.probability(Role::Seen, light.origins[0])
    }

    /// 1 or 0: whether eye vertices are merged with a light vertex.
    pub fn merged(&self, light: &Walk) -> f64 {
        self.storing.probability(Role::Merged, light.origins[0])
    }

    /// m of the edge that leads to the light vertex's predecessor, were the light vertex an eye vertex seen from
    /// `w_eye`.
    pub fn before(&self, light: &Walk, w_eye: DVec3) -> f64 {
        if light.after_delta || light.vertex.bsdf.is_delta() {
            return 0.0;
        }
        if light.depth == 1 {
            if self.emitters.is_none() || light.from_afar {
                return self.next_event * light.preference;
            }
            let lobes = self.lobes(&light.vertex, w_eye);
            return self.direct(&lobes, Some(light.to_previous()), light.preference);
        }
        if self.roulette.is_none() {
            return self.base;
        }
        let m = self.connection(&self.lobes(&light.vertex, w_eye), light.to_previous());
        m.known + m.stored * self.storing.probability(Role::Stored, light.origins[1])
    }

    /// Density of the light subpath that leaves a light in a direction for the surface point `first`: 1/sr; of distant
    /// light 1/m^2 across it.
    pub fn emission_pdf(&self, world: &World<'_>, light: &LightPoint, direction: DVec3, first: DVec3) -> f64 {
        match &self.guide {
            None => light.emission_pdf(world.lights.surroundings(), direction),
            Some(guide) => guide.pdf(light, direction, first),
        }
    }

    /// How often an eye subpath that could end on a light tries.
    pub fn eye_hits(&self, light: &LightPoint) -> f64 {
        if light.is_delta() { 0.0 } else { self.eye_hits }
    }

    /// Starts a light subpath.
    pub fn emit(&self, world: &World<'_>, sampler: &Sampler) -> Option<Walk> {
        let rules = self.rules(Transport::Importance);
        from_light::emit(world, &rules, self.guide.as_deref(), sampler, self.eye_hits)
    }

    /// What steps of a subpath need to know.
    pub fn rules(&self, transport: Transport) -> Rules {
        Rules { transport, heuristic: self.heuristic, storing: self.storing }
    }

    /// eta at eye vertices that light vertices are merged with; 0 without merging.
    pub fn eta(&self) -> f64 {
        self.merging.map_or(0.0, |merging| merging.eta())
    }

    /// eta at a light vertex from which the path goes on to another that is not delta, or to the camera.
    pub fn eta_of_light(&self, light: &Walk) -> f64 {
        // What smooth surfaces show to the camera, no other technique than merging finds from there.
        if self.storing.shown_only { 0.0 } else { self.merged(light) * self.eta() }
    }

    /// L_s of a technique whose eye side ends with an edge along `w_eye` at the light vertex; `density`: in which the
    /// eye side would choose that vertex.
    pub(crate) fn light_others(&self, light: &Walk, density: f64, w_eye: DVec3) -> f64 {
        self.heuristic.others(density, self.light_total(light, w_eye, self.eta_of_light(light)))
    }

    /// The sum over the light side's techniques up to a light vertex from which the path goes on along `w_eye`; `merging`: eta
    /// there.
    pub fn light_total(&self, light: &Walk, w_eye: DVec3, merging: f64) -> f64 {
        let back = light.vertex.pdf_w(w_eye, light.vertex.wo);
        self.heuristic.total(&light.side, self.before(light, w_eye), back, merging)
    }

    /// Goes on along a light subpath.
    pub fn next_light(&self, world: &World<'_>, light: &Walk, sampler: &Sampler) -> Option<Walk> {
        light.next(world, &self.rules(Transport::Importance), sampler, |s| {
            if s.delta {
                return Total::known(self.heuristic.total(&light.side, 0.0, s.pdf_rev, 0.0));
            }
            let merging = self.eta_of_light(light);
            Total::known(self.heuristic.total(&light.side, self.before(light, s.wi), s.pdf_rev, merging))
        })
    }
}
