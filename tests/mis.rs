//! The weights of multiple importance sampling against their definition: on random paths through a scene with every
//! kind of material, each technique's weight by the recursion must be its density over the sum of all densities, which
//! are multiplied out here vertex by vertex.

use crate::support::scenes;
use glam::{DVec2, DVec3};
use hrr::bsdf::Transport;
use hrr::connect::{EyeVertex, Onward, connect_camera};
use hrr::light::distant::DistantPoint;
use hrr::light::{EmissionGuide, LightPoint};
use hrr::math::Spectrum;
use hrr::mis::Heuristic;
use hrr::roulette::{Range, probability};
use hrr::sampler::{Purpose, Sampler, Stream};
use hrr::scene::Scene;
use hrr::settings::{Backend, LightChoice, Settings};
use hrr::subpath::walk::Start;
use hrr::subpath::{Origin, Role, Storing, Total, Vertex, Walk, World};
use hrr::techniques::{EmitterRoulette, Merging, Numerics, Roulette, Techniques};
use hrr::visibility::offset;
use std::sync::Arc;

/// Numbers with no special relation to each other.
const TECHNIQUES: Techniques = Techniques {
    heuristic: Heuristic::Balance,
    eye_hits: hrr::mis::EYE_HITS,
    next_event: 1.0,
    light_image: 700.0,
    base: 1.7,
    emitters: Some(EmitterRoulette { points: 230.0, samples: 3.0, constant: 0.03 }),
    roulette: Some(Roulette {
        light_subpaths: 1400.0,
        constant: 0.02,
        most: 0.1,
        max_alpha: 0.3,
        numerics: Numerics::DEFAULT,
    }),
    merging: Some(Merging { light_subpaths: 1400.0, radius: 0.01 }),
    storing: Storing { share: 0.3, max_alpha: 0.22, lamps: false, shown_only: false },
    guide: None,
};

/// A whole path: a point of a light, surface vertices from the light's side, the camera.
struct Path {
    light: LightPoint,
    surfaces: Vec<Vertex>,
    /// On the lens.
    camera: DVec3,
}

impl Path {
    fn position(&self, i: usize) -> DVec3 {
        match i {
            0 => match &self.light {
                LightPoint::Surface(emitter) => emitter.point.position,
                LightPoint::Lamp(l) => l.lamp.position,
                // As far away as it is: only the direction counts.
                LightPoint::Distant(d) => self.surfaces[0].point.position - d.direction,
            },
            i if i <= self.surfaces.len() => self.surfaces[i - 1].point.position,
            _ => self.camera,
        }
    }

    fn to(&self, from: usize, to: usize) -> DVec3 {
        (self.position(to) - self.position(from)).normalize()
    }

    /// |cos| at vertex `at` of the edge from vertex `from`, over their squared distance; a light that is no surface has
    /// no cosine, and a distant one no distance.
    fn g(&self, from: usize, at: usize) -> f64 {
        let d = self.position(at) - self.position(from);
        let ng = match (&self.light, at) {
            (LightPoint::Surface(emitter), 0) => emitter.point.ng,
            (_, 0) => d.normalize(),
            _ => self.surfaces[at - 1].point.ng,
        };
        ng.dot(d).abs() / d.length() / d.length_squared()
    }

    /// Density of scattering at surface vertex `i`, coming from one neighbour, to the other, 1/sr.
    fn pdf_w(&self, i: usize, from: usize, to: usize) -> f64 {
        let vertex = &self.surfaces[i - 1];
        let (from, to) = (self.to(i, from), self.to(i, to));
        if !vertex.bsdf.is_delta() {
            return vertex.pdf_w(from, to);
        }
        // A delta lobe's density is told by sampling it.
        let local = vertex.frame.to_local(from);
        [0.0, 1.0 - 1e-12]
            .into_iter()
            .filter_map(|lobe| vertex.bsdf.sample(local, Transport::Radiance, lobe, DVec2::ZERO))
            .find(|s| (vertex.frame.to_world(s.wi) - to).length() < 1e-6)
            .map_or(0.0, |s| s.pdf * vertex.bsdf.survival())
    }

    /// m_1 of next-event estimation and of the roulette over points of lights.
    fn direct(&self, world: &World<'_>, t: &Techniques) -> [f64; 2] {
        let preference = world.lights.preference(|| self.surfaces[0].place(), self.light.number());
        let by_roulette = match (&t.emitters, &self.light) {
            (None, _) | (_, LightPoint::Distant(_)) => 0.0,
            (Some(e), _) => {
                let lobes = t.lobes(&self.surfaces[0], self.to(1, 2));
                let p = probability(&lobes, e.constant, self.position(0) - self.position(1));
                // The mean of 1 / (N P), for one sample, and M / N, for M that keep the same points.
                1.0 / (1.0 / (e.points * p) + (e.samples - 1.0) / e.points)
            }
        };
        [t.next_event * preference, by_roulette]
    }

    /// Densities, up to a common factor, of all techniques s = 0 .. k-1, and of merging at x_0 .. x_{k-1}.
    fn densities(&self, world: &World<'_>, t: &Techniques) -> [Vec<f64>; 2] {
        let k = self.surfaces.len() + 2;
        let delta = |i: usize| i >= 1 && i <= k - 2 && self.surfaces[i - 1].bsdf.is_delta();
        let fw = |i: usize| match i {
            0 => self.light.pdf(),
            1 => {
                let first = self.surfaces[0].point.position;
                t.emission_pdf(world, &self.light, self.to(0, 1), first) * self.g(0, 1)
            }
            _ => self.pdf_w(i - 1, i - 2, i) * self.g(i - 1, i),
        };
        let rv = |i: usize| {
            if i == k - 2 {
                return world.camera.pdf_w(self.to(k - 1, i)) * self.g(k - 1, i);
            }
            self.pdf_w(i + 1, i + 2, i) * self.g(i + 1, i)
        };
        // The probability of vertex i's role: what threw light on it decides.
        let has = |role: Role, i: usize| {
            let origin = if i == 1 { Origin::Lamp } else { t.storing.origin(&self.surfaces[i - 2].bsdf) };
            match (role, origin) {
                (_, Origin::Lamp) if !t.storing.lamps => 0.0,
                (Role::Stored, Origin::Lamp | Origin::Broad) => t.storing.share,
                (Role::Merged, Origin::Lamp | Origin::Broad) if t.storing.shown_only => 0.0,
                _ => 1.0,
            }
        };
        let m = |s: usize| {
            if s == 0 {
                return if self.light.is_delta() { 0.0 } else { t.eye_hits };
            }
            if delta(s - 1) || delta(s) || k == 2 {
                return 0.0;
            }
            if s == 1 {
                return self.direct(world, t).iter().sum();
            }
            if s == k - 1 {
                return t.light_image * has(Role::Seen, s - 1);
            }
            let lobes = t.lobes(&self.surfaces[s - 1], self.to(s, s + 1));
            let offset = self.position(s - 1) - self.position(s);
            let m = t.connection(&lobes, offset);
            m.known + m.stored * has(Role::Stored, s - 1)
        };
        let b = |s: usize| (0..s).map(fw).product::<f64>() * (s..k - 1).map(rv).product::<f64>();
        let eta = t.merging.map_or(0.0, |m| m.light_subpaths * std::f64::consts::PI * m.radius * m.radius);
        // Only delta surfaces, one at least, between the vertex and the camera.
        let shown = |i: usize| i < k - 2 && (i + 1..=k - 2).all(delta);
        let merging = |i: usize| match i == 0 || i > k - 2 || delta(i) || t.storing.shown_only && !shown(i) {
            true => 0.0,
            false => has(Role::Merged, i) * eta * b(i) * fw(i),
        };
        [(0..k).map(|s| m(s) * b(s)).collect(), (0..k).map(merging).collect()]
    }

    /// The weight of connecting with s light vertices (`kind` 0), or of merging at x_s (`kind` 1), by definition.
    fn weight(&self, world: &World<'_>, t: &Techniques, kind: usize, s: usize) -> f64 {
        let exponent = match t.heuristic {
            Heuristic::Balance => 1.0,
            Heuristic::Power => 2.0,
        };
        let d = self.densities(world, t).map(|d| d.into_iter().map(|d| d.powf(exponent)).collect::<Vec<_>>());
        d[kind][s] / d.iter().flatten().sum::<f64>()
    }
}

fn light_walks(world: &World<'_>, t: &Techniques, sampler: &Sampler, length: usize) -> Vec<Walk> {
    let mut walks = Vec::new();
    let mut walk = t.emit(world, sampler);
    while let Some(light) = walk.filter(|_| walks.len() < length) {
        walks.push(light);
        walk = t.next_light(world, &light, sampler);
    }
    walks
}

fn eye_walks(world: &World<'_>, t: &Techniques, sampler: &Sampler, length: usize) -> Vec<EyeVertex> {
    let mut walks = Vec::new();
    let mut eye = EyeVertex::first(world, t, sampler.u2(0, Purpose::Raster) * 32.0, sampler).vertex();
    while let Some(vertex) = eye.filter(|_| walks.len() < length) {
        walks.push(vertex);
        eye = vertex.next(world, t, sampler).vertex();
    }
    walks
}

/// What an eye walk finds that leaves the scene, with the throughput there.
fn into_the_sky(
    world: &World<'_>,
    t: &Techniques,
    last: &EyeVertex,
    sampler: &Sampler,
) -> Option<(DistantPoint, Spectrum, Spectrum)> {
    let Onward::Sky(value) = last.next(world, t, sampler) else { return None };
    let s = last.walk.vertex.sample(Transport::Radiance, sampler, last.walk.depth)?;
    Some((world.lights.sky(s.wi)?, value, last.walk.throughput * s.weight))
}

/// The light walk's next vertex, were it `end`; `None` where it cannot get there.
fn led_to(world: &World<'_>, t: &Techniques, light: &Walk, end: &Vertex) -> Option<Walk> {
    let y = &light.vertex;
    let direction = (end.point.position - y.point.position).normalize();
    let pdf_w = y.pdf_w(y.wo, direction);
    let start = Start {
        ray: offset::leave(&y.point, direction),
        origin: y.point.position,
        direction,
        pdf_w,
        cos: y.cos_ng(direction),
        total: Total::known(t.light_total(light, direction, t.eta_of_light(light))),
        distant: false,
    };
    let throughput = light.throughput * y.factor(direction, y.wo) * (start.cos / pdf_w);
    let walk = Walk {
        depth: light.depth + 1,
        origins: [t.storing.origin(&y.bsdf), light.origins[0]],
        ..Walk::follow(world, &t.rules(Transport::Importance), &start, throughput)?
    };
    let there = (walk.vertex.point.position - end.point.position).length() < 1e-9;
    (pdf_w > 0.0 && there).then_some(walk)
}

fn close(what: &str, by_recursion: f64, by_definition: f64) {
    let error = (by_recursion - by_definition).abs();
    assert!(error < 1e-10 * by_definition.abs() + 1e-13, "{what}: {by_recursion} is not {by_definition}");
}

#[test]
fn recursion_equals_the_definition() {
    let scene = scenes::box_of_everything();
    for heuristic in Heuristic::ALL {
        check_guided(&scene, heuristic, LightChoice::Power);
    }
}

/// Lamps without size, a sun and a sky beside the emitting triangles, seen through a lens; the box has no front, where
/// these come in. They are chosen by place.
#[test]
fn recursion_equals_the_definition_with_lights_of_every_kind() {
    let mut scene = scenes::box_of_everything();
    scene.lights = scenes::lights_of_every_kind();
    (scene.camera.aperture_radius, scene.camera.focus_distance) = (0.2, 2.0);
    for heuristic in Heuristic::ALL {
        check_guided(&scene, heuristic, LightChoice::Place);
    }
}

/// Roughness that varies decides what is stored; a smooth coat is left out, as these paths know delta vertices only.
#[test]
fn recursion_equals_the_definition_with_textures() {
    let mut scene = scenes::box_of_textures();
    scene.materials[0] = scenes::box_of_everything().materials[7].clone();
    check_guided(&scene, Heuristic::Balance, LightChoice::Power);
}

#[test]
fn recursion_equals_the_definition_with_other_numerics() {
    let scene = scenes::box_of_everything();
    let settings = Settings { visibility: Backend::Obvhs, ..scenes::settings() };
    let world = World::new(&scene, &settings).unwrap();
    let default = Numerics::DEFAULT;
    for numerics in [
        Numerics { range: Range::Spheroid, ..default },
        Numerics { range: Range::Sphere, ..default },
        Numerics { widening: 0.0, floor: 0.1, ..default },
    ] {
        let roulette = TECHNIQUES.roulette.map(|roulette| Roulette { numerics, ..roulette });
        assert_eq!(check(&world, &Techniques { roulette, ..TECHNIQUES }), 0);
    }
}

fn check_guided(scene: &Scene, heuristic: Heuristic, light_choice: LightChoice) {
    let settings = Settings { visibility: Backend::Obvhs, light_choice, ..scenes::settings() };
    let world = World::new(scene, &settings).unwrap();
    // Light that goes to one side is useful, and more so the farther.
    let observations = (1..1000).map(|i| {
        let light = world.lights.sample(f64::from(i) / 1000.0, DVec2::splat(0.5)).unwrap();
        (light, DVec2::new(f64::from(i) / 1300.0, 0.2), f64::from(i))
    });
    let guide = EmissionGuide::learn(&world.lights, observations).map(Arc::new);
    assert!(guide.is_some());
    for guide in [None, guide] {
        for (lamps, shown_only) in [(false, false), (true, false), (false, true)] {
            let storing = Storing { lamps, shown_only, ..TECHNIQUES.storing };
            let t = Techniques { heuristic, guide: guide.clone(), storing, ..TECHNIQUES };
            let preferred = check(&world, &t);
            assert_eq!(preferred >= 100, light_choice == LightChoice::Place, "{preferred}");
        }
    }
}

/// The number of lights that were chosen with another probability than by power.
fn check(world: &World<'_>, t: &Techniques) -> usize {
    let mut checked = [0usize; 7];
    let (mut with_delta, mut preferred) = (0, 0);
    // Few are merged that smooth surfaces show.
    let paths: u64 = if t.storing.shown_only { 80_000 } else { 16_000 };
    for index in 0..paths {
        let eye_sampler = Sampler::new(1, 0, Stream::Eye, index);
        let light_sampler = Sampler::new(1, 0, Stream::Light, index);
        let lights = light_walks(world, t, &light_sampler, (index % 5) as usize);
        let eyes = eye_walks(world, t, &eye_sampler, (index / 5 % 5) as usize);
        // The emitter that the light walk started from is drawn by the same numbers again.
        let start = world
            .lights
            .sample(light_sampler.u1(0, Purpose::LightPick), light_sampler.u2(0, Purpose::LightPoint))
            .unwrap();
        let path = |light: LightPoint, lights: &[Walk], eyes: &[EyeVertex]| Path {
            light,
            surfaces: lights
                .iter()
                .map(|w| w.vertex)
                .chain(eyes.iter().rev().map(|e| e.walk.vertex))
                .collect(),
            camera: match (eyes.first(), lights.last()) {
                (Some(first), _) => first.walk.vertex.point.position + first.walk.to_previous(),
                (None, Some(last)) => world.camera.lens_point(|| light_sampler.u2(last.depth, Purpose::Lens)),
                (None, None) => world.camera.position,
            },
        };
        let mut count = |kind: usize, path: &Path| {
            checked[kind] += 1;
            with_delta += usize::from(path.surfaces.iter().any(|v| v.bsdf.is_delta()));
        };

        if let Some((last, before)) = eyes.split_last() {
            // s = 0: the eye walk ends on an emitter.
            if let Some(emitter) = world.lights.at(&last.walk.vertex.point) {
                let radiance = emitter.radiance(last.walk.vertex.wo);
                if radiance != Spectrum::ZERO && !before.is_empty() {
                    let path = path(LightPoint::Surface(emitter), &[], before);
                    let got = last.emitted(world, t).x / (last.walk.throughput.x * radiance.x);
                    close("s = 0", got, path.weight(world, t, 0, 0));
                    count(0, &path);
                }
            }
            // s = 0: the eye walk leaves the scene.
            if let Some((sky, value, throughput)) = into_the_sky(world, t, last, &eye_sampler) {
                let path = path(LightPoint::Distant(sky), &[], &eyes);
                close("sky", value.x / (throughput.x * sky.radiance.x), path.weight(world, t, 0, 0));
                count(6, &path);
            }
            // s = 1: next-event estimation.
            let delta = last.walk.vertex.bsdf.is_delta();
            if let Some((value, _)) = last.next_event(world, t, &eye_sampler).filter(|_| !delta) {
                let depth = last.walk.depth;
                let pick = eye_sampler.u1(depth, Purpose::LightPick);
                let (number, preference) =
                    world.lights.choose_for(|| last.walk.vertex.place(), pick).unwrap();
                let light = world.lights.point_on(number, eye_sampler.u2(depth, Purpose::LightPoint));
                preferred += usize::from(preference != 1.0);
                let path = path(light, &[], &eyes);
                let x = &last.walk.vertex;
                let w = path.to(1, 0);
                let plain = last.walk.throughput
                    * x.factor(x.wo, w)
                    * light.toward(x.point.position).unwrap().radiance
                    * (x.cos_ng(w) * path.g(1, 0) / (preference * light.pdf()));
                let weight = path.weight(world, t, 0, 1);
                let [nee, roulette] = path.direct(world, t);
                let [by_nee, by_roulette] = [nee, roulette].map(|m| m * weight / (nee + roulette));
                close("s = 1", value.x / plain.x, by_nee);
                count(1, &path);
                // The same by the roulette over points of lights, where that plays.
                match last.emitter_point(world, t, &light, 1.0) {
                    Some((value, _)) => {
                        close("emitter point", value.x / (plain.x * preference), by_roulette);
                        count(5, &path);
                    }
                    None => assert_eq!(by_roulette, 0.0),
                }
            }
        }
        if let (Some(light), Some(eye)) = (lights.last(), eyes.last())
            && !light.vertex.bsdf.is_delta()
            && !eye.walk.vertex.bsdf.is_delta()
        {
            // 2 <= s <= k-2: a connection.
            let path = path(start, &lights, &eyes);
            let s = lights.len() + 1;
            let offset = light.vertex.point.position - eye.walk.vertex.point.position;
            let m = t.connection(&eye.lobes, offset);
            let m = m.known + m.stored * t.stored(light);
            if let Some((value, _)) = eye.connect(t, light, m, 1.0) {
                let (y, z) = (&light.vertex, &eye.walk.vertex);
                let w = offset.normalize();
                let plain = eye.walk.throughput
                    * z.factor(z.wo, w)
                    * y.factor(-w, y.wo)
                    * light.throughput
                    * (z.cos_ng(w) * y.cos_ng(w) / offset.length_squared());
                close("connection", value.x / plain.x, path.weight(world, t, 0, s));
                count(2, &path);
            }
        }
        if let (Some(last), Some(eye)) = (lights.last(), eyes.last())
            && !last.vertex.bsdf.is_delta()
            && !eye.walk.vertex.bsdf.is_delta()
            && let Some(light) = led_to(world, t, last, &eye.walk.vertex)
        {
            // Merging where the eye walk ends, with a light walk that is led there.
            let path = path(start, &lights, &eyes);
            let (y, z) = (&light.vertex, &eye.walk.vertex);
            let value = eye.merge(t, &light);
            let tries = eye.eta(t) * t.merged(&light);
            let plain = eye.walk.throughput * z.factor(z.wo, y.wo) * light.throughput / tries;
            if tries == 0.0 {
                assert_eq!(value, Spectrum::ZERO);
            } else if plain.x > 0.0 {
                close("merging", value.x / plain.x, path.weight(world, t, 1, lights.len() + 1));
                count(4, &path);
            }
        }
        if let Some(light) = lights.last().filter(|w| !w.vertex.bsdf.is_delta())
            && let Some((_, value, _)) = connect_camera(world, t, light, &light_sampler)
        {
            // s = k-1: seen by the camera.
            let path = path(start, &lights, &[]);
            let k = lights.len() + 2;
            let y = &light.vertex;
            let w = path.to(k - 2, k - 1);
            let plain =
                light.throughput * y.factor(w, y.wo) * (path.g(k - 1, k - 2) * world.camera.pdf_w(-w));
            let tries = t.light_image * t.seen(light);
            close("s = k-1", value.x / plain.x * tries, path.weight(world, t, 0, k - 1));
            count(3, &path);
        }
    }
    println!("paths checked by kind of technique {checked:?}, with delta vertices {with_delta}");
    let kinds = if world.lights.only_area() { 0..6 } else { 0..7 };
    assert!(checked[kinds].iter().all(|&n| n >= 100) && with_delta >= 100, "{checked:?} {with_delta}");
    preferred
}
