//! Draws the figures of docs/accuracy.md: `cargo run --release --example plot_accuracy`. Prints the numbers, too.

mod chart;

use chart::{Axis, Line, svg};
use glam::{DVec3, Vec3};
use hrr::math::Frame;
use hrr::roulette::{Lobe, MinimumRandom};
use hrr::sampler::counter::{mix, unit};
use std::path::Path;

const RED: &str = "#c0392b";
const ORANGE: &str = "#e08e0b";
const BLUE: &str = "#1f6fb2";
const GREEN: &str = "#2e8b57";

/// Samples behind each point of a curve.
const SAMPLES: u64 = 100_000;

fn u(i: u64, k: u64) -> f64 {
    unit(mix(mix(i ^ 0xacc0) ^ k))
}

fn direction(i: u64, k: u64) -> DVec3 {
    let (z, phi) = (2.0 * u(i, k) - 1.0, std::f64::consts::TAU * u(i, k + 1));
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * phi.cos(), r * phi.sin(), z)
}

/// 10^0, 10^-1/2 .. 10^-7.
fn alphas() -> impl Iterator<Item = f64> {
    (0..=14).map(|i| 10f64.powf(-0.5 * f64::from(i)))
}

/// The slides' formula of K for a unit vector in the lobe's frame, in f32.
fn slides_k(v: Vec3, a: f32) -> f32 {
    let u = (v.x * v.x + v.y * v.y + v.z * v.z).sqrt();
    let d = u - v.z + a * a * (u + v.z);
    4.0 * (a * a) * (a * a) / (d * d)
}

/// K = |x|^2 / h^2 for any vector in the lobe's frame, in f32.
fn our_k(v: Vec3, a: f32) -> f32 {
    let (x, y) = (v.x / a, v.y / a);
    let t2 = x * x + y * y;
    let u = (a * a * t2 + v.z * v.z).sqrt();
    let w = if v.z > 0.0 { u + v.z } else { a * a * t2 / (u - v.z) };
    let h = 0.5 * (t2 / w + w);
    v.length_squared() / (h * h)
}

/// The value below which a share of the errors lies.
fn quantile(errors: &mut [f64], share: f64) -> f64 {
    errors.sort_unstable_by(f64::total_cmp);
    errors[((errors.len() - 1) as f64 * share) as usize]
}

/// Relative error of K within three widths of the axis, by the slides' formula and by ours.
fn lobe() -> String {
    let names = [
        "slides, f32 positions and frames",
        "slides, exact input",
        "ours, f32 positions and frames",
        "ours, exact input",
    ];
    let colors = [RED, ORANGE, BLUE, GREEN];
    let mut curves: [[Vec<(f64, f64)>; 2]; 4] = Default::default();
    println!("relative error of K: alpha, then median and 99 % of {names:?}");
    for alpha in alphas() {
        let a = alpha as f32;
        let alpha = f64::from(a);
        let mut errors: [Vec<f64>; 4] = Default::default();
        for i in 0..SAMPLES {
            let frame = Frame::from_z_tangent(direction(i, 1), direction(i, 3));
            let lobe = Lobe::new(frame, alpha, alpha, 1.0);
            let (r, phi) = (3.0 * u(i, 5).sqrt() * alpha, std::f64::consts::TAU * u(i, 6));
            let local = DVec3::new(r * phi.cos(), r * phi.sin(), 1.0).normalize();
            // The vertices of a scene: eye and light anywhere within [-1,1]^3, known in f32 without error.
            let eye = (direction(i, 7) * u(i, 9)).as_vec3();
            let light = (eye.as_dvec3() + frame.to_world(local) * (0.1 + u(i, 10))).as_vec3();
            let truth = lobe.k(light.as_dvec3() - eye.as_dvec3());
            let x = light - eye;
            let row = |axis: DVec3| axis.as_vec3().dot(x);
            let v = Vec3::new(row(frame.x), row(frame.y), row(frame.z));
            let off = |k: f32, truth: f64| {
                let e = (f64::from(k) / truth - 1.0).abs();
                if e.is_nan() { f64::INFINITY } else { e }
            };
            errors[0].push(off(slides_k(v.normalize(), a), truth));
            errors[2].push(off(our_k(v, a), truth));
            // Exact input: what f32 holds of the direction is taken for the direction.
            let held = local.as_vec3();
            let upright = Lobe::new(Frame { x: DVec3::X, y: DVec3::Y, z: DVec3::Z }, alpha, alpha, 1.0);
            let truth = upright.k(held.as_dvec3());
            errors[1].push(off(slides_k(held, a), truth));
            errors[3].push(off(our_k(held, a), truth));
        }
        print!("{alpha:8.1e}");
        for (curves, errors) in curves.iter_mut().zip(&mut errors) {
            for (curve, share) in curves.iter_mut().zip([0.5, 0.99]) {
                let e = quantile(errors, share);
                curve.push((alpha, e));
                print!("  {e:8.1e}");
            }
        }
        println!();
    }
    let mut lines = Vec::new();
    for (i, [median, worst]) in curves.into_iter().enumerate() {
        lines.push(Line { name: names[i], color: colors[i], dashed: false, points: median });
        lines.push(Line { name: "... 99 of 100 are below", color: colors[i], dashed: true, points: worst });
    }
    let x = Axis { name: "roughness of the lobe", from: 1.0, to: 1e-7, base: Some(10.0), step: 1.0 };
    let y = Axis { name: "relative error of K (median)", from: 1e-9, to: 1e5, base: Some(10.0), step: 2.0 };
    svg("The lobe in f32: the slides' formula and ours", x, y, &lines, (0.01, 0.0))
}

/// The minimum of N uniforms from one: mean relative error and share of zeros.
fn minimum() -> [String; 2] {
    let names = ["1 - (1-u)^(1/N) in f32", "1 - (1-u)^(1/N) in f64", "-expm1(log1p(-u)/N) in f32"];
    let colors = [RED, ORANGE, GREEN];
    let mut mean: [Vec<(f64, f64)>; 3] = Default::default();
    let mut zeros: [Vec<(f64, f64)>; 3] = Default::default();
    println!("minimum of N: log2 N, then mean relative error and share of zeros of {names:?}");
    for log_n in 0..=31 {
        let n = 2f64.powi(log_n);
        let mut sums = [[0.0f64; 2]; 3];
        for i in 0..SAMPLES {
            // 23 bits, centred: f32 holds u and 1 - u.
            let u = ((mix(i) >> 41) as f64 + 0.5) * 2f64.powi(-23);
            let truth = -((-u).ln_1p() / n).exp_m1();
            let v = u as f32;
            let values = [
                f64::from(1.0 - (1.0 - v).powf(1.0 / n as f32)),
                1.0 - (1.0 - u).powf(1.0 / n),
                f64::from(-((-v).ln_1p() / n as f32).exp_m1()),
            ];
            for (sum, value) in sums.iter_mut().zip(values) {
                sum[0] += (value / truth - 1.0).abs() / SAMPLES as f64;
                sum[1] += f64::from(value == 0.0) / SAMPLES as f64;
            }
        }
        print!("{log_n:2}");
        for i in 0..3 {
            print!("  {:8.1e} {:8.1e}", sums[i][0], sums[i][1]);
            mean[i].push((n, sums[i][0]));
            zeros[i].push((n, sums[i][1]));
        }
        println!();
    }
    let lines = |points: [Vec<(f64, f64)>; 3]| {
        let line = |(i, points)| Line { name: names[i], color: colors[i], dashed: i == 1, points };
        points.into_iter().enumerate().map(line).collect::<Vec<_>>()
    };
    let x =
        Axis { name: "N, leaves below the node", from: 1.0, to: 2f64.powi(31), base: Some(2.0), step: 4.0 };
    let y = Axis { name: "mean relative error", from: 1e-16, to: 1.0, base: Some(10.0), step: 2.0 };
    let share = Axis { name: "share of values that are 0", from: 0.0, to: 1.0, base: None, step: 0.2 };
    [
        svg("The minimum of N uniforms: error", x, y, &lines(mean), (0.6, 0.76)),
        svg("The minimum of N uniforms: zeros", x, share, &lines(zeros), (0.01, 0.02)),
    ]
}

/// How often a vertex of probability P is accepted, over P.
fn floor() -> String {
    let ps: Vec<f64> = (0..=76).map(|i| 10f64.powf(-0.25 * f64::from(i) - 1.0)).collect();
    // k / 2^bits < P for ceil(P 2^bits) of the 2^bits values of k.
    let grid = |bits: i32| {
        let step = 2f64.powi(-bits);
        ps.iter().map(|&p| (p, (p / step).ceil() * step / p)).collect::<Vec<_>>()
    };
    // Ours by importance: the number of a node of n = 1/2P leaves is uniform below 1/n, and half of them below P.
    let ours = ps.iter().map(|&p| {
        let n = 0.5 / p;
        let hits =
            (0..SAMPLES).filter(|&i| MinimumRandom::Nested.root(mix(i ^ p.to_bits()), n).xi < p).count();
        (p, hits as f64 / SAMPLES as f64 * 2.0)
    });
    let ours: Vec<_> = ours.collect();
    let (lo, hi) = ours.iter().fold((f64::MAX, 0.0f64), |a, o| (a.0.min(o.1), a.1.max(o.1)));
    println!("accepted over P: ours {lo:.4}..{hi:.4}");
    let lines = [
        Line { name: "uniform numbers of 24 bits (f32)", color: RED, dashed: false, points: grid(24) },
        Line { name: "uniform numbers of 53 bits (f64)", color: ORANGE, dashed: false, points: grid(53) },
        Line { name: "ours", color: GREEN, dashed: false, points: ours },
    ];
    let x = Axis { name: "probability P", from: 0.1, to: 1e-20, base: Some(10.0), step: 2.0 };
    let y = Axis { name: "accepted / P", from: 1e-2, to: 1e10, base: Some(10.0), step: 2.0 };
    svg("Acceptance against the probability that it is divided by", x, y, &lines, (0.01, 0.02))
}

/// Of boxes that touch the ellipsoid: the share that a test says do not.
fn enlarged() -> String {
    let mut curves: [Vec<(f64, f64)>; 2] = Default::default();
    println!("wrongly culled: alpha, enlarged ellipsoid, support planes");
    for alpha in alphas() {
        let mut wrong = [0u64; 2];
        for i in 0..SAMPLES {
            let frame = Frame::from_z_tangent(direction(i, 11), direction(i, 13));
            let lobe = Lobe::new(frame, alpha, alpha, 1.0);
            let a2 = alpha * alpha;
            // A point of the ellipsoid of size 1, and a box that holds it somewhere.
            let s = direction(i, 15) * 0.999_999;
            let (middle, half_length) = (0.5 * (1.0 - a2), 0.5 * (1.0 + a2));
            let touched = frame.to_world(DVec3::new(alpha * s.x, alpha * s.y, middle + half_length * s.z));
            let size = 10f64.powf(-7.0 * u(i, 17));
            let half = DVec3::new(u(i, 18), u(i, 19), u(i, 20)) * size;
            let place = DVec3::new(u(i, 21), u(i, 22), u(i, 23)) * 2.0 - 1.0;
            let center = touched + half * place;
            let radius = half.length();
            let c = frame.to_local(center) - DVec3::new(0.0, 0.0, middle);
            let e = (c.x / (alpha + radius)).powi(2)
                + (c.y / (alpha + radius)).powi(2)
                + (c.z / (half_length + radius)).powi(2);
            wrong[0] += u64::from(e > 1.0);
            wrong[1] += u64::from(lobe.lower_bound(center, half) > 1.0);
        }
        println!("{alpha:8.1e}  {:.4}  {}", wrong[0] as f64 / SAMPLES as f64, wrong[1]);
        for (curve, wrong) in curves.iter_mut().zip(wrong) {
            curve.push((alpha, wrong as f64 / SAMPLES as f64));
        }
    }
    let [enlarged, planes] = curves;
    let lines = [
        Line {
            name: "semi-axes enlarged by the radius of the box's sphere",
            color: RED,
            dashed: false,
            points: enlarged,
        },
        Line { name: "supporting planes (ours)", color: GREEN, dashed: false, points: planes },
    ];
    let x = Axis { name: "roughness of the lobe", from: 1.0, to: 1e-7, base: Some(10.0), step: 1.0 };
    let y =
        Axis { name: "share of touching boxes that are culled", from: 0.0, to: 0.12, base: None, step: 0.02 };
    svg("Boxes culled although they touch the ellipsoid", x, y, &lines, (0.01, 0.02))
}

fn main() -> std::io::Result<()> {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let [error, zeros] = minimum();
    for (name, image) in [
        ("lobe", lobe()),
        ("minimum_error", error),
        ("minimum_zeros", zeros),
        ("floor", floor()),
        ("enlarged", enlarged()),
    ] {
        std::fs::write(docs.join(format!("accuracy_{name}.svg")), image)?;
    }
    Ok(())
}
