//! Emitters: points and directions are drawn as their densities say, and carry the power that the scene gives.

use crate::support::Random;
use crate::support::chart::{Chart, Sphere, Triangle};
use crate::support::distribution::{Distribution, Outcome};
use crate::support::stats::{Family, Moments};
use glam::{DVec2, DVec3, Vec3};
use hrr::geometry::{Mesh, SurfacePoint};
use hrr::light::{AreaLights, EmissionGuide, LightPoint, Lights};
use hrr::material::Material;
use hrr::math::{Spectrum, luminance};
use std::f64::consts::PI;

const RED: Spectrum = Spectrum::new(8.0, 0.1, 0.0);
const BLUE: Spectrum = Spectrum::new(0.0, 0.2, 3.0);

/// Triangle 0 is dark, 1 emits red, 2 is a degenerate emitter, 3 emits blue on both sides, 4 red and is long and thin.
fn mesh() -> Mesh {
    let triangles = [
        [[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [0.0, 5.0, 0.0]],
        [[0.0, 1.0, 1.0], [1.0, 1.5, 0.0], [0.3, 2.0, -1.0]],
        [[1.0, 1.0, 1.0], [2.0, 2.0, 2.0], [3.0, 3.0, 3.0]],
        [[-1.0, -1.0, 2.0], [-1.5, 1.0, 2.5], [-3.0, 0.0, 1.0]],
        [[0.0, -4.0, 1.0], [3.0, -4.0, 1.5], [6.0, -3.99, 2.0]],
    ];
    Mesh {
        positions: triangles.iter().flatten().map(|&p| Vec3::from_array(p)).collect(),
        triangles: (0..5).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        materials: vec![0, 1, 1, 2, 1],
        ..Mesh::default()
    }
}

fn materials() -> Vec<Material> {
    let emitter = |emission, two_sided| {
        let mut material = Material::diffuse("", Spectrum::ZERO);
        (material.emission, material.two_sided_emission) = (emission, two_sided);
        material
    };
    vec![emitter(Spectrum::ZERO, false), emitter(RED, false), emitter(BLUE, true)]
}

/// A triangle of the mesh by barycentric coordinates; points are located by their position alone.
struct OnTriangle<'a> {
    mesh: &'a Mesh,
    triangle: u32,
}

impl Chart<SurfacePoint> for OnTriangle<'_> {
    fn point(&self, s: DVec2) -> Option<(SurfacePoint, f64)> {
        let (uv, measure) = Triangle.point(s)?;
        let point = SurfacePoint::at_barycentric(self.mesh, self.triangle, uv.x, uv.y);
        Some((point, measure * 2.0 * self.mesh.area(self.triangle)))
    }

    fn locate(&self, p: &SurfacePoint) -> Option<DVec2> {
        let [a, b, c] = self.mesh.corners(self.triangle);
        let n = (b - a).cross(c - a);
        let q = p.position - a;
        if p.triangle != self.triangle || q.dot(n).abs() > 1e-12 * n.length() {
            return None;
        }
        let uv = DVec2::new(q.cross(c - a).dot(n), (b - a).cross(q).dot(n)) / n.length_squared();
        Triangle.locate(&uv).filter(|s| s.min_element() > -1e-9 && s.max_element() < 1.0 + 1e-9)
    }
}

fn test_points(mesh: &Mesh, lights: &AreaLights, pdf: impl Fn(&SurfacePoint) -> f64) -> Outcome {
    let mut rng = Random::new(71);
    let charts = [1, 3, 4].map(|triangle| OnTriangle { mesh, triangle });
    let atlas = charts.each_ref().map(|c| c as &dyn Chart<SurfacePoint>);
    let draw = || lights.sample_point(rng.u1(), rng.u2()).map(|e| e.point);
    Distribution { atlas: &atlas, cells: 8, draws: 100_000 }.test(pdf, draw)
}

#[test]
fn points_are_drawn_as_their_density_says() {
    let (mesh, materials) = (mesh(), materials());
    let lights = AreaLights::new(&mesh, &materials);
    assert_eq!(lights.len(), 3);
    let good = test_points(&mesh, &lights, |p| lights.at(p).map_or(0.0, |e| e.pdf_a));
    assert!((good.total - 1.0).abs() < 1e-9 && good.drawn == 1.0, "{good:?}");
    let mut family = Family::default();
    family.add(format!("{good:?}"), good.p);
    family.assert();
    let by_area = 1.0 / [1, 3, 4].map(|t| mesh.area(t)).iter().sum::<f64>();
    assert!(test_points(&mesh, &lights, |_| by_area).p < 1e-6, "power and area are not told apart");
}

#[test]
fn a_point_that_is_hit_is_the_point_that_is_drawn() {
    let (mesh, materials) = (mesh(), materials());
    let lights = AreaLights::new(&mesh, &materials);
    let mut rng = Random::new(72);
    for _ in 0..1000 {
        let drawn = lights.sample_point(rng.u1(), rng.u2()).unwrap();
        let hit = lights.at(&drawn.point).unwrap();
        assert_eq!((drawn.pdf_a, drawn.emission, drawn.two_sided), (hit.pdf_a, hit.emission, hit.two_sided));
        let uv = drawn.point.barycentric;
        let rebuilt = SurfacePoint::at_barycentric(&mesh, drawn.point.triangle, uv.x, uv.y);
        assert!((rebuilt.position - drawn.point.position).length() < 1e-14);
        assert!((rebuilt.ng - drawn.point.ng).length() < 1e-14);
    }
    for dark in [0, 2] {
        assert!(lights.at(&SurfacePoint::at_barycentric(&mesh, dark, 0.2, 0.2)).is_none());
    }
}

#[test]
fn directions_are_drawn_as_their_density_says() {
    let (mesh, materials) = (mesh(), materials());
    let lights = AreaLights::new(&mesh, &materials);
    let mut family = Family::default();
    for triangle in [1, 3, 4] {
        let point = SurfacePoint::at_barycentric(&mesh, triangle, 0.2, 0.3);
        let emitter = lights.at(&point).unwrap();
        let test = |pdf: &dyn Fn(&DVec3) -> f64| {
            let mut rng = Random::new(73);
            let draw = || emitter.sample_direction(rng.u2());
            Distribution { atlas: &[&Sphere], cells: 14, draws: 100_000 }.test(pdf, draw)
        };
        let good = test(&|w| emitter.pdf_w(*w));
        family.add(format!("triangle {triangle}: {good:?}"), good.p);
        let wrong_side = test(&|w| (-emitter.point.ng.dot(*w)).max(0.0) / PI);
        assert!(wrong_side.p < 1e-6);
    }
    family.assert();
}

/// Guided emission: useful directions come often, each as its density says, and all of the power is still there.
#[test]
fn guided_directions_carry_the_same_power() {
    let (mesh, materials) = (mesh(), materials());
    let lights = Lights::new(&mesh, &materials, &[]);
    for triangle in [1, 3] {
        let emitter = lights.at(&SurfacePoint::at_barycentric(&mesh, triangle, 0.2, 0.3)).unwrap();
        let light = LightPoint::Surface(emitter);
        let at = DVec2::new(0.8, 0.3);
        let useful = emitter.sample_direction(at).unwrap();
        let guide = EmissionGuide::learn(&lights, [(light, at, 2.0)].into_iter()).unwrap();
        let mut rng = Random::new(75);
        let (mut near, mut inverse, mut sides) = (Moments::default(), Moments::default(), Moments::default());
        for _ in 0..400_000 {
            let w = emitter.sample_direction(guide.warp(&light, rng.u2())).unwrap();
            near.push(f64::from(w.dot(useful) > 0.99));
            // The mean of 1/density is the measure of all directions: the hemisphere, or both of them.
            inverse.push(emitter.pdf_w(w) / guide.pdf(&light, w, DVec3::ZERO));
            sides.push(emitter.pdf_w(w) / guide.pdf(&light, w, DVec3::ZERO) * w.dot(useful));
        }
        // A third is guided, and so near; unguided, 2 % at most would be.
        assert!(near.mean() > 0.3, "{}", near.mean());
        assert!(inverse.z_test(1.0, 0.0) > 1e-5, "{}", inverse.mean());
        // The cosine lobe's mean direction is 2/3 along the normal; both sides cancel.
        let expected = if emitter.two_sided { 0.0 } else { 2.0 / 3.0 * emitter.point.ng.dot(useful) };
        assert!(sides.z_test(expected, 0.0) > 1e-5, "{} {expected}", sides.mean());
    }
    let nothing = std::iter::empty();
    assert!(EmissionGuide::learn(&lights, nothing).is_none());
}

/// Emission through a point and a direction, over their densities, has the mean pi L A for each side that emits.
#[test]
fn emission_carries_the_power_of_the_scene() {
    let (mesh, materials) = (mesh(), materials());
    let lights = AreaLights::new(&mesh, &materials);
    let power = PI * (RED * (mesh.area(1) + mesh.area(4)) + BLUE * 2.0 * mesh.area(3));
    let mut rng = Random::new(74);
    let mut seen = [Moments::default(); 3];
    for _ in 0..50_000 {
        let emitter = lights.sample_point(rng.u1(), rng.u2()).unwrap();
        let direction = emitter.sample_direction(rng.u2()).unwrap();
        let cos = emitter.point.ng.dot(direction).abs();
        let carried = emitter.radiance(direction) * cos / (emitter.pdf_a * emitter.pdf_w(direction));
        // Power decides who emits: the luminance carried is the same every time.
        assert!((luminance(carried) / luminance(power) - 1.0).abs() < 1e-9);
        (0..3).for_each(|c| seen[c].push(carried[c]));
    }
    let mut family = Family::default();
    (0..3).for_each(|c| family.add(format!("channel {c}"), seen[c].z_test(power[c], 0.0)));
    family.assert();
}

#[test]
fn radiance_leaves_the_front_only_unless_told() {
    let (mesh, materials) = (mesh(), materials());
    let lights = AreaLights::new(&mesh, &materials);
    for (triangle, emission, behind) in [(1, RED, Spectrum::ZERO), (3, BLUE, BLUE)] {
        let emitter = lights.at(&SurfacePoint::at_barycentric(&mesh, triangle, 0.3, 0.3)).unwrap();
        let n = emitter.point.ng;
        let [a, b, c] = mesh.corners(triangle);
        assert!(n.dot((b - a).cross(c - a)) > 0.0, "the front is where corners run counter-clockwise");
        assert_eq!((emitter.radiance(n), emitter.radiance(-n)), (emission, behind));
        assert_eq!(emitter.pdf_w(-n) > 0.0, behind != Spectrum::ZERO);
    }
}

#[test]
fn a_scene_without_emitters_draws_nothing() {
    let dark = vec![materials().swap_remove(0); 3];
    let lights = AreaLights::new(&mesh(), &dark);
    assert!(lights.is_empty() && lights.sample_point(0.5, DVec2::splat(0.5)).is_none());
    assert!(lights.at(&SurfacePoint::at_barycentric(&mesh(), 1, 0.2, 0.2)).is_none());
}
