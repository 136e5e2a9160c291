//! The maps from the unit square draw what their densities say.

use crate::support::Random;
use crate::support::chart::{Chart, Disc, Sphere, Triangle};
use crate::support::distribution::Distribution;
use crate::support::stats::{Family, ks_p};
use glam::{DVec2, DVec3};
use hrr::math::warp;
use std::f64::consts::{FRAC_1_PI, PI};

fn p_value<P>(chart: &dyn Chart<P>, pdf: impl Fn(&P) -> f64, warp: impl Fn(DVec2) -> P) -> f64 {
    let mut rng = Random::new(11);
    Distribution { atlas: &[chart], cells: 16, draws: 200_000 }.test(pdf, || Some(warp(rng.u2()))).p
}

#[test]
fn warps_draw_what_their_densities_say() {
    let mut family = Family::default();
    family.add("disc", p_value(&Disc, |_| FRAC_1_PI, warp::square_to_disc));
    family.add("triangle", p_value(&Triangle, |_| 2.0, warp::square_to_triangle));
    family.add("sphere", p_value(&Sphere, |_| 0.25 / PI, warp::square_to_sphere));
    let cosine = p_value(&Sphere, |w| warp::cosine_hemisphere_pdf(w.z), warp::square_to_cosine_hemisphere);
    family.add("cosine hemisphere", cosine);
    let mut rng = Random::new(12);
    let sines2 = (0..10_000).map(|_| warp::square_to_cosine_hemisphere(rng.u2())).map(|w| 1.0 - w.z * w.z);
    family.add("squared sines", ks_p(sines2, |x| x));
    family.assert();
}

#[test]
fn a_wrong_density_is_rejected() {
    let cosine_5_percent_off = |w: &DVec3| (w.z.max(0.0) + 0.05 * w.z.max(0.0) * w.x) * FRAC_1_PI;
    assert!(p_value(&Sphere, cosine_5_percent_off, warp::square_to_cosine_hemisphere) < 1e-6);
    assert!(p_value(&Sphere, |_| 0.25 / PI, warp::square_to_cosine_hemisphere) < 1e-6);
    assert!(p_value(&Disc, |_| FRAC_1_PI * 1.02, warp::square_to_disc) < 1e-6);
    assert!(p_value(&Disc, |_| FRAC_1_PI * 0.98, warp::square_to_disc) < 1e-6);
    assert!(p_value(&Triangle, |p| 6.0 * p.x, warp::square_to_triangle) < 1e-6);
}

#[test]
fn corners_of_the_square_stay_inside() {
    let last = 1.0 - f64::EPSILON / 2.0;
    for u in [0.0, 0.5, last].into_iter().flat_map(|x| [0.0, 0.5, last].map(|y| DVec2::new(x, y))) {
        assert!(warp::square_to_disc(u).length() <= 1.0 + 1e-15);
        for w in [warp::square_to_cosine_hemisphere(u), warp::square_to_sphere(u)] {
            assert!((w.length() - 1.0).abs() < 1e-15, "{u}: {w}");
        }
        let b = warp::square_to_triangle(u);
        assert!(b.min_element() >= 0.0 && b.x + b.y <= 1.0 + 1e-15, "{u}: {b}");
    }
}
