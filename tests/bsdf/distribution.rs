//! Samplers against densities.

use super::{COPPER, Case, at_angle, cases, conductor, dielectric, views};
use crate::support::Random;
use crate::support::chart::{Chart, Sphere};
use crate::support::distribution::{Distribution, Outcome};
use crate::support::stats::Family;
use glam::DVec3;
use hrr::bsdf::{Bsdf, Transport};

/// The densities of `case` against what `sampler` draws, on charts that follow the lobes.
fn test(case: &Case, sampler: &Bsdf, wo: DVec3, transport: Transport) -> Outcome {
    let atlas = case.atlas(wo);
    let atlas: Vec<_> = atlas.iter().map(|chart| &**chart).collect();
    test_on(&atlas, case, sampler, wo, transport)
}

fn test_on(
    atlas: &[&dyn Chart<DVec3>],
    case: &Case,
    sampler: &Bsdf,
    wo: DVec3,
    transport: Transport,
) -> Outcome {
    let mut rng = Random::new(21);
    let draw = || sampler.sample(wo, transport, rng.u1(), rng.u2()).map(|s| s.wi);
    Distribution { atlas, cells: 10, draws: 50_000 }.test(|wi| case.bsdf.pdf(wo, *wi), draw)
}

#[test]
fn samplers_draw_what_their_densities_say() {
    let mut family = Family::default();
    for (i, case) in cases().iter().enumerate() {
        for (j, wo) in views().into_iter().enumerate() {
            // The direction drawn must not depend on the transport: each takes half the tests.
            let transport = [Transport::Radiance, Transport::Importance][(i + j / 2) % 2];
            let outcome = test(case, &case.bsdf, wo, transport);
            assert_eq!(outcome.outside, 0, "{} from {wo}", case.name);
            family.add(format!("{} from {wo}: {outcome:?}", case.name), outcome.p);
        }
    }
    family.assert();
}

/// The charts above share their formulas with the densities; on the plain sphere nothing is shared. (Seen from 89.9
/// degrees, or with hardly any difference of indices, the features are too fine for it.)
#[test]
fn wide_lobes_hold_on_the_plain_sphere() {
    let mut family = Family::default();
    let wide = |c: &&Case| c.slopes.alpha_x.min(c.slopes.alpha_y) >= 0.05 && c.ior != Some(1.01);
    for case in cases().iter().filter(wide) {
        for wo in views().into_iter().filter(|wo| wo.z.abs() > 0.01) {
            let outcome = test_on(&[&Sphere], case, &case.bsdf, wo, Transport::Radiance);
            family.add(format!("{} from {wo}: {outcome:?}", case.name), outcome.p);
        }
    }
    family.assert();
}

#[test]
fn both_transports_draw_the_same() {
    let mut rng = Random::new(22);
    for case in cases() {
        for wo in views() {
            let (lobe, u) = (rng.u1(), rng.u2());
            let draw = |t| case.bsdf.sample(wo, t, lobe, u).map(|s| (s.wi, s.pdf, s.pdf_rev, s.delta));
            assert_eq!(draw(Transport::Radiance), draw(Transport::Importance), "{}", case.name);
        }
    }
}

#[test]
fn wrong_densities_are_rejected() {
    let rejects = |case: &Case, sampler: &Case, degrees: f64| {
        let outcome = test(case, &sampler.bsdf, at_angle(degrees), Transport::Radiance);
        assert!(outcome.p < 1e-6, "{} taken for {}: {outcome:?}", sampler.name, case.name);
    };
    for alpha in [0.4, 1e-2, 1e-4, 1e-7] {
        for degrees in [0.0, 45.0] {
            let good = conductor(COPPER, (alpha, 2.0 * alpha));
            rejects(&good, &conductor(COPPER, (2.0 * alpha, alpha)), degrees);
            rejects(&good, &conductor(COPPER, (alpha, 2.2 * alpha)), degrees);
            let good = dielectric(1.5, (alpha, 2.0 * alpha));
            rejects(&good, &dielectric(1.5, (alpha, 2.2 * alpha)), degrees);
            rejects(&good, &dielectric(1.6, (alpha, 2.0 * alpha)), degrees);
        }
    }
}

#[test]
fn a_density_off_by_a_factor_is_rejected() {
    for alpha in [(0.1, 0.1), (1e-4, 1e-4), (1e-7, 1e-7), (1e-4, 1e-2)] {
        let case = conductor(COPPER, alpha);
        let (wo, mut rng) = (at_angle(45.0), Random::new(23));
        let charts = case.atlas(wo);
        let test = Distribution { atlas: &[&*charts[0]], cells: 10, draws: 50_000 };
        for factor in [0.98, 1.02] {
            let draw = || case.bsdf.sample(wo, Transport::Radiance, rng.u1(), rng.u2()).map(|s| s.wi);
            let outcome = test.test(|wi| factor * case.bsdf.pdf(wo, *wi), draw);
            assert!(outcome.p < 1e-6, "{} {factor}: {outcome:?}", case.name);
        }
    }
}
