//! A coat over a base: both lobes are drawn as their density says, with no more light than there is, from either end.

use super::{any_direction, at_angle};
use crate::support::Random;
use crate::support::chart::Sphere;
use crate::support::distribution::Distribution;
use crate::support::stats::{Family, Moments};
use hrr::bsdf::{Bsdf, Coated, Transport};
use hrr::math::Spectrum;

fn cases() -> Vec<(String, Bsdf)> {
    let mut cases = Vec::new();
    for f0 in [0.04, 0.5, 1.0] {
        for albedo in [0.0, 0.7, 1.0] {
            for (alpha_x, alpha_y) in [(0.0, 0.0), (0.1, 0.1), (0.5, 0.15), (1.0, 1.0)] {
                let albedo = Spectrum::new(albedo, 0.5 * albedo, albedo);
                let coated = Coated::new(Spectrum::new(f0, f0, 0.5 * f0), albedo, alpha_x, alpha_y);
                cases.push((
                    format!("f0 {f0}, albedo {albedo}, alpha {alpha_x} {alpha_y}"),
                    Bsdf::Coated(coated),
                ));
            }
        }
    }
    cases
}

#[test]
fn both_lobes_are_drawn_as_their_density_says() {
    let mut family = Family::default();
    for (alpha, albedo) in [(0.2, 0.7), (0.5, 0.2), (1.0, 1.0)] {
        let bsdf =
            Bsdf::Coated(Coated::new(Spectrum::splat(0.1), Spectrum::splat(albedo), alpha, 0.7 * alpha));
        for wo in [at_angle(0.0), at_angle(60.0), -at_angle(45.0)] {
            let mut rng = Random::new(91);
            let draw = || bsdf.sample(wo, Transport::Radiance, rng.u1(), rng.u2()).map(|s| s.wi);
            let test = Distribution { atlas: &[&Sphere], cells: 12, draws: 50_000 };
            let good = test.test(|wi| bsdf.pdf(wo, *wi), draw);
            family.add(format!("{alpha} {albedo} {wo}: {good:?}"), good.p);
        }
    }
    family.assert();
}

#[test]
fn coats_scatter_no_more_than_they_get() {
    for (name, bsdf) in cases() {
        for angle in [0.0, 30.0, 60.0, 80.0, 89.0] {
            let (wo, mut rng) = (at_angle(angle), Random::new(92));
            let mut albedo = Moments::default();
            for _ in 0..5000 {
                let s = bsdf.sample(wo, Transport::Radiance, rng.u1(), rng.u2());
                albedo.push(s.map_or(0.0, |s| s.weight.x));
            }
            // Facets of a rough coat look at the light from nearer than the surface does, and reflect less than it
            // takes from the base, or a little more.
            let most = 1.02 + 3.0 * albedo.variance_of_mean().sqrt();
            assert!(albedo.mean() < most, "{name} at {angle}: {}", albedo.mean());
        }
    }
}

#[test]
fn coats_are_the_same_from_either_end() {
    let mut rng = Random::new(93);
    for (name, bsdf) in cases() {
        for _ in 0..200 {
            let (a, b) = (any_direction(&mut rng), any_direction(&mut rng));
            let (there, back) = (bsdf.eval(a, b), bsdf.eval(b, a));
            assert!((there - back).length() <= 1e-13 * there.length(), "{name}");
            let Some(s) = bsdf.sample(a, Transport::Radiance, rng.u1(), rng.u2()) else { continue };
            if s.delta {
                assert!(s.pdf == s.pdf_rev && bsdf.glossy().is_none(), "{name}");
                continue;
            }
            assert_eq!((s.pdf, s.pdf_rev), (bsdf.pdf(a, s.wi), bsdf.pdf(s.wi, a)), "{name}");
            let expected = bsdf.eval(a, s.wi) * (s.wi.z.abs() / s.pdf);
            assert!((s.weight - expected).length() <= 1e-13 * expected.length(), "{name}");
        }
    }
}

/// A smooth coat's reflection and what it leaves to the base: F + (1 - F) times the base's share, by sampling.
#[test]
fn a_smooth_coat_leaves_the_rest_to_the_base() {
    let (f0, albedo) = (0.2, 0.6);
    let bsdf = Bsdf::Coated(Coated::new(Spectrum::splat(f0), Spectrum::splat(albedo), 0.0, 0.0));
    for angle in [0.0, 50.0, 75.0] {
        let (wo, mut rng) = (at_angle(angle), Random::new(94));
        let schlick = f0 + (1.0 - f0) * (1.0 - wo.z).powi(5);
        let mut seen = [Moments::default(); 2];
        for _ in 0..50_000 {
            let s = bsdf.sample(wo, Transport::Radiance, rng.u1(), rng.u2());
            let weight = |delta: bool| s.filter(|s| s.delta == delta).map_or(0.0, |s| s.weight.y);
            seen[0].push(weight(true));
            seen[1].push(weight(false));
        }
        // The mean of 1 - F over the cosine-weighted hemisphere.
        let through = (1.0 - f0) * (1.0 - 1.0 / 21.0);
        assert!(seen[0].z_test(schlick, 0.0) > 1e-5, "{angle}: {}", seen[0].mean());
        assert!(
            seen[1].z_test((1.0 - schlick) * albedo * through, 0.0) > 1e-5,
            "{angle}: {}",
            seen[1].mean()
        );
    }
}
