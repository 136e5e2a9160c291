//! FLIP against the authors' own program (`tests/data/flip_values.py`).

use glam::Vec3;
use hrr::image::Image;
use hrr::report::flip;

const PIXELS: [(u32, u32); 8] = [(0, 0), (1, 2), (5, 3), (10, 10), (17, 4), (3, 21), (22, 13), (23, 23)];

/// As in the script.
fn image(width: u32, height: u32, number: u32, test: bool) -> Image {
    let channel = |x: u32, y: u32, c: u32| {
        let (fx, fy, fc) = (f64::from(x), f64::from(y), f64::from(c));
        let value = 0.5 + 0.5 * (0.3 * f64::from(number + 1) * fx + 0.2 * (fc + 1.0) * fy + fc).sin();
        let value = match (number, test) {
            (0, true) => value * 0.9,
            (1, true) if (x * 7 + y * 3 + c).is_multiple_of(11) => 1.0,
            (2, true) if (fx - 10.0).powi(2) + (fy - 8.0).powi(2) < 30.0 => 1.2,
            (2, true) => value - 0.1,
            (3, true) => f64::from(u8::from(c == 2)),
            (3, false) => f64::from(u8::from(c == 1)),
            _ => value,
        };
        value.clamp(0.0, 1.0) as f32
    };
    let at = |x, y| Vec3::new(channel(x, y, 0), channel(x, y, 1), channel(x, y, 2));
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| at(x, y))).collect();
    Image { width, height, pixels }
}

#[test]
fn flip_is_what_its_authors_program_says() {
    let mut lines = 0;
    for line in include_str!("data/flip_values.txt").lines() {
        let numbers: Vec<f64> = line.split(' ').map(|n| n.parse().unwrap()).collect();
        let [width, height, number] = [0, 1, 2].map(|i| numbers[i] as u32);
        let map =
            flip::map(&image(width, height, number, true), &image(width, height, number, false), numbers[3]);
        let mean = map.iter().sum::<f64>() / map.len() as f64;
        // The program computes in single precision.
        assert!((mean - numbers[4]).abs() < 2e-5, "{line}: mean {mean}");
        for (expected, (x, y)) in numbers[5..].iter().zip(PIXELS) {
            let value = map[(y * width + x) as usize];
            assert!((value - expected).abs() < 2e-4, "{line}: {value} at {x}, {y}");
        }
        lines += 1;
    }
    assert_eq!(lines, 12);
}
