//! Lights that are no surfaces: directions and positions are drawn as their densities say, and carry the power that the
//! scene gives.

use crate::support::Random;
use crate::support::chart::{Disc, Sphere};
use crate::support::distribution::Distribution;
use crate::support::scenes;
use crate::support::stats::{Family, Moments};
use glam::{DVec2, DVec3, Vec3};
use hrr::geometry::Mesh;
use hrr::image::Image;
use hrr::light::distant::Surroundings;
use hrr::light::lamp::{Cone, Lamp};
use hrr::light::{Environment, LightPoint, LightSource, Lights, Place};
use hrr::material::Material;
use hrr::math::{Frame, Spectrum, luminance};
use hrr::settings::LightChoice;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

fn sky() -> Arc<Image> {
    // Dark below, a bright spot above, and a row of which every other pixel is black.
    let pixel = |i: usize| match (i % 8, i / 8) {
        (3, 1) => Vec3::new(50.0, 40.0, 10.0),
        (x, 2) => Vec3::splat((x % 2) as f32),
        (_, 3) => Vec3::ZERO,
        _ => Vec3::new(0.5, 0.7, 1.0),
    };
    Arc::new(Image { width: 8, height: 4, pixels: (0..32).map(pixel).collect() })
}

fn lamps() -> [Lamp; 3] {
    let cone = |degrees: f64| Cone {
        axis: DVec3::new(1.0, -2.0, 0.5).normalize(),
        cos_inner: (0.7 * degrees).to_radians().cos(),
        cos_outer: degrees.to_radians().cos(),
    };
    [None, Some(cone(70.0)), Some(cone(140.0))].map(|cone| Lamp {
        position: DVec3::X,
        intensity: Spectrum::new(3.0, 2.0, 1.0),
        cone,
    })
}

#[test]
fn directions_of_lamps_and_skies_are_drawn_as_their_densities_say() {
    let mut family = Family::default();
    let test = |pdf: &dyn Fn(DVec3) -> f64, draw: &dyn Fn(DVec2) -> DVec3| {
        let mut rng = Random::new(81);
        let draw = || Some(draw(rng.u2()));
        Distribution { atlas: &[&Sphere], cells: 16, draws: 100_000 }.test(|w| pdf(*w), draw)
    };
    for (i, lamp) in lamps().iter().enumerate() {
        let good = test(&|w| lamp.pdf(w), &|u| lamp.sample(u));
        family.add(format!("lamp {i}: {good:?}"), good.p);
    }
    for image in [None, Some(sky())] {
        let environment = Environment::new(Spectrum::ONE, image.clone()).unwrap();
        let good = test(&|w| environment.pdf(w), &|u| environment.sample(u));
        assert!((good.total - 1.0).abs() < 1e-3, "{good:?}");
        family.add(format!("sky: {good:?}"), good.p);
        if image.is_some() {
            let even = test(&|_| 1.0 / (4.0 * PI), &|u| environment.sample(u));
            assert!(even.p < 1e-6, "the bright spot gets no more than the rest");
        }
    }
    family.assert();
}

#[test]
fn rays_enter_everywhere_alike_and_squares_are_found_again() {
    let surroundings = Surroundings { center: DVec3::new(1.0, 2.0, 3.0), radius: 4.0 };
    let mut rng = Random::new(82);
    let direction = DVec3::new(0.3, -0.9, 0.2).normalize();
    let frame = Frame::from_z(direction);
    let on_disc = |p: DVec3| frame.to_local(p - surroundings.center).truncate() / surroundings.radius;
    for _ in 0..1000 {
        let u = rng.u2();
        let entry = surroundings.entry(direction, u);
        assert!((frame.to_local(entry - surroundings.center).z + 4.0).abs() < 1e-12);
        let further = entry + direction * (rng.u1() * 8.0);
        assert!((surroundings.square_of(direction, further) - u).length() < 1e-9);
        for lamp in lamps() {
            assert!((lamp.square_of(lamp.sample(u)) - u).length() < 1e-9);
        }
    }
    let draw = || Some(on_disc(surroundings.entry(direction, rng.u2())));
    let entries = Distribution { atlas: &[&Disc], cells: 16, draws: 100_000 };
    let good = entries.test(|_| surroundings.density() * 16.0, draw);
    assert!(good.p > 1e-3, "{good:?}");
}

/// Wherever the sky gives light it is sampled, and what is sampled over its density is all of its light.
#[test]
fn a_sky_keeps_its_power() {
    let environment = Environment::new(Spectrum::new(2.0, 1.0, 0.5), Some(sky())).unwrap();
    let mut rng = Random::new(83);
    let (mut sampled, mut even) = ([Moments::default(); 3], [Moments::default(); 3]);
    for _ in 0..200_000 {
        let w = environment.sample(rng.u2());
        let light = environment.radiance(w) / environment.pdf(w);
        let direction = rng.direction();
        assert!(environment.pdf(direction) > 0.0 || environment.radiance(direction) == Spectrum::ZERO);
        let evenly = environment.radiance(direction) * 4.0 * PI;
        (0..3).for_each(|c| {
            sampled[c].push(light[c]);
            even[c].push(evenly[c]);
        });
    }
    let mut family = Family::default();
    (0..3).for_each(|c| family.add(format!("channel {c}"), sampled[c].welch(&even[c])));
    family.assert();
    assert!(
        sampled[0].variance_of_mean() < 0.2 * even[0].variance_of_mean(),
        "importance sampling does not help"
    );
    // Its poles and borders: top, bottom, middle, right of it.
    let unlit = Environment::new(Spectrum::ONE, Some(sky())).unwrap();
    assert!((unlit.radiance(DVec3::Y) - DVec3::new(0.5, 0.7, 1.0)).length() < 1e-6);
    assert_eq!(unlit.radiance(DVec3::NEG_Y), Spectrum::ZERO);
    let corners = Image { width: 4, height: 1, pixels: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z] };
    let compass = Environment::new(Spectrum::ONE, Some(Arc::new(corners))).unwrap();
    for (quarter, expected) in [(-1.0, DVec3::X), (1.0, DVec3::Y), (3.0, DVec3::Z)] {
        let phi: f64 = quarter * TAU / 8.0;
        let seen = compass.radiance(DVec3::new(phi.sin(), 0.0, -phi.cos()));
        assert!((seen - expected).length() < 1e-6, "{quarter}: {seen}");
    }
}

/// Emission over the densities of light, place and direction has each light's power as its mean.
#[test]
fn emission_carries_the_power_of_every_light() {
    let mut lamp = Material::diffuse("", Spectrum::ZERO);
    lamp.emission = Spectrum::new(4.0, 2.0, 1.0);
    let mesh = Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        triangles: vec![[0, 1, 2]],
        materials: vec![0],
        ..Mesh::default()
    };
    let (position, intensity) = (DVec3::Z, Spectrum::new(1.0, 2.0, 3.0));
    let direction = DVec3::new(0.0, 0.6, -0.8);
    let sources = [
        LightSource::Point { position, intensity },
        LightSource::Spot { position, direction, intensity, inner: 0.5, outer: 1.0 },
        LightSource::Directional { direction, irradiance: intensity },
        LightSource::Environment { color: Spectrum::new(0.3, 0.2, 0.1), image: None },
        // What gives no light is left out.
        LightSource::Point { position, intensity: Spectrum::ZERO },
    ];
    let lights = Lights::new(&mesh, &[lamp], &sources);
    assert_eq!(lights.len(), 5);
    let radius = lights.surroundings().radius;
    assert!((radius / 0.5f64.sqrt() - 1.0).abs() < 1e-4, "{radius}");
    let disc = PI * radius * radius;
    let spot = TAU * (1.0 - 0.5 * (0.5f64.cos() + 1f64.cos()));
    let expected = [
        PI * 0.5 * Spectrum::new(4.0, 2.0, 1.0),
        4.0 * PI * intensity,
        spot * intensity,
        disc * intensity,
        4.0 * PI * disc * Spectrum::new(0.3, 0.2, 0.1),
    ];
    let mut rng = Random::new(84);
    let mut seen = vec![[Moments::default(); 3]; 5];
    for _ in 0..200_000 {
        let light = lights.sample(rng.u1(), rng.u2()).unwrap();
        let emission = light.emit(lights.surroundings(), rng.u2()).unwrap();
        let pdf = light.pdf() * light.emission_pdf(lights.surroundings(), emission.direction);
        let carried = emission.radiance * emission.cos / pdf;
        for (number, moments) in seen.iter_mut().enumerate() {
            let this = if light.number() as usize == number { carried } else { Spectrum::ZERO };
            (0..3).for_each(|c| moments[c].push(this[c]));
        }
        if let LightPoint::Distant(d) = light {
            let found = lights.sky(-d.direction).unwrap();
            assert!(d.delta || (found.pdf == d.pdf && found.radiance == d.radiance));
        }
    }
    let mut family = Family::default();
    for (number, (moments, power)) in seen.iter().zip(expected).enumerate() {
        assert!(luminance(power) > 0.0);
        (0..3).for_each(|c| {
            family.add(format!("light {number}, channel {c}"), moments[c].z_test(power[c], 0.0))
        });
    }
    family.assert();
}

/// Next-event estimation chooses each light as often as it says, wherever that is, and none that may bring light never.
#[test]
fn lights_are_chosen_for_a_place_as_often_as_they_say() {
    let mut scene = scenes::lamps_in_booths();
    scene.lights = scenes::lights_of_every_kind();
    let lights =
        Lights::new(&scene.mesh, &scene.materials, &scene.lights).chosen_by(LightChoice::Place, &scene.mesh);
    let mut rng = Random::new(85);
    let mut by_power: Vec<f64> = (0..lights.len() as u32)
        .map(|number| match lights.point_on(number, rng.u2()) {
            LightPoint::Surface(e) => e.pdf_a * scene.mesh.area(e.point.triangle),
            LightPoint::Lamp(l) => l.probability,
            LightPoint::Distant(d) if d.delta => d.pdf,
            // The sky's density is that of its directions as well: it has the rest.
            LightPoint::Distant(_) => 0.0,
        })
        .collect();
    *by_power.last_mut().unwrap() = 1.0 - by_power.iter().sum::<f64>();
    let lamp = Vec3::new(-0.5, 0.45, -0.05).as_dvec3();
    let places = [
        (DVec3::new(-1.2, 0.0, 0.0), DVec3::Y, false),
        (DVec3::new(0.6, 0.0, 0.1), -DVec3::Y, false),
        (DVec3::new(0.6, 0.0, 0.1), -DVec3::Y, true),
        // In a lamp, in a lamp without size, and so near and so far that squares are no numbers.
        (lamp, DVec3::X, false),
        (DVec3::new(0.6, 0.3, 0.4) - scene.mesh.origin, DVec3::Y, false),
        (lamp + DVec3::splat(1e-170), DVec3::Y, true),
        (DVec3::splat(1e200), DVec3::Z, false),
        (DVec3::splat(1e-200), DVec3::Z, true),
    ];
    let mut family = Family::default();
    for (i, (position, normal, passes)) in places.into_iter().enumerate() {
        let place = || Place { position, normal, passes };
        let mut seen = vec![Moments::default(); lights.len()];
        for _ in 0..20_000 {
            let (number, preference) = lights.choose_for(place, rng.u1()).unwrap();
            assert_eq!(preference, lights.preference(place, number));
            seen.iter_mut().enumerate().for_each(|(n, m)| m.push(f64::from(n as u32 == number)));
        }
        let mut total = 0.0;
        for (number, (moments, by_power)) in seen.iter().zip(&by_power).enumerate() {
            let preference = lights.preference(place, number as u32);
            assert!(preference >= 0.3 - 1e-12 && preference.is_finite(), "place {i}: {preference}");
            total += preference * by_power;
            let p = preference * by_power;
            family.add(format!("place {i}, light {number}: {p}"), moments.z_test(p, 0.0));
        }
        assert!((total - 1.0).abs() < 1e-12, "place {i}: {total}");
    }
    family.assert();
    // The lamp above is asked most often.
    let under = |x: f64| Place { position: DVec3::new(x, 0.0, 0.0), normal: DVec3::Y, passes: false };
    let of = |number: u32, x: f64| lights.preference(|| under(x), number);
    assert!(of(0, -1.1) > 2.0 * of(8, -1.1) && of(8, 1.3) > 2.0 * of(0, 1.3));
}
