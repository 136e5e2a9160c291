//! What an MTL material means physically.
//!
//! MTL describes looks, not matter, and leaves gaps; the rules here are one reading of it.
//! - `illum` 6 and 7 are glass, and so are 4 and 9 where something shines through (`d` < 1 or `Tr` > 0; `d` wins).
//! - `Kd` and `Ks` together are a diffuse base under a glossy coat that reflects `Ks` head on; `Kd` or `Ks` alone is a
//!   diffuse surface or a metal. `Pm` is how much of a metal it is: a coat that reflects from 0.04 (none) to `Kd` (all)
//!   over a base of (1 - `Pm`) `Kd`. `Pc` without these is a clear coat of reflectance 0.04 `Pc` and roughness `Pcr`.
//!   `illum` 0 and 1 have no `Ks` unless a roughness is given.
//! - `d` (or 1 - `Tr`, or `map_d`) of what is not glass is the probability that a surface is there at all.
//! - Roughness: `hrr_alpha_x` and `hrr_alpha_y` as they are; else alpha = `Pr`^2, which `aniso` stretches
//!   ([Burley 2012], with the aspect sqrt(1 - 0.9 aniso)); else smooth for glass and for `illum` 3, 5 and 7; else
//!   alpha = sqrt(2 / (`Ns` + 2)), the Blinn-Phong lobe's equal; `anisor` turns the frame, 1 being a full turn.

use super::mtl::{Library, MapReference, MtlMaterial};
use super::notes::Notes;
use super::textures::{Content, Textures};
use crate::bsdf::Reflectance;
use crate::error::{Error, Result};
use crate::material::{Maps, Material, Scattering};
use crate::math::Spectrum;
use crate::texture::Texture;
use std::f64::consts::TAU;

/// Keys that have no effect yet unless they are 0.
const UNUSED: [(&str, &str); 1] = [("Ps", "sheen")];
/// Reflectance, head on, of the usual coats and of plain matter: an index of refraction of 1.5.
const DIELECTRIC_F0: f64 = 0.04;
/// Maps that are followed, beside that of the diffuse reflectance.
const FOLLOWED: [&str; 4] = ["map_Pr", "norm", "map_Ke", "map_d"];

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
    let maps = maps(library, m, textures, notes)?;
    // A map of the roughness means the roughness itself where there is no number beside it.
    let roughness = if maps.roughness.is_some() && m.number("Pr").is_none() && !exact(m) {
        Some((1.0, 1.0))
    } else {
        roughness
    };
    let scattering = if glass {
        dielectric(library, m, roughness, notes)?
    } else {
        let mut surface = Surface { kd, ks, roughness, map: None };
        if kd != Spectrum::ZERO || ks == Spectrum::ZERO {
            (surface.kd, surface.map) = diffuse(library, m, kd, textures, notes)?;
        }
        see_through(library, m, opacity, notes);
        surface.scattering(library, m, metalness, notes)
    };

    for (key, what) in UNUSED {
        if m.number(key).is_some_and(|x| x > 0.0) {
            let what = format!("{key} ({what}) is not supported yet");
            notes.add_unsupported(&v.name, key, library.place(m, key), what);
        }
    }
    if m.has_halo() {
        notes.add_unsupported(&v.name, "d_halo", library.place(m, "d"), "d -halo is taken as d".into());
    }
    let uses_kd_map = scattering.albedo_map().is_some();
    let unused = |k: &&str| !(FOLLOWED.contains(k) || uses_kd_map && *k == "map_Kd");
    for key in m.maps().into_iter().filter(unused) {
        notes.add_unsupported(&v.name, key, library.place(m, key), format!("{key} is not used yet"));
    }

    // A writer that leaves Ke out, or black, means the picture itself.
    let emission = match color(v.emissive) {
        Spectrum::ZERO if maps.emission.is_some() => Spectrum::ONE,
        emission => emission,
    };
    let tangent_angle = m.number("anisor").unwrap_or(0.0) * TAU;
    let mut material = Material::new(v.name.clone(), scattering);
    (material.tangent_angle, material.emission) = (tangent_angle, emission);
    if !glass {
        material.opacity = opacity;
    }
    material.set_maps(maps);
    material.unsupported = notes.take_unsupported();
    Ok(material)
}

/// Whether the roughness is given as it is.
fn exact(m: &MtlMaterial) -> bool {
    ["hrr_alpha_x", "hrr_alpha_y"].iter().any(|key| m.number(key).is_some())
}

/// Reads the maps that are followed, but for that of the diffuse reflectance.
fn maps(library: &Library, m: &MtlMaterial, textures: &mut Textures<'_>, notes: &mut Notes) -> Result<Maps> {
    let mut load = |key: &'static str, content: Content| texture(library, m, key, content, textures, notes);
    Ok(Maps {
        roughness: load("map_Pr", Content::Data)?,
        normal: load("norm", Content::Data)?,
        emission: load("map_Ke", Content::Colors)?,
        opacity: load("map_d", Content::Data)?,
    })
}

/// The texture of a map key, where it is given.
fn texture(
    library: &Library,
    m: &MtlMaterial,
    key: &'static str,
    content: Content,
    textures: &mut Textures<'_>,
    notes: &mut Notes,
) -> Result<Option<Texture>> {
    let Some(text) = m.map(key) else { return Ok(None) };
    let place = library.place(m, key);
    let reference =
        MapReference::parse(text).map_err(|e| Error::scene(place.clone(), format!("{key}: {e}")))?;
    if !reference.unused.is_empty() {
        let what = format!("{key}'s {} are not followed", reference.unused.join(", "));
        notes.add_unsupported(&m.values.name, "map_options", place.clone(), what);
    }
    textures.load(&library.file, &reference, content, &place).map(Some)
}

/// What a surface that is not glass is made of.
struct Surface {
    kd: Spectrum,
    ks: Spectrum,
    roughness: Option<(f64, f64)>,
    /// Of `kd`.
    map: Option<Texture>,
}

impl Surface {
    fn scattering(
        self,
        library: &Library,
        m: &MtlMaterial,
        metalness: Option<f64>,
        notes: &mut Notes,
    ) -> Scattering {
        let Self { kd, ks, roughness, map } = self;
        let (alpha_x, alpha_y) = roughness.unwrap_or((0.0, 0.0));
        let coat = m.number("Pc").unwrap_or(0.0).min(1.0);
        if coat > 0.0 && (ks != Spectrum::ZERO || metalness.is_some_and(|pm| pm > 0.0)) {
            let what = "Pc (clear coat) over Ks or a metal is not supported yet; it is left out".into();
            notes.add_unsupported(&m.values.name, "Pc", library.place(m, "Pc"), what);
        }
        match metalness.map(|pm| pm.min(1.0)) {
            Some(pm) if pm >= 1.0 => reflector(kd, roughness),
            Some(pm) if pm > 0.0 => {
                let f0 = Spectrum::splat(DIELECTRIC_F0).lerp(kd, pm);
                Scattering::Coated { albedo: kd * (1.0 - pm), map, f0, alpha_x, alpha_y }
            }
            _ if ks == Spectrum::ZERO && coat > 0.0 => {
                let alpha = m.number("Pcr").unwrap_or(0.0).min(1.0).powi(2);
                let f0 = Spectrum::splat(DIELECTRIC_F0 * coat);
                Scattering::Coated { albedo: kd, map, f0, alpha_x: alpha, alpha_y: alpha }
            }
            _ if ks == Spectrum::ZERO => Scattering::Diffuse { albedo: kd, map },
            _ if kd == Spectrum::ZERO => reflector(ks, roughness),
            _ => Scattering::Coated { albedo: kd, map, f0: ks, alpha_x, alpha_y },
        }
    }
}

/// A metal, smooth where no roughness is given.
fn reflector(tint: Spectrum, roughness: Option<(f64, f64)>) -> Scattering {
    match roughness {
        None => Scattering::Mirror { reflectance: tint },
        Some((alpha_x, alpha_y)) => {
            Scattering::Conductor { reflectance: Reflectance::Schlick { f0: tint }, alpha_x, alpha_y }
        }
    }
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
        let what = "coloured glass (Tf) is not supported yet; it is taken as clear".into();
        notes.add_unsupported(name, "Tf", library.place(m, "Tf"), what);
    }
    let (alpha_x, alpha_y) = roughness.unwrap_or((0.0, 0.0));
    Ok(Scattering::Dielectric { ior, alpha_x, alpha_y })
}

/// Remarks on what would let light through a surface that is not glass.
fn see_through(library: &Library, m: &MtlMaterial, opacity: f64, notes: &mut Notes) {
    let name = &m.values.name;
    if opacity == 0.0 && m.map("map_d").is_none() {
        let key = if m.values.dissolve.is_some() { "d" } else { "Tr" };
        let message = format!("material '{name}' is fully transparent ({key}): nothing of it will be seen");
        notes.add("opacity", &library.place(m, key), message);
    } else if opacity >= 1.0
        && m.number("Pr").is_some()
        && m.color("Tf").is_some_and(|tf| tf != Spectrum::ZERO)
    {
        let message = format!("material '{name}': Tf has no effect without illum 7, which makes it glass");
        notes.add("tf without glass", &library.place(m, "Tf"), message);
    }
}

/// The diffuse reflectance: a colour, and the map that it is multiplied by.
fn diffuse(
    library: &Library,
    m: &MtlMaterial,
    kd: Spectrum,
    textures: &mut Textures<'_>,
    notes: &mut Notes,
) -> Result<(Spectrum, Option<Texture>)> {
    let map = texture(library, m, "map_Kd", Content::Colors, textures, notes)?;
    // A writer that leaves Kd out, or black, means the picture itself.
    let albedo = if map.is_some() && kd == Spectrum::ZERO { Spectrum::ONE } else { kd };
    Ok((albedo, map))
}
