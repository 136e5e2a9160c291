//! Image files in Rust alone: OpenEXR through the crate `exr`, PNG through `png`.

use super::{Attributes, Decoded, Image, Value, check_size, gather, rgb_channels, tone};
use exr::prelude::{
    AttributeValue, Compression, Encoding, FlatSamples, Layer, LayerAttributes, LineOrder, ReadChannels,
    ReadLayers, SpecificChannels, Text, Vec2, WritableImage,
};
use glam::Vec3;
use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Seek};
use std::path::Path;

/// An EXR file: channels R, G, B as 32-bit floats, ZIP-compressed. The error is a sentence.
pub fn encode_exr(image: &Image, attributes: &Attributes) -> Result<Vec<u8>, String> {
    let size = (image.width as usize, image.height as usize);
    let channels = SpecificChannels::rgb(|at: Vec2<usize>| {
        let pixel = image.pixels[at.y() * size.0 + at.x()];
        (pixel.x, pixel.y, pixel.z)
    });
    let mut layer_attributes = LayerAttributes::default();
    for (name, value) in attributes.iter() {
        let value = match value {
            Value::Text(text) => AttributeValue::Text(Text::from_slice_unchecked(text.as_bytes())),
            Value::Int(number) => AttributeValue::I32(*number),
            Value::Float(number) => AttributeValue::F32(*number),
        };
        layer_attributes.other.insert(Text::from_slice_unchecked(name.as_bytes()), value);
    }
    let encoding = Encoding {
        compression: Compression::ZIP16,
        line_order: LineOrder::Increasing,
        ..Encoding::default()
    };
    let mut bytes = Cursor::new(Vec::new());
    exr::prelude::Image::from_layer(Layer::new(size, layer_attributes, encoding, channels))
        .write()
        .non_parallel()
        .to_buffered(&mut bytes)
        .map_err(|e| e.to_string())?;
    Ok(bytes.into_inner())
}

/// A PNG file: RGB, 8 bits, sRGB. The error is a sentence.
pub fn encode_png(image: &Image) -> Result<Vec<u8>, String> {
    let data: Vec<u8> = image.pixels.iter().flat_map(|p| tone::to_srgb8(*p, 0.0)).collect();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, image.width, image.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header().map_err(|e| e.to_string())?;
    writer.write_image_data(&data).map_err(|e| e.to_string())?;
    writer.finish().map_err(|e| e.to_string())?;
    Ok(bytes)
}

/// Reads an EXR or PNG file, which it knows by its first bytes. The error is a sentence.
pub fn decode(path: &Path) -> Result<Decoded, String> {
    let mut file = BufReader::new(File::open(path).map_err(|e| e.to_string())?);
    let start = file.fill_buf().map_err(|e| e.to_string())?;
    if start.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        decode_exr(file)
    } else if start.starts_with(b"\x89PNG") {
        decode_png(file)
    } else {
        Err("it is neither EXR nor PNG, and this build has no OpenImageIO to read others".to_owned())
    }
}

fn decode_exr(mut file: impl BufRead + Seek) -> Result<Decoded, String> {
    let meta = exr::meta::MetaData::read_from_buffered(&mut file, false).map_err(|e| e.to_string())?;
    for header in &meta.headers {
        check_size(header.layer_size.width() as u64, header.layer_size.height() as u64)?;
    }
    file.rewind().map_err(|e| e.to_string())?;
    let exr = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(file)
        .map_err(|e| e.to_string())?;
    let layer = exr.layer_data;
    let channels = &layer.channel_data.list;
    let names: Vec<_> = channels.iter().map(|c| c.name.to_string()).collect();
    let [r, g, b] = rgb_channels(names.iter().map(String::as_str))?;
    let (width, height) = (layer.size.width(), layer.size.height());
    if [r, g, b].iter().any(|c| channels[*c].sample_data.len() != width * height) {
        return Err("its colour channels are subsampled".to_owned());
    }
    let value = |channel: usize, i: usize| match &channels[channel].sample_data {
        FlatSamples::F16(samples) => samples[i].to_f32(),
        FlatSamples::F32(samples) => samples[i],
        FlatSamples::U32(samples) => samples[i] as f32,
    };
    let pixels = (0..width * height).map(|i| Vec3::new(value(r, i), value(g, i), value(b, i))).collect();

    let mut found: Vec<(String, Value)> = exr
        .attributes
        .other
        .iter()
        .chain(&layer.attributes.other)
        .filter_map(|(name, value)| {
            let value = match value {
                AttributeValue::Text(text) => {
                    Value::Text(String::from_utf8_lossy(text.as_slice()).into_owned())
                }
                AttributeValue::I32(number) => Value::Int(*number),
                AttributeValue::F32(number) => Value::Float(*number),
                _ => return None,
            };
            Some((String::from_utf8_lossy(name.as_slice()).into_owned(), value))
        })
        .collect();
    found.sort_by(|a, b| a.0.cmp(&b.0));
    let mut attributes = Attributes::new();
    for (name, value) in found {
        attributes.set(name, value);
    }
    Ok(Decoded {
        image: Image { width: width as u32, height: height as u32, pixels },
        display: false,
        attributes,
    })
}

fn decode_png(file: impl BufRead + Seek) -> Result<Decoded, String> {
    let mut decoder = png::Decoder::new(file);
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(|e| e.to_string())?;
    let (width, height) = (reader.info().width, reader.info().height);
    check_size(width.into(), height.into())?;
    let size = reader.output_buffer_size().ok_or("it is too large")?;
    let mut bytes = vec![0; size];
    let frame = reader.next_frame(&mut bytes).map_err(|e| e.to_string())?;
    let bytes = &bytes[..frame.buffer_size()];
    let values: Vec<f32> = match frame.bit_depth {
        png::BitDepth::Sixteen => {
            bytes.chunks_exact(2).map(|b| f32::from(u16::from_be_bytes([b[0], b[1]])) / 65535.0).collect()
        }
        _ => bytes.iter().map(|b| f32::from(*b) / 255.0).collect(),
    };
    let channels = frame.color_type.samples();
    let rgb = if channels < 3 { [0; 3] } else { [0, 1, 2] };
    Ok(Decoded {
        image: Image { width, height, pixels: gather(&values, channels, rgb) },
        display: true,
        attributes: Attributes::new(),
    })
}
