//! Values in double precision against the same to 80 digits (`tests/data/bsdf_values.py`).

use super::{WHITE, conductor, dielectric};
use glam::DVec3;
use hrr::bsdf::ggx::Ggx;

#[track_caller]
fn assert_close(got: f64, want: f64, tolerance: f64, line: &str) {
    assert!((got / want - 1.0).abs() < tolerance, "{got} is off by {:e}: {line}", got / want - 1.0);
}

#[test]
fn values_keep_their_digits_in_narrow_lobes() {
    let lines: Vec<_> = include_str!("../data/bsdf_values.txt").lines().collect();
    assert_eq!(lines.len(), 36);
    for line in lines {
        let (lobe, numbers) = line.split_at(1);
        let n: Vec<f64> = numbers.split_whitespace().map(|x| x.parse().unwrap()).collect();
        let alpha = (n[0], n[1]);
        let (wo, wi) = (DVec3::from_slice(&n[2..]), DVec3::from_slice(&n[5..]));
        let (bsdf, h, tolerance) = match lobe {
            // The sum of two nearly opposite doubles is exact: nothing is lost however narrow the lobe.
            "R" => (conductor(WHITE, alpha).bsdf, wo + wi, 1e-14),
            // Scaling by an index rounds: an error of eps in a half vector that matters from alpha on.
            _ => (dielectric(1.5, alpha).bsdf, -(wo + 1.5 * wi), 4e-15 / n[0].min(n[1])),
        };
        assert_close(Ggx::new(alpha.0, alpha.1).unwrap().d(h), n[8], tolerance, line);
        assert_close(bsdf.eval(wo, wi).y, n[9], tolerance, line);
        assert_close(bsdf.pdf(wo, wi), n[10], tolerance, line);
    }
}

/// A direction that takes the way to world space and back is another one by a few eps; the value must bear that.
#[test]
fn frames_cost_no_more_than_rounding() {
    let frame = hrr::math::Frame::from_z(DVec3::new(0.3, -0.5, 0.8).normalize());
    let turn = |w| frame.to_local(frame.to_world(w));
    for line in include_str!("../data/bsdf_values.txt").lines().filter(|l| l.starts_with('R')) {
        let n: Vec<f64> = line[1..].split_whitespace().map(|x| x.parse().unwrap()).collect();
        let bsdf = conductor(WHITE, (n[0], n[1])).bsdf;
        let (wo, wi) = (turn(DVec3::from_slice(&n[2..])), turn(DVec3::from_slice(&n[5..])));
        // The normal turns by eps over the cosine of incidence.
        let tolerance = 1e-14 / n[0].min(n[1]) / (wo + wi).length();
        assert_close(bsdf.eval(wo, wi).y, n[9], tolerance, line);
    }
}
