//! Image files: what was written is what is read, whichever backend did either.

use glam::Vec3;
use hrr::image::{self, Attributes, Decoded, Image, Value, pure, tone};
use hrr::sampler::counter::{combine, mix};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// One way to write and read files.
struct Backend {
    name: &'static str,
    encode_exr: fn(&Image, &Attributes) -> Result<Vec<u8>, String>,
    encode_png: fn(&Image) -> Result<Vec<u8>, String>,
    decode: fn(&Path) -> Result<Decoded, String>,
}

const BACKENDS: &[Backend] = &[
    Backend {
        name: "pure",
        encode_exr: pure::encode_exr,
        encode_png: pure::encode_png,
        decode: pure::decode,
    },
    #[cfg(feature = "oiio")]
    Backend {
        name: "oiio",
        encode_exr: image::oiio::encode_exr,
        encode_png: image::oiio::encode_png,
        decode: image::oiio::decode,
    },
];

fn here(name: &str) -> (TempDir, PathBuf) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join(name);
    (directory, path)
}

/// Values of every kind: tiny, huge, negative, in no multiple of a block of 16 rows.
fn picture() -> Image {
    let (width, height) = (19, 37);
    let value = |i: u32| {
        let x = (f64::from(i) * 0.618_033_988_749_895).fract();
        ((x - 0.25) * 10f64.powf(12.0 * x - 6.0)) as f32
    };
    let pixels =
        (0..width * height).map(|i| Vec3::new(value(3 * i), value(3 * i + 1), value(3 * i + 2))).collect();
    Image { width, height, pixels }
}

fn attributes() -> Attributes {
    let mut a = Attributes::new();
    a.set("samplesPerPixel", 64u64);
    a.set("renderTimeSeconds", 12.25f32);
    a.set("hrr:version", "0.1.0");
    a.set("hrr:sceneHash", "00ff00ff00ff00ff");
    a.set("hrr:settings", "integrator = \"lvc+hrr\"\nmax_depth = 24\n");
    a.set("hrr:scene", "Szene mit Umlaut: Küche.toml");
    a.set("hrr:seed", u64::MAX);
    a
}

#[test]
fn exr_keeps_every_bit_and_attribute_between_backends() {
    let picture = picture();
    for writer in BACKENDS {
        for reader in BACKENDS {
            let (_directory, path) = here("a.exr");
            fs::write(&path, (writer.encode_exr)(&picture, &attributes()).unwrap()).unwrap();
            let read = (reader.decode)(&path).unwrap();
            let what = format!("{} -> {}", writer.name, reader.name);
            assert_eq!(read.image, picture, "{what}");
            assert!(!read.display, "{what}");
            for (name, value) in attributes().iter() {
                assert_eq!(read.attributes.get(name), Some(value), "{what}: {name}");
            }
        }
    }
}

#[test]
fn exr_keeps_what_is_not_a_number() {
    let pixels = vec![Vec3::new(f32::NAN, f32::INFINITY, f32::NEG_INFINITY)];
    let odd = Image { width: 1, height: 1, pixels };
    for backend in BACKENDS {
        let (_directory, path) = here("a.exr");
        fs::write(&path, (backend.encode_exr)(&odd, &Attributes::new()).unwrap()).unwrap();
        let pixel = (backend.decode)(&path).unwrap().image.pixels[0];
        assert!(pixel.x.is_nan() && pixel.y == f32::INFINITY && pixel.z == f32::NEG_INFINITY, "{pixel}");
    }
}

#[test]
fn png_holds_the_same_8_bit_values_between_backends() {
    let ramp = |i: u32| tone::decode(i as f32 / 255.0);
    let pixels = (0..256).map(|i| Vec3::new(ramp(i), ramp(255 - i), ramp(i / 2))).collect();
    let picture = Image { width: 32, height: 8, pixels };
    for writer in BACKENDS {
        for reader in BACKENDS {
            let (_directory, path) = here("a.png");
            fs::write(&path, (writer.encode_png)(&picture).unwrap()).unwrap();
            let read = (reader.decode)(&path).unwrap();
            let what = format!("{} -> {}", writer.name, reader.name);
            assert!(read.display, "{what}");
            for (i, pixel) in (0..256u32).zip(&read.image.pixels) {
                let expected = [i, 255 - i, i / 2].map(|v| v as f32 / 255.0);
                assert_eq!(pixel.to_array(), expected, "{what}: pixel {i}");
            }
        }
    }
}

/// Writes a PNG of the given kind with the crate `png`.
fn png(path: &Path, color: png::ColorType, depth: png::BitDepth, width: u32, height: u32, data: &[u8]) {
    let mut encoder = png::Encoder::new(fs::File::create(path).unwrap(), width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.write_header().unwrap().write_image_data(data).unwrap();
}

#[test]
fn grey_alpha_and_16_bits_are_read_alike() {
    use png::{BitDepth, ColorType};
    for backend in BACKENDS {
        let (_directory, path) = here("a.png");
        let read = || (backend.decode)(&path).unwrap().image.pixels;
        png(&path, ColorType::Grayscale, BitDepth::Eight, 2, 1, &[51, 255]);
        assert_eq!(read(), [Vec3::splat(0.2), Vec3::ONE], "{}: grey", backend.name);
        png(&path, ColorType::GrayscaleAlpha, BitDepth::Eight, 1, 1, &[51, 128]);
        assert_eq!(read(), [Vec3::splat(0.2)], "{}: grey with alpha", backend.name);
        png(&path, ColorType::Rgba, BitDepth::Eight, 1, 1, &[255, 51, 0, 128]);
        assert_eq!(read(), [Vec3::new(1.0, 0.2, 0.0)], "{}: not multiplied by alpha", backend.name);
        png(&path, ColorType::Rgb, BitDepth::Sixteen, 1, 1, &[255, 255, 51, 51, 0, 0]);
        assert_eq!(read(), [Vec3::new(1.0, 0.2, 0.0)], "{}: 16 bits", backend.name);
        png(&path, ColorType::Grayscale, BitDepth::One, 2, 1, &[0b0100_0000]);
        assert_eq!(read(), [Vec3::ZERO, Vec3::ONE], "{}: 1 bit", backend.name);
    }
}

#[test]
fn colours_are_made_linear_and_numbers_are_not() {
    let (_directory, path) = here("a.png");
    png(&path, png::ColorType::Rgb, png::BitDepth::Eight, 1, 1, &[255, 188, 0]);
    let colour = image::read(&path).unwrap().pixels[0];
    let data = image::read_data(&path).unwrap().pixels[0];
    assert!((colour - Vec3::new(1.0, 0.5029, 0.0)).length() < 1e-3, "{colour}");
    assert_eq!(data, Vec3::new(1.0, 188.0 / 255.0, 0.0));
}

#[test]
fn half_floats_are_read() {
    use exr::prelude::{SpecificChannels, WritableImage, f16};
    for backend in BACKENDS {
        let (_directory, path) = here("a.exr");
        let channels =
            SpecificChannels::rgba(|_| (f16::from_f32(0.5), f16::ONE, f16::from_f32(1e-4), f16::ZERO));
        exr::prelude::Image::from_channels((3, 2), channels).write().to_file(&path).unwrap();
        let read = (backend.decode)(&path).unwrap().image;
        assert_eq!((read.width, read.height), (3, 2));
        assert_eq!(read.pixels, [Vec3::new(0.5, 1.0, f16::from_f32(1e-4).to_f32()); 6], "{}", backend.name);
    }
}

#[test]
fn write_and_read_go_by_extension() {
    let (directory, exr) = here("a.exr");
    let picture = picture();
    image::check_writable(&exr).unwrap();
    assert!(!exr.exists());
    image::write(&exr, &picture, &attributes()).unwrap();
    assert_eq!(image::read(&exr).unwrap(), picture);
    assert_eq!(image::read_attributes(&exr).unwrap().get("samplesPerPixel"), Some(&Value::Int(64)));

    let png = directory.path().join("a.PNG");
    image::write(&png, &picture.exposed(-2.0), &attributes()).unwrap();
    let read = image::read_data(&png).unwrap();
    for (read, pixel) in read.pixels.iter().zip(&picture.pixels) {
        assert_eq!(read.to_array(), tone::to_srgb8(*pixel, -2.0).map(|v| f32::from(v) / 255.0));
    }
    let left: Vec<_> = fs::read_dir(directory.path()).unwrap().collect();
    assert_eq!(left.len(), 2, "{left:?}");
}

#[test]
fn a_failed_write_leaves_the_old_file() {
    let (_directory, path) = here("a.exr");
    let picture = picture();
    image::write(&path, &picture, &Attributes::new()).unwrap();
    let broken = Image { width: 20, ..picture.clone() };
    image::write(&path, &broken, &Attributes::new()).unwrap_err();
    assert_eq!(image::read(&path).unwrap(), picture);
}

#[test]
fn what_cannot_be_read_is_named() {
    let (directory, missing) = here("none.exr");
    let error = image::read(&missing).unwrap_err();
    assert_eq!(error.exit_code(), 3);
    assert!(
        error.to_string().starts_with(&format!("{}: cannot read the image", missing.display())),
        "{error}"
    );
    for (name, contents) in [
        ("empty.exr", &b""[..]),
        ("text.png", b"not an image at all, but long enough to look like one"),
        ("head.exr", &[0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0]),
        ("head.png", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"),
    ] {
        let path = directory.path().join(name);
        fs::write(&path, contents).unwrap();
        for backend in BACKENDS {
            (backend.decode)(&path).unwrap_err();
        }
        let error = image::read(&path).unwrap_err();
        assert!(error.to_string().contains(name) && !error.to_string().contains('\n'), "{error}");
    }
}

/// Files cut short or with flipped bytes may be refused or read, but nothing panics.
#[test]
fn damaged_files_are_no_danger() {
    let picture = picture();
    for (name, bytes) in [
        ("a.exr", pure::encode_exr(&picture, &attributes()).unwrap()),
        ("a.png", pure::encode_png(&picture).unwrap()),
    ] {
        let (_directory, path) = here(name);
        let mut refused = 0;
        for round in 0..200u64 {
            let mut damaged = bytes.clone();
            let random = |i| combine(mix(round), i) as usize;
            if round % 2 == 0 {
                damaged.truncate(random(0) % bytes.len());
            } else {
                for i in 0..4 {
                    let at = random(2 * i) % 700.min(bytes.len());
                    damaged[at] ^= random(2 * i + 1) as u8;
                }
            }
            fs::write(&path, damaged).unwrap();
            refused += usize::from(pure::decode(&path).is_err());
            // OpenImageIO has tests of its own; and libpng prints a line for every fault.
            if round < 8 {
                BACKENDS.iter().for_each(|backend| drop((backend.decode)(&path)));
            }
        }
        assert!(refused > 80, "{name}: only {refused} refused");
    }
}
