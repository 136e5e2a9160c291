//! Delta lobes, and the rough ones that nearly are.

use super::{COPPER, any_direction, at_angle, conductor, dielectric, views};
use crate::support::Random;
use crate::support::stats::{Family, Moments};
use glam::{DVec2, DVec3};
use hrr::bsdf::{Bsdf, Conductor, Dielectric, Mirror, Transport};
use hrr::math::Spectrum;

const ANY: DVec2 = DVec2::new(0.3, 0.6);
const BOTH: [Transport; 2] = [Transport::Radiance, Transport::Importance];

fn glass() -> Bsdf {
    Bsdf::Dielectric(Dielectric::new(1.5, 0.0, 0.0))
}

/// Fresnel's equations in angles, as he wrote them; no total reflection, no normal incidence.
fn reflected_by_angles(cos_i: f64, eta: f64) -> f64 {
    let i = cos_i.acos();
    let t = (i.sin() / eta).asin();
    0.5 * (((i - t).sin() / (i + t).sin()).powi(2) + ((i - t).tan() / (i + t).tan()).powi(2))
}

#[test]
fn smooth_reflectors_are_mirrors() {
    let white = Spectrum::new(0.9, 0.5, 0.1);
    for wo in views() {
        let reflected = DVec3::new(-wo.x, -wo.y, wo.z);
        let models = [
            (Bsdf::Mirror(Mirror::new(white)), white),
            (Bsdf::Conductor(Conductor::new(COPPER, 0.0, 0.0)), COPPER.at(wo.z.abs())),
            (Bsdf::Conductor(Conductor::new(COPPER, 9e-8, 0.0)), COPPER.at(wo.z.abs())),
        ];
        for (bsdf, weight) in models {
            let s = bsdf.sample(wo, Transport::Radiance, 0.5, ANY).unwrap();
            assert!(bsdf.is_delta() && s.delta && bsdf.glossy().is_none());
            assert_eq!((s.wi, s.weight), (reflected, weight));
            assert_eq!((s.pdf, s.pdf_rev), (wo.z.abs(), wo.z.abs()));
            assert_eq!((bsdf.eval(wo, s.wi), bsdf.pdf(wo, s.wi)), (Spectrum::ZERO, 0.0));
        }
    }
}

#[test]
fn roughness_starts_at_its_limit() {
    for (given, kept) in [((1e-7, 1e-7), (1e-7, 1e-7)), ((0.0, 0.1), (1e-7, 0.1)), ((0.2, -1.0), (0.2, 1e-7))]
    {
        for case in [conductor(COPPER, given), dielectric(1.5, given)] {
            let glossy = case.bsdf.glossy().unwrap();
            assert!(!case.bsdf.is_delta());
            assert_eq!((glossy.alpha_x, glossy.alpha_y, glossy.eta), (kept.0, kept.1, case.ior));
        }
    }
    assert!(glass().is_delta() && glass().glossy().is_none());
    assert!(Bsdf::Conductor(Conductor::new(COPPER, f64::NAN, f64::NAN)).is_delta());
}

#[test]
fn glass_obeys_snell_and_fresnel() {
    for wo in views() {
        let (no, ni) = if wo.z > 0.0 { (1.0, 1.5) } else { (1.5, 1.0) };
        let sin_t = no / ni * (1.0 - wo.z * wo.z).sqrt();
        let f = match wo.z.abs() {
            1.0 => 0.04,
            _ if sin_t > 1.0 => 1.0,
            cos => reflected_by_angles(cos, ni / no),
        };
        for transport in BOTH {
            let s = glass().sample(wo, transport, f - 1e-9, ANY).unwrap();
            assert_eq!((s.wi, s.weight, s.delta), (DVec3::new(-wo.x, -wo.y, wo.z), Spectrum::ONE, true));
            assert!(
                (s.pdf / (f * no * no * wo.z.abs()) - 1.0).abs() < 1e-9 && s.pdf == s.pdf_rev,
                "{wo} {s:?}"
            );
            let Some(s) = glass().sample(wo, transport, f + 1e-9, ANY).filter(|s| s.wi.z * wo.z < 0.0) else {
                assert_eq!(f, 1.0);
                continue;
            };
            assert!(f < 1.0 && (s.wi.truncate() * ni + wo.truncate() * no).length() < 1e-15);
            assert!((s.wi.length() - 1.0).abs() < 1e-15);
            let scale = if transport == Transport::Radiance { (no / ni).powi(2) } else { 1.0 };
            assert!((s.weight - scale).abs().max_element() < 1e-15);
            assert!((s.pdf / ((1.0 - f) * ni * ni * s.wi.z.abs()) - 1.0).abs() < 1e-9);
            assert!((s.pdf_rev / ((1.0 - f) * no * no * wo.z.abs()) - 1.0).abs() < 1e-9);
        }
    }
}

#[test]
fn the_way_back_through_glass_has_the_densities_exchanged() {
    let mut rng = Random::new(51);
    for _ in 0..1000 {
        let wo = any_direction(&mut rng);
        let s = glass().sample(wo, Transport::Importance, rng.u1(), ANY).unwrap();
        let back =
            [0.0, 1.0 - 1e-12].map(|lobe| glass().sample(s.wi, Transport::Importance, lobe, ANY).unwrap());
        let back = back.iter().find(|b| (b.wi - wo).length() < 1e-9).expect("the way back");
        assert!((back.pdf / s.pdf_rev - 1.0).abs() < 1e-9 && (back.pdf_rev / s.pdf - 1.0).abs() < 1e-9);
    }
}

#[test]
fn without_a_difference_of_indices_light_goes_straight_on() {
    for alpha in [0.0, 0.5] {
        let air = Bsdf::Dielectric(Dielectric::new(1.0, alpha, alpha));
        for wo in views() {
            let s = air.sample(wo, Transport::Radiance, 0.0, ANY).unwrap();
            assert!(s.delta && (s.wi + wo).length() < 1e-15 && s.weight == Spectrum::ONE);
        }
    }
}

/// Rough models near the limit do what the smooth ones do, to within their roughness.
#[test]
fn nearly_smooth_is_nearly_the_smooth_thing() {
    let mut family = Family::default();
    for wo in [0.0, 30.0, 60.0, 85.0].map(at_angle).into_iter().flat_map(|w| [w, -w]) {
        let mut rng = Random::new(52);
        let metal = conductor(COPPER, (1e-6, 1e-6)).bsdf;
        let (rough, smooth) = (dielectric(1.5, (1e-6, 1e-6)).bsdf, glass());
        let [reflected, refracted] =
            [0.0, 1.0 - 1e-12].map(|lobe| smooth.sample(wo, Transport::Radiance, lobe, ANY).unwrap());
        let probability = reflected.pdf / (reflected.wi.z.abs() * if wo.z > 0.0 { 1.0 } else { 2.25 });
        let mut share = Moments::default();
        for _ in 0..20_000 {
            // All but 1e-4 of the facets are tilted by less than 100 alpha.
            let u = rng.u2() * DVec2::new(1.0, 0.999);
            let s = metal.sample(wo, Transport::Radiance, 0.5, u).unwrap();
            assert!((s.wi - reflected.wi).length() < 2e-4 && !s.delta);
            assert!((s.weight - COPPER.at(wo.z.abs())).abs().max_element() < 1e-3, "{wo} {s:?}");
            let s = rough.sample(wo, Transport::Radiance, rng.u1(), u).unwrap();
            let reflects = s.wi.z * wo.z > 0.0;
            let twin = if reflects { reflected } else { refracted };
            assert!((s.wi - twin.wi).length() < 1e-3, "{wo} {s:?} {twin:?}");
            assert!((s.weight - twin.weight).abs().max_element() < 1e-3, "{wo} {s:?} {twin:?}");
            share.push(f64::from(reflects));
        }
        let p = if probability > 1.0 - 1e-12 {
            f64::from(share.mean() == 1.0)
        } else {
            share.z_test(probability, 1e-4)
        };
        family.add(format!("{wo}: {probability} reflected, {} seen", share.mean()), p);
    }
    family.assert();
}
