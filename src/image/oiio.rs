//! Image files through OpenImageIO.

use super::{Attributes, Decoded, Image, Value, check_size, gather, rgb_channels, tone};
use ::oiio::{AttributeValue, ImageInput, ImageOutput, ImageSpec, Pixel, PixelFormat};
use std::path::Path;

/// An EXR file: channels R, G, B as 32-bit floats, ZIP-compressed. The error is a sentence.
pub fn encode_exr(image: &Image, attributes: &Attributes) -> Result<Vec<u8>, String> {
    let mut spec = spec(image, PixelFormat::F32)?;
    spec.set_attribute("compression", "zip");
    spec.set_attribute("oiio:ColorSpace", "lin_rec709");
    for (name, value) in attributes.iter() {
        let value = match value {
            Value::Text(text) => AttributeValue::String(text.clone()),
            Value::Int(number) => AttributeValue::Int(*number),
            Value::Float(number) => AttributeValue::Float(*number),
        };
        spec.set_attribute(name, value);
    }
    let data: Vec<f32> = image.pixels.iter().flat_map(|p| p.to_array()).collect();
    encode("image.exr", &spec, &data)
}

/// A PNG file: RGB, 8 bits, sRGB. The error is a sentence.
pub fn encode_png(image: &Image) -> Result<Vec<u8>, String> {
    let mut spec = spec(image, PixelFormat::U8)?;
    spec.set_attribute("oiio:ColorSpace", "sRGB");
    let data: Vec<u8> = image.pixels.iter().flat_map(|p| tone::to_srgb8(*p, 0.0)).collect();
    encode("image.png", &spec, &data)
}

/// Reads any file that OpenImageIO knows. The error is a sentence.
pub fn decode(path: &Path) -> Result<Decoded, String> {
    // Only the colours are wanted, and not multiplied by alpha.
    let hints = ImageSpec::new(1, 1, 1, PixelFormat::U8).map_err(sentence)?;
    let hints = hints.with_attribute("oiio:UnassociatedAlpha", 1);
    let mut input = ImageInput::from_path_with_config(path, &hints).map_err(sentence)?;
    let spec = input.image_spec().map_err(sentence)?;
    let [width, height, depth] = spec.dimensions();
    check_size(width.into(), height.into())?;
    if depth != 1 {
        return Err("it is a volume".to_owned());
    }
    let channels = spec.channel_count() as usize;
    let rgb = rgb_channels(spec.channel_names().iter().map(String::as_str))?;
    // Whole numbers are divided here and not by the library, to the same bits as without it.
    let (values, display) = match spec.format() {
        PixelFormat::U8 => (scaled::<u8>(&mut input, &spec, 255.0)?, true),
        PixelFormat::U16 => (scaled::<u16>(&mut input, &spec, 65535.0)?, true),
        _ => (values::<f32>(&mut input, &spec)?, false),
    };
    input.close().map_err(sentence)?;

    let mut found: Vec<_> =
        spec.attributes().iter().filter_map(|(name, v)| Some((name, value(v)?))).collect();
    found.sort_by_key(|(name, _)| *name);
    let mut attributes = Attributes::new();
    for (name, value) in found {
        attributes.set(name, value);
    }
    Ok(Decoded {
        image: Image { width, height, pixels: gather(&values, channels, rgb) },
        display,
        attributes,
    })
}

fn spec(image: &Image, format: PixelFormat) -> Result<ImageSpec, String> {
    ImageSpec::new(image.width, image.height, 3, format).map_err(sentence)
}

fn encode<T: Pixel>(name: &str, spec: &ImageSpec, data: &[T]) -> Result<Vec<u8>, String> {
    let mut output = ImageOutput::to_memory(name, spec).map_err(sentence)?;
    output.write_image(data).map_err(sentence)?;
    output.close_into_bytes().map_err(sentence)
}

fn values<T: Pixel + Default + Clone>(input: &mut ImageInput, spec: &ImageSpec) -> Result<Vec<T>, String> {
    let mut values = vec![T::default(); spec.element_count().map_err(sentence)?];
    input.read_image_into(&mut values).map_err(sentence)?;
    Ok(values)
}

fn scaled<T: Pixel + Default + Clone + Into<f32>>(
    input: &mut ImageInput,
    spec: &ImageSpec,
    full: f32,
) -> Result<Vec<f32>, String> {
    Ok(values::<T>(input, spec)?.into_iter().map(|v| v.into() / full).collect())
}

fn value(value: &AttributeValue) -> Option<Value> {
    match value {
        AttributeValue::String(text) => Some(Value::Text(text.clone())),
        AttributeValue::Int(number) => Some(Value::Int(*number)),
        AttributeValue::Float(number) => Some(Value::Float(*number)),
        _ => None,
    }
}

/// The library's messages, on one line.
fn sentence(error: ::oiio::Error) -> String {
    error.to_string().trim().replace('\n', "; ")
}
