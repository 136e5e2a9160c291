//! Nothing that a path may meet makes a NaN, an infinity, or light.

use super::{COPPER, Case, WHITE, any_direction, cases, conductor, dielectric};
use crate::support::Random;
use glam::{DVec2, DVec3};
use hrr::bsdf::{Bsdf, BsdfSample, Mirror, Transport};
use hrr::math::Spectrum;

/// Models at the ends of their parameters.
fn extremes() -> Vec<Case> {
    let mut all = cases();
    for alpha in [(0.0, 0.0), (1.0, 1e-7), (1e-7, 1.0), (2.0, 2.0), (1e-3, 1e-3)] {
        all.extend([COPPER, WHITE].map(|r| conductor(r, alpha)));
        all.extend([0.2, 1.0, 1.0 + 1e-9, 1.0 + 1.1e-6, 1.33, 5.0].map(|ior| dielectric(ior, alpha)));
    }
    let mut mirror = conductor(WHITE, (0.0, 0.0));
    mirror.bsdf = Bsdf::Mirror(Mirror::new(Spectrum::ONE));
    all.push(mirror);
    all
}

/// Any direction: even over the sphere, near the horizon or the normal by any power of ten, exactly on an axis.
fn direction(rng: &mut Random) -> DVec3 {
    let w = any_direction(rng);
    let small = 10f64.powf(-20.0 * rng.u1()) * (2.0 * rng.u1() - 1.0).signum();
    match (rng.u1() * 8.0) as u32 {
        0 => DVec3::new(w.x, w.y, small).normalize(),
        1 => DVec3::new(w.x * small, w.y * small, w.z).normalize(),
        2 => [DVec3::X, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z][(rng.u1() * 4.0) as usize],
        3 => DVec3::new(w.x, w.y, [0.0, -0.0, f64::MIN_POSITIVE, -1e-300, 1e-160][(rng.u1() * 5.0) as usize])
            .normalize(),
        _ => w,
    }
}

/// Anything in [0,1), often an end.
fn unit(rng: &mut Random) -> f64 {
    match (rng.u1() * 8.0) as u32 {
        0 => 0.0,
        1 => 1.0 - f64::EPSILON / 2.0,
        2 => 10f64.powf(-17.0 * rng.u1()),
        _ => rng.u1(),
    }
}

fn check(case: &Case, wo: DVec3, transport: Transport, s: &BsdfSample) {
    let what = || format!("{} {wo} {transport:?}: {s:?}", case.name);
    let most =
        if transport == Transport::Radiance { (case.index(wo) / case.index(s.wi)).powi(2) } else { 1.0 };
    assert!((s.wi.length() - 1.0).abs() < 1e-14, "{}", what());
    assert!(s.weight.min_element() >= 0.0 && s.weight.max_element() <= most * (1.0 + 1e-12), "{}", what());
    assert!(s.pdf > 0.0 && s.pdf.is_finite() && s.pdf_rev >= 0.0 && s.pdf_rev.is_finite(), "{}", what());
    if !s.delta {
        assert_eq!((s.pdf, s.pdf_rev), (case.bsdf.pdf(wo, s.wi), case.bsdf.pdf(s.wi, wo)), "{}", what());
    }
}

#[test]
fn nothing_makes_nan() {
    let cases = extremes();
    let mut rng = Random::new(61);
    let mut drawn = 0;
    for i in 0..1_000_000 {
        let case = &cases[i % cases.len()];
        let wo = direction(&mut rng);
        let wi = match (rng.u1() * 8.0) as u32 {
            0 => -wo,
            1 => DVec3::new(-wo.x, -wo.y, wo.z),
            2 => wo,
            _ => direction(&mut rng),
        };
        let (f, pdf) = (case.bsdf.eval(wo, wi), case.bsdf.pdf(wo, wi));
        assert!(f.is_finite() && f.min_element() >= 0.0, "{} {wo} {wi}: {f}", case.name);
        assert!(pdf.is_finite() && pdf >= 0.0, "{} {wo} {wi}: {pdf}", case.name);
        for transport in [Transport::Radiance, Transport::Importance] {
            let u = DVec2::new(unit(&mut rng), unit(&mut rng));
            if let Some(s) = case.bsdf.sample(wo, transport, unit(&mut rng), u) {
                drawn += 1;
                check(case, wo, transport, &s);
            }
        }
    }
    assert!(drawn > 1_000_000, "{drawn}");
}

#[test]
fn grazing_views_still_scatter() {
    let mut rng = Random::new(62);
    for case in cases() {
        for cos in [1e-3, 1e-6, 1e-9, 1e-12] {
            for side in [1.0, -1.0] {
                let wo = DVec3::new(
                    (1.0f64 - cos * cos).sqrt() * 0.6,
                    (1.0f64 - cos * cos).sqrt() * 0.8,
                    cos * side,
                );
                let drawn = (0..1000)
                    .filter_map(|_| case.bsdf.sample(wo, Transport::Importance, rng.u1(), rng.u2()))
                    .inspect(|s| check(&case, wo, Transport::Importance, s))
                    .count();
                assert!(drawn > 100, "{} {wo}: {drawn}", case.name);
            }
        }
    }
}

#[test]
fn survival_is_a_probability() {
    for case in extremes() {
        let q = case.bsdf.survival();
        assert!(q > 0.0 && q <= 1.0, "{}: {q}", case.name);
        assert!(case.ior.is_none() || q == 1.0);
    }
    let black = hrr::bsdf::Reflectance::Schlick { f0: Spectrum::ZERO };
    assert!(conductor(black, (0.1, 0.1)).bsdf.survival() > 0.0, "black metal still reflects at grazing");
    assert_eq!(Bsdf::Mirror(Mirror::new(Spectrum::new(0.2, 0.7, 0.1))).survival(), 0.7);
}
