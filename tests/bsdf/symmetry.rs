//! Values, densities and weights agree with each other and from both ends.

use super::{Case, any_direction, cases, views};
use crate::support::Random;
use glam::DVec3;
use hrr::bsdf::Transport;

fn assert_close(a: f64, b: f64, tolerance: f64, what: impl Fn() -> String) {
    assert!((a - b).abs() <= tolerance * a.abs().max(b.abs()), "{}: {a} is not {b}", what());
}

/// Pairs of directions between which something is scattered, most of them in the middle of a lobe.
fn pairs(case: &Case) -> Vec<(DVec3, DVec3)> {
    let mut rng = Random::new(31);
    let mut pairs = Vec::new();
    for wo in views() {
        for _ in 0..100 {
            let drawn = case.bsdf.sample(wo, Transport::Radiance, rng.u1(), rng.u2());
            pairs.extend(drawn.map(|s| (wo, s.wi)));
            pairs.push((wo, any_direction(&mut rng)));
            pairs.push((any_direction(&mut rng), any_direction(&mut rng)));
        }
    }
    pairs
}

#[test]
fn samples_carry_their_own_value_and_densities() {
    for case in cases() {
        let mut rng = Random::new(32);
        for wo in views() {
            for transport in [Transport::Radiance, Transport::Importance] {
                let mut drawn = 0;
                for _ in 0..500 {
                    let Some(s) = case.bsdf.sample(wo, transport, rng.u1(), rng.u2()) else { continue };
                    drawn += 1;
                    let what = || format!("{} {wo} to {}", case.name, s.wi);
                    assert!(!s.delta && (s.wi.length() - 1.0).abs() < 1e-15, "{}", what());
                    assert_eq!(s.pdf, case.bsdf.pdf(wo, s.wi), "{}", what());
                    assert_eq!(s.pdf_rev, case.bsdf.pdf(s.wi, wo), "{}", what());
                    let f = match transport {
                        Transport::Radiance => case.bsdf.eval(wo, s.wi),
                        Transport::Importance => case.bsdf.eval(s.wi, wo),
                    };
                    for c in 0..3 {
                        assert_close(s.weight[c], f[c] * s.wi.z.abs() / s.pdf, 1e-13, what);
                    }
                }
                assert!(drawn > 50, "{} {wo}: {drawn}", case.name);
            }
        }
    }
}

/// f(a, b) / n_a^2 = f(b, a) / n_b^2, which for reflection is Helmholtz's law.
#[test]
fn values_are_reciprocal() {
    for case in cases() {
        let mut seen = 0;
        for (a, b) in pairs(&case) {
            let (ab, ba) = (case.bsdf.eval(a, b), case.bsdf.eval(b, a));
            seen += usize::from(ab.max_element() > 0.0);
            for c in 0..3 {
                let what = || format!("{} {a} {b}", case.name);
                assert_close(ab[c] / case.index(a).powi(2), ba[c] / case.index(b).powi(2), 1e-13, what);
            }
        }
        assert!(seen > 1000, "{}: {seen}", case.name);
    }
}

/// What has no value need not be drawn, what has one must be.
#[test]
fn value_and_density_vanish_together() {
    for case in cases() {
        for (a, b) in pairs(&case) {
            let (f, pdf) = (case.bsdf.eval(a, b).max_element(), case.bsdf.pdf(a, b));
            assert_eq!(f > 0.0, pdf > 0.0, "{} {a} {b}: {f} {pdf}", case.name);
        }
    }
}

#[test]
fn reflectors_look_the_same_from_both_faces() {
    for case in cases().iter().filter(|c| c.ior.is_none()) {
        let flip = |w: DVec3| DVec3::new(w.x, w.y, -w.z);
        for (a, b) in pairs(case) {
            assert_eq!(case.bsdf.eval(a, b), case.bsdf.eval(flip(a), flip(b)));
            assert_eq!(case.bsdf.pdf(a, b), case.bsdf.pdf(flip(a), flip(b)));
            assert!(a.z * b.z > 0.0 || case.bsdf.pdf(a, b) == 0.0);
        }
    }
}
