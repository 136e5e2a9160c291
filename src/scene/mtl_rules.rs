//! What an MTL material means physically.
//!
//! MTL describes looks, not matter, and leaves gaps; the rules here are one reading of it.
//! - `illum` 6 and 7 are glass, and so are 4 and 9 where something shines through (`d` < 1 or `Tr` > 0; `d` wins).
//! - `Pm` >= 0.5 is a metal that reflects `Kd`, less is a diffuse surface. Without `Pm`, the stronger of `Kd` and
//!   `Ks` stays: a diffuse surface, or a metal that reflects `Ks`. `illum` 0 and 1 have no `Ks` unless a roughness is
//!   given.
//! - Roughness: `hrr_alpha_x` and `hrr_alpha_y` as they are; else alpha = `Pr`^2, which `aniso` stretches
//!   ([Burley 2012], with the aspect sqrt(1 - 0.9 aniso)); else smooth for glass and for `illum` 3, 5 and 7; else
//!   alpha = sqrt(2 / (`Ns` + 2)), the Blinn-Phong lobe's equal; `anisor` turns the frame, 1 being a full turn.

use super::mtl::{Library, MapReference, MtlMaterial};
use super::notes::Notes;
use super::textures::Textures;
use crate::bsdf::Reflectance;
use crate::error::{Error, Result};
use crate::material::{Material, Scattering};
use crate::math::{Spectrum, luminance};
use std::f64::consts::TAU;

/// Keys that have no effect yet unless they are 0.
const UNUSED: [(&str, &str); 3] = [("Ps", "sheen"), ("Pc", "clear coat"), ("Pcr", "clear coat roughness")];

/// The material that stands for faces without one.
pub(super) fn grey() -> Material {
    Material::diffuse("(none)", Spectrum::splat(0.5))
}

/// Reads a material of a library.
pub(super) fn material(
    library: &Library,
    m: &MtlMaterial,
    textures: &mut Textures<'_>,
    notes: &mut Notes,
) -> Result<Material> {
    let v = &m.values;
    let color = |c: Option<[f64; 3]>| Spectrum::from(c.unwrap_or_default());
    let illum = v.illumination_model.unwrap_or(2);
    let opacity = v.dissolve.or(m.number("Tr").map(|t| 1.0 - t)).unwrap_or(1.0);
    let metalness = m.number("Pm");
    let glossy = ["Pr", "Pm", "hrr_alpha_x", "hrr_alpha_y"].iter().any(|key| m.number(key).is_some());

    let kd = reflectance(library, m, "Kd", color(v.diffuse), notes);
    let ks = if illum >= 2 || glossy { color(v.specular) } else { Spectrum::ZERO };
    let ks = reflectance(library, m, "Ks", ks, notes);
    let roughness = roughness(library, m, illum, notes);

    let glass = matches!(illum, 6 | 7) || (matches!(illum, 4 | 9) && opacity < 1.0);
    let scattering = if glass {
        dielectric(library, m, roughness, notes)?
    } else {
        see_through(library, m, opacity, notes);
        let metal = match metalness {
            Some(pm) => pm >= 0.5,
            None => ks != Spectrum::ZERO && luminance(ks) >= luminance(kd),
        };
        layers(library, m, metal, kd, ks, notes);
        if metal {
            let tint = if metalness.is_some() { kd } else { ks };
            match roughness {
                None => Scattering::Mirror { reflectance: tint },
                Some((alpha_x, alpha_y)) => {
                    Scattering::Conductor { reflectance: Reflectance::Schlick { f0: tint }, alpha_x, alpha_y }
                }
            }
        } else {
            diffuse(library, m, kd, textures, notes)?
        }
    };

    for (key, what) in UNUSED {
        if m.number(key).is_some_and(|x| x > 0.0) {
            let message = format!("material '{}': {key} ({what}) is not supported yet", v.name);
            notes.add(key, &library.place(m, key), message);
        }
    }
    let uses_kd_map = matches!(scattering, Scattering::Diffuse { .. });
    for key in m.maps().into_iter().filter(|&k| !(uses_kd_map && k == "map_Kd")) {
        let message = format!("material '{}': {key} is not used yet", v.name);
        notes.add(key, &library.place(m, key), message);
    }

    let emission = color(v.emissive);
    let tangent_angle = m.number("anisor").unwrap_or(0.0) * TAU;
    let mut material = Material::new(v.name.clone(), scattering);
    (material.tangent_angle, material.emission) = (tangent_angle, emission);
    Ok(material)
}

/// A colour brought into 0..=1, with a remark where that changes it.
fn reflectance(
    library: &Library,
    m: &MtlMaterial,
    key: &'static str,
    c: Spectrum,
    notes: &mut Notes,
) -> Spectrum {
    if c.max_element() > 1.0 {
        let message = format!(
            "material '{}': {key} {:?} is cut to 1, all there is to reflect",
            m.values.name,
            c.to_array()
        );
        notes.add(key, &library.place(m, key), message);
    }
    c.min(Spectrum::ONE)
}

/// GGX roughness along x and y; `None` where `illum` alone calls for a mirror or clear glass.
fn roughness(library: &Library, m: &MtlMaterial, illum: u8, notes: &mut Notes) -> Option<(f64, f64)> {
    let (x, y) = match (m.number("hrr_alpha_x"), m.number("hrr_alpha_y"), m.number("Pr")) {
        (Some(x), Some(y), _) => (x, y),
        (Some(a), None, _) | (None, Some(a), _) => (a, a),
        (None, None, Some(pr)) => {
            let aspect = (1.0 - 0.9 * m.number("aniso").unwrap_or(0.0).min(1.0)).sqrt();
            (pr * pr / aspect, pr * pr * aspect)
        }
        (None, None, None) if matches!(illum, 3..=7 | 9) => return None,
        (None, None, None) => {
            let alpha = (2.0 / (m.values.shininess.unwrap_or(0.0) + 2.0)).sqrt();
            (alpha, alpha)
        }
    };
    if x.max(y) > 1.0 {
        let message = format!("material '{}': roughness ({x}, {y}) is cut to 1, the roughest", m.values.name);
        let key = ["hrr_alpha_x", "hrr_alpha_y"].into_iter().find(|k| m.number(k).is_some()).unwrap_or("Pr");
        notes.add("alpha", &library.place(m, key), message);
    }
    Some((x.min(1.0), y.min(1.0)))
}

fn dielectric(
    library: &Library,
    m: &MtlMaterial,
    roughness: Option<(f64, f64)>,
    notes: &mut Notes,
) -> Result<Scattering> {
    let name = &m.values.name;
    // Half of all exporters write glass without an index of refraction; that of window glass is the convention.
    let ior = m.values.optical_density.unwrap_or(1.5);
    if ior <= 0.0 {
        return Err(Error::scene(
            library.place(m, "Ni"),
            format!("material '{name}': Ni is {ior}; the index of refraction must be positive"),
        ));
    }
    if m.color("Tf").is_some_and(|tf| tf != Spectrum::ONE && tf != Spectrum::ZERO) {
        let message =
            format!("material '{name}': coloured glass (Tf) is not supported yet; it is taken as clear");
        notes.add("tf", &library.place(m, "Tf"), message);
    }
    let (alpha_x, alpha_y) = roughness.unwrap_or((0.0, 0.0));
    Ok(Scattering::Dielectric { ior, alpha_x, alpha_y })
}

/// Remarks on the layer that is left out of a material that has two.
fn layers(library: &Library, m: &MtlMaterial, metal: bool, kd: Spectrum, ks: Spectrum, notes: &mut Notes) {
    let name = &m.values.name;
    if let Some(pm) = m.number("Pm") {
        if pm > 0.0 && pm < 1.0 {
            let taken = if metal { "all metal" } else { "no metal at all" };
            let message = format!("material '{name}' is part metal (Pm {pm}); it is taken as {taken}");
            notes.add("part metal", &library.place(m, "Pm"), message);
        }
        if metal {
            return;
        }
    }
    if kd != Spectrum::ZERO && ks != Spectrum::ZERO {
        let (kept, dropped) = if metal { ("Ks", "Kd") } else { ("Kd", "Ks") };
        let message = format!(
            "material '{name}' has Kd and Ks; a coat over a base is not supported yet: {kept} is kept and {dropped} \
             left out"
        );
        notes.add("coat and base", &library.place(m, dropped), message);
    }
}

/// Remarks on what would let light through a surface that is not glass.
fn see_through(library: &Library, m: &MtlMaterial, opacity: f64, notes: &mut Notes) {
    let name = &m.values.name;
    if opacity < 1.0 {
        let key = if m.values.dissolve.is_some() { "d" } else { "Tr" };
        let message = format!(
            "material '{name}' is {:.0} % transparent ({key}), which is not supported yet: it is taken as opaque; \
             illum 7 makes it glass",
            100.0 * (1.0 - opacity)
        );
        notes.add("opacity", &library.place(m, key), message);
    } else if m.number("Pr").is_some() && m.color("Tf").is_some_and(|tf| tf != Spectrum::ZERO) {
        let message = format!("material '{name}': Tf has no effect without illum 7, which makes it glass");
        notes.add("tf without glass", &library.place(m, "Tf"), message);
    }
}

fn diffuse(
    library: &Library,
    m: &MtlMaterial,
    kd: Spectrum,
    textures: &mut Textures<'_>,
    notes: &mut Notes,
) -> Result<Scattering> {
    let Some(text) = &m.values.diffuse_texture else {
        return Ok(Scattering::Diffuse { albedo: kd, map: None });
    };
    let place = library.place(m, "map_Kd");
    let reference =
        MapReference::parse(text).map_err(|e| Error::scene(place.clone(), format!("map_Kd: {e}")))?;
    if !reference.unused.is_empty() {
        let message = format!(
            "material '{}': map_Kd's {} are not followed",
            m.values.name,
            reference.unused.join(", ")
        );
        notes.add("map options", &place, message);
    }
    // A writer that leaves Kd out, or black, means the picture itself.
    let albedo = if kd == Spectrum::ZERO { Spectrum::ONE } else { kd };
    let map = textures.load(&library.file, &reference, &place)?;
    Ok(Scattering::Diffuse { albedo, map: Some(map) })
}
