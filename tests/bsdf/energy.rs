//! No model scatters more than it gets, and narrow lobes lose nothing.

use super::{Case, ROUGHNESS, WHITE, at_angle, conductor, dielectric, views};
use crate::support::Random;
use crate::support::chart::{Chart, Slopes};
use crate::support::quadrature::{Rectangle, integrate};
use crate::support::stats::{Family, Moments};
use glam::{DVec2, DVec3};
use hrr::bsdf::{Transport, fresnel};

/// Error of the integrals below.
const ERROR: f64 = 3e-4;

/// Integral over a chart.
fn integral<P>(chart: &dyn Chart<P>, f: impl Fn(&P) -> f64) -> f64 {
    let density = |s: DVec2| chart.point(s).map_or(0.0, |(p, measure)| f(&p) * measure);
    (0..64).map(|i| integrate(&density, Rectangle::UNIT.cell(i % 8, i / 8, 8), 1e-6)).sum()
}

/// Share of the light from `wo` that is scattered to each chart of the case.
fn albedo(case: &Case, wo: DVec3) -> Vec<f64> {
    let value = |wi: &DVec3| case.bsdf.eval(*wi, wo).y * wi.z.abs();
    case.atlas(wo).iter().map(|chart| integral(&**chart, value)).collect()
}

/// The same share by way of sampling; radiance is counted over n^2, which makes it equal.
fn sampled_albedo(case: &Case, wo: DVec3, transport: Transport) -> Moments {
    let mut rng = Random::new(41);
    let mut weight = || {
        let s = case.bsdf.sample(wo, transport, rng.u1(), rng.u2())?;
        let n = if transport == Transport::Radiance { case.index(s.wi) / case.index(wo) } else { 1.0 };
        Some(s.weight.y * n * n)
    };
    (0..50_000).map(|_| weight().unwrap_or(0.0)).collect()
}

/// The albedo of white facets from the normals seen, with all functions as the books write them: the integral of
/// D_visible(m) G2 / G1(wo) over the normals that reflect `wo` upwards.
fn textbook_albedo(slopes: Slopes, wo: DVec3) -> f64 {
    let (ax, ay) = (slopes.alpha_x, slopes.alpha_y);
    let tan2_over_alpha2 = |w: DVec3| (w.x / w.z / ax).powi(2) + (w.y / w.z / ay).powi(2);
    let alpha2_tan2 = |w: DVec3| (w.x / w.z * ax).powi(2) + (w.y / w.z * ay).powi(2);
    let lambda = |w: DVec3| 0.5 * ((1.0 + alpha2_tan2(w)).sqrt() - 1.0);
    integral(&slopes, |m| {
        let wi = 2.0 * wo.dot(*m) * *m - wo;
        if wo.dot(*m) <= 0.0 || wi.z <= 0.0 {
            return 0.0;
        }
        let d = 1.0 / (std::f64::consts::PI * ax * ay * m.z.powi(4) * (1.0 + tan2_over_alpha2(*m)).powi(2));
        d * wo.dot(*m) / wo.z / (1.0 + lambda(wo) + lambda(wi))
    })
}

#[test]
fn white_metal_neither_gains_nor_hides_light() {
    let mut family = Family::default();
    for roughness in ROUGHNESS {
        let case = conductor(WHITE, roughness);
        for wo in views().into_iter().filter(|wo| wo.z > 0.0) {
            let name = format!("{} from {wo}", case.name);
            let albedo = albedo(&case, wo)[0];
            assert!(albedo <= 1.0 + ERROR, "{name}: {albedo}");
            let book = textbook_albedo(case.slopes, wo);
            assert!((albedo - book).abs() < ERROR, "{name}: {albedo}, by the book {book}");
            let sampled = sampled_albedo(&case, wo, Transport::Radiance);
            assert!(sampled.mean() <= 1.0);
            let p = sampled.z_test(albedo, ERROR);
            family.add(format!("{name}: {albedo} sampled {}", sampled.mean()), p);
        }
    }
    family.assert();
}

#[test]
fn narrow_lobes_lose_nothing() {
    for degrees in [0.0, 45.0, 85.0, 89.9] {
        let wo = at_angle(degrees);
        let mut last = 0.0;
        for alpha in [1.0, 0.3, 0.1, 1e-2, 1e-4, 1e-7] {
            let mean = sampled_albedo(&conductor(WHITE, (alpha, alpha)), wo, Transport::Radiance).mean();
            // (Further down the order is another: from 89.9 degrees alpha 0.01 hides more than alpha 0.1.)
            assert!(mean > last || degrees > 45.0, "{degrees} {alpha}: {mean} after {last}");
            last = mean;
            // To second order in alpha tan, the slopes' standing in each other's light.
            if alpha <= 1e-2 && degrees <= 45.0 || alpha <= 1e-4 && degrees < 89.0 {
                assert!(1.0 - mean < (3.0 * alpha / wo.z).powi(2) + 1e-12, "{degrees} {alpha}: {mean}");
            }
        }
        assert!(1.0 - last < 1e-6);
    }
}

#[test]
fn reflection_and_refraction_share_the_light() {
    let mut family = Family::default();
    for roughness in ROUGHNESS {
        let case = dielectric(1.5, roughness);
        for wo in views() {
            let name = format!("{} from {wo}", case.name);
            let shares = albedo(&case, wo);
            let total = shares[0] + shares[1];
            assert!(total <= 1.0 + ERROR, "{name}: {total}");
            for transport in [Transport::Radiance, Transport::Importance] {
                let sampled = sampled_albedo(&case, wo, transport);
                family.add(
                    format!("{name}: {total} sampled {}", sampled.mean()),
                    sampled.z_test(total, 2.0 * ERROR),
                );
            }
            if roughness.0.max(roughness.1) <= 1e-4 && wo.z.abs() > 0.01 {
                let eta = if wo.z > 0.0 { 1.5 } else { 1.0 / 1.5 };
                let reflected = fresnel::dielectric(wo.z.abs(), eta).0;
                assert!((shares[0] - reflected).abs() < ERROR, "{name}: {shares:?}, smooth {reflected}");
                assert!((total - 1.0).abs() < ERROR, "{name}: {shares:?}");
            }
        }
    }
    family.assert();
}
