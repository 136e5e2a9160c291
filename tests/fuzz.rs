//! What the fuzzer runs (docs/fuzzing.md), on bytes from a random number generator.

use crate::support::Random;
use crate::support::calls_of_bytes;
use crate::support::query_of_bytes::check;

/// A string of up to `most` bytes whose first is `what`.
fn bytes(rng: &mut Random, what: u8, most: f64) -> Vec<u8> {
    let mut bytes: Vec<u8> = (0..(rng.u1() * most) as usize).map(|_| (rng.u1() * 256.0) as u8).collect();
    if let Some(first) = bytes.first_mut() {
        *first = what;
    }
    bytes
}

#[test]
fn any_bytes_as_a_query() {
    let mut rng = Random::new(0xf022);
    let mut accepted = [0; 16];
    for i in 0..8000u16 {
        let what = i % 16;
        accepted[usize::from(what)] += check(&bytes(&mut rng, what as u8, 600.0));
    }
    // Everyday numbers, with masks and without, must really find something.
    assert!(accepted[0] > 500 && accepted[8] > 100, "{accepted:?}");
    assert!(accepted.iter().filter(|&&a| a > 0).count() >= 8, "{accepted:?}");
}

#[test]
fn no_bytes_and_few() {
    check(&[]);
    for what in 0..=255 {
        check(&[what]);
        check(&[what, 3, 10]);
        check(&[what; 100]);
        check(&[what; 1000]);
    }
}

#[test]
fn any_bytes_as_calls_of_the_c_interface() {
    let mut rng = Random::new(0xca11);
    // An interpreter gets through fewer (docs/fuzzing.md).
    let (strings, step) = if cfg!(miri) { (30, 51) } else { (1500, 1) };
    let found: usize = (0..strings).map(|i| calls_of_bytes::check(&bytes(&mut rng, i as u8, 3000.0))).sum();
    // Random calls must really find something.
    assert!(found > strings / 2, "{found}");
    calls_of_bytes::check(&[]);
    for what in (0..=255).step_by(step) {
        calls_of_bytes::check(&[what; 500]);
    }
}
